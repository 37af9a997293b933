"""Random small scenes by seed: boxes, spheres, cylinders, plates, corners, cars, panes, a ground; one receiver, arrays,
and a receiver elsewhere."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

import raychan as rc

_MATERIALS = {
    "film": rc.Material(name="film", eps_r=2.5, thickness=0.003),
    "pane": rc.Material(name="pane", eps_r=6.5, sigma=0.3, thickness=0.005),
}
_OPAQUE = ("pec", "pec", "metal", "concrete", "wood", "plastic", "glass")


@dataclass(frozen=True)
class RandomScene:
    """A scene of a seed; `text` says what is in it."""

    seed: int
    radar: rc.Radar
    bodies: tuple[rc.Body, ...]
    tolerance_db: float
    bounces: int
    text: str

    def scene(self) -> rc.Scene:
        """Return a scene that nothing has used yet."""
        model = {"max_bounces": self.bounces, "tolerance_db": self.tolerance_db}
        return rc.Scene(bodies=list(self.bodies), radar=self.radar, model=model, materials=_MATERIALS)


def random_scene(seed: int) -> RandomScene:
    """Return the scene of a seed."""
    rng = np.random.default_rng(seed)
    tolerance, bounces = float(rng.choice([1.0, 0.5])), int(rng.choice([1, 2, 3]))
    radar, kind = _radar(rng)
    bodies = []
    if rng.random() < 0.6:
        material = str(rng.choice(["asphalt", "concrete"]))
        bodies.append(rc.Body(name="ground", shape="ground", params={"size": 60.0}, material=material))
    wave = radar.waveform
    farthest = min(14.0, 0.85 * wave.range_resolution * wave.n_samples * (1.0 if wave.complex_sampling else 0.5))
    bodies += _apart([_body(rng, f"b{i}", farthest) for i in range(int(rng.integers(1, 5)))])
    if rng.random() < 0.25:
        bodies.append(_wall(rng))
    if rng.random() < 0.25:
        bodies.append(_pane(rng))
    held = ", ".join(f"{b.shape} {b.material}" if b.material else str(b.shape) for b in bodies)
    text = f"{kind} {radar.waveform.carrier / 1e9:.0f} GHz, {bounces} bounces, {tolerance:g} dB: {held}"
    return RandomScene(seed, radar, tuple(bodies), tolerance, bounces, text)


def _radar(rng: np.random.Generator) -> tuple[rc.Radar, str]:
    carrier = float(rng.choice([77e9, 77e9, 24e9]))
    half = 1.5e8 / carrier
    waveform = rc.Waveform(
        carrier=carrier,
        bandwidth=float(rng.choice([300e6, 500e6])),
        chirp_duration=40e-6,
        n_chirps=32,
        n_samples=64,
        complex_sampling=bool(rng.random() < 0.8),
    )
    kind = str(rng.choice(["one", "one", "one", "mimo", "array", "bistatic", "H", "both"]))
    more: dict[str, Any] = {"position": (0.0, 0.0, float(rng.uniform(0.4, 1.2))), "noise": bool(rng.random() < 0.85)}
    more["power"] = float(10.0 ** rng.uniform(-1.5, 0.5))
    if kind == "mimo":
        more |= {**rc.mimo_array(2, 2, half), "multiplexing": "tdm"}
    elif kind == "array":
        more["elements"] = rc.uniform_array(int(rng.choice([2, 4, 8])), half)
    elif kind == "bistatic":
        more["rx_position"] = tuple(float(rng.uniform(*x)) for x in ((-1, 2), (-5, 5), (0.4, 1.5)))
    elif kind == "H":
        more["antenna"] = rc.IsotropicAntenna(polarization="H", front=True)
    elif kind == "both":
        more["rx_polarization"] = "both"
    return rc.Radar(waveform=waveform, **more), kind if more["noise"] else f"{kind} without noise"


def _apart(bodies: list[rc.Body]) -> list[rc.Body]:
    """Return those bodies that stand clear of the ones before them."""
    kept: list[rc.Body] = []
    for body in bodies:
        reach = [float(np.linalg.norm(b.geometry.vertices, axis=1).max()) for b in (body, *kept)]
        gaps = (
            np.linalg.norm(np.subtract(body.position, b.position)) - r for b, r in zip(kept, reach[1:], strict=True)
        )
        if all(gap > reach[0] for gap in gaps):
            kept.append(body)
    return kept


def _body(rng: np.random.Generator, name: str, farthest: float) -> rc.Body:
    shape = str(
        rng.choice(
            ["sphere", "sphere", "box", "box", "cylinder", "plate", "trihedral", "dihedral", "bench", "prism", "car"]
        )
    )
    x = float(rng.uniform(4.0, farthest))
    y, z, facing = float(rng.uniform(-0.4, 0.4)) * x, float(rng.uniform(0.4, 1.2)), 180.0
    yaw, tilt, params = float(rng.uniform(-180.0, 180.0)), 0.0, dict[str, Any]()
    if shape == "sphere":
        params = {"radius": float(rng.uniform(0.1, 0.5)), "max_sag": 0.0006}
        z = max(z, params["radius"] + 0.05)
    elif shape == "box":
        params = dict(zip(("length", "width", "height"), map(float, rng.uniform(0.2, 1.2, 3)), strict=True))
        z, tilt = 0.9, 15.0
    elif shape == "cylinder":
        params = {"radius": float(rng.uniform(0.05, 0.3)), "height": float(rng.uniform(0.3, 1.5)), "max_sag": 0.0006}
        z, tilt = 0.9, 10.0
    elif shape == "plate":
        params = {"width": float(rng.uniform(0.2, 1.0)), "height": float(rng.uniform(0.2, 1.0))}
        yaw = facing + float(rng.uniform(-8.0, 8.0)) if rng.random() < 0.6 else yaw
    elif shape in ("trihedral", "dihedral"):
        params = {"size": float(rng.uniform(0.1, 0.4))}
        params |= {"height": float(rng.uniform(0.1, 0.5))} if shape == "dihedral" else {}
        # Towards the radar, and up to 25 deg off.
        yaw = facing + float(np.degrees(np.arctan2(y, x))) + float(rng.uniform(-25.0, 25.0))
    else:
        z = 0.0
        if shape == "prism":
            params, z = {"outline": [(-0.4, -0.3), (0.5, -0.3), (0.2, 0.4)], "height": 0.8}, 0.1
    known = {"material": str(rng.choice((*_OPAQUE, "pane", "film")))} if shape in ("sphere", "box", "plate") else {}
    turned = {k: float(rng.uniform(-tilt, tilt)) for k in ("pitch_deg", "roll_deg")} if tilt else {}
    moves = (float(rng.uniform(-8.0, 8.0)), float(rng.uniform(-2.0, 2.0)), 0.0) if rng.random() < 0.5 else (0.0,) * 3
    return rc.Body(
        name=name, shape=shape, params=params, position=(x, y, z), yaw_deg=yaw, velocity=moves, **known, **turned
    )


def _wall(rng: np.random.Generator) -> rc.Body:
    place = float(rng.uniform(4.0, 9.0)), float(rng.choice([-1.0, 1.0]) * rng.uniform(2.5, 5.0)), 0.0
    params = {"length": float(rng.uniform(4.0, 10.0)), "height": 3.0}
    return rc.Body(
        name="wall", shape="wall", params=params, position=place, material=str(rng.choice(["concrete", "metal"]))
    )


def _pane(rng: np.random.Generator) -> rc.Body:
    place = float(rng.uniform(1.5, 3.0)), float(rng.uniform(-0.5, 0.5)), 1.0
    params = {"width": float(rng.uniform(0.6, 2.0)), "height": 1.5}
    yaw = 180.0 + float(rng.uniform(-25.0, 25.0))
    return rc.Body(
        name="pane",
        shape="plate",
        params=params,
        position=place,
        yaw_deg=yaw,
        material=str(rng.choice(["pane", "film"])),
    )
