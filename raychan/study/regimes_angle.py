"""Regimes of direction: grazing incidence, edge-on plates, exchange of transmitter and receiver."""

from __future__ import annotations

from typing import Any

import numpy as np

from raychan.run.rcs import rcs
from raychan.run.specular_paths import specular_paths
from raychan.study.regimes_base import (
    FREQUENCY,
    LAMBDA,
    Outcome,
    Regime,
    Row,
    amplitudes,
    at_most,
    far,
    geometry_of,
    plate_far,
    same_db,
)
from raychan.units import EPS0
from raychan.world.body import Body
from raychan.world.material import Material
from raychan.world.scene import Scene
from raychan.world.shapes import build

_ANGLES = (0.0, 30.0, 60.0, 75.0, 80.0, 85.0, 88.0, 89.0, 89.5, 89.8, 89.9)
_PO = "closed form: physical optics, one sinc an axis (Balanis 2012, eq. 11-44)"


def grazing(quick: bool) -> Outcome:
    """Check incidence up to 89.9 deg: side lobes and mirror direction of a plate, and a road at grazing incidence."""
    rows: list[Row] = []
    lobes, mirror = [], []
    k = 2.0 * np.pi / LAMBDA
    for angle in _ANGLES:
        s = np.sin(np.radians(angle))
        # A width near 0.1 m whose pattern has the crest of a side lobe at this angle.
        width = 0.1 if s == 0.0 else (round(k * 0.1 * s / np.pi - 0.5) + 0.5) * np.pi / (k * s)
        plate = build("plate", {"width": float(width), "height": 0.05})
        back = rcs(plate, FREQUENCY, angle, tolerance_db=0.05, max_bounces=1)
        rows.append(same_db(f"side lobe at {angle:g} deg", float(back.sigma), plate_far(width, 0.05, angle), 0.05, _PO))
        on = rcs(plate, FREQUENCY, angle, tolerance_db=0.05, max_bounces=1, rx_azimuth_deg=-angle)
        exact = 4 * np.pi * (width * 0.05 * np.cos(np.radians(angle)) / LAMBDA) ** 2
        rows.append(same_db(f"mirror direction at {angle:g} deg", float(on.sigma), exact, 0.05, _PO))
        lobes.append(rows[-2].seen)
        mirror.append(rows[-1].seen)
    ground = _ground()
    curves = {"angle": np.array(_ANGLES), "side lobe": np.array(lobes), "mirror direction": np.array(mirror)}
    return Outcome(rows + ground, curves)


def _ground() -> list[Row]:
    """Return checks of the two-ray path between points low over a road, at grazing angles of 1, 0.1 and 0.01 deg."""
    rows = []
    eps, far_away = complex(3.18, -0.52 / (2 * np.pi * FREQUENCY * EPS0)), 200.0
    road = Material(3.18, 0.52)
    for low in (1.0, 0.1, 0.01):
        h = 0.5 * far_away * np.tan(np.radians(low))
        scene = Scene(
            bodies=[Body(name="road", shape="ground", params={"size": 1000.0}, material=road)], frequency=77e9
        )
        p = specular_paths(scene, (0, 0, h), (far_away, 0, h), max_bounces=1)
        if len(p.length) != 2:
            rows.append(
                Row(f"two rays at {low:g} deg over a road", 2, len(p.length), 0, "paths", "closed form: images")
            )
            continue
        # The difference of squares over the sum: no cancellation.
        extra = 4 * h * h / (np.hypot(far_away, 2 * h) + far_away)
        phase = abs(float(p.length[1] - p.length[0]) - extra) * 2 * np.pi / LAMBDA
        rows.append(
            Row(f"detour at {low:g} deg over a road", 0.0, phase, 1e-3, "rad", "closed form: image (length difference)")
        )
        sine = 2 * h / p.length[1]
        root = np.sqrt(eps - (1 - sine**2))
        for name, a, i in (("V", eps * sine, 0), ("H", sine + 0j, 1)):
            gain = abs(p.gain[1, i, i]) / (LAMBDA / (4 * np.pi * p.length[1]))
            exact = abs((a - root) / (a + root))
            rows.append(same_db(f"reflection {name} at {low:g} deg", gain**2, exact**2, 1e-6, "closed form: Fresnel"))
    return rows


def edge_on(quick: bool) -> Outcome:
    """Check plates seen along their plane, alone and as faces of bodies."""
    plate = build("plate", {"width": 0.1, "height": 0.05})
    rows = []
    for angle in (90.0, -90.0):
        r = rcs(plate, FREQUENCY, angle)
        rows.append(at_most(f"plate at {angle:g} deg", float(r.sigma), 1e-20, "m2", "closed form: no area is seen"))
    for off in (1e-2, 1e-4, 1e-6):
        r = rcs(plate, FREQUENCY, 90.0 - off, tolerance_db=0.05)
        rows.append(
            same_db(f"plate {off:g} deg off its edge", float(r.sigma), plate_far(0.1, 0.05, 90.0 - off), 0.05, _PO)
        )
    box = build("box", {"length": 0.2, "width": 0.1, "height": 0.05})
    face = 4 * np.pi * (0.1 * 0.05 / LAMBDA) ** 2
    r = rcs(box, FREQUENCY, 0.0, tolerance_db=0.05)
    rows.append(same_db("box head-on, four faces edge-on", float(r.sigma), face, 0.01, _PO))
    dihedral = build("dihedral", {"size": 0.1, "height": 0.05})
    for angle in (45.0, -45.0):
        r = rcs(dihedral, FREQUENCY, angle, tolerance_db=0.05)
        name = f"dihedral at {angle:+g} deg, along one face"
        rows.append(same_db(name, float(r.sigma), face, 0.01, "closed form: the other face alone"))
    near = rcs(box, FREQUENCY, 0.0, distance=50.0, tolerance_db=0.05)
    exact = face * (50.0 / 49.9) ** 4
    # At 50 m the curvature of the wave over the face takes 0.002 dB.
    rows.append(same_db("box head-on from 50 m", float(near.sigma), exact, 0.02, "closed form: face at 49.9 m"))
    return Outcome(rows)


def exchange(quick: bool) -> Outcome:
    """Exchange transmitter and receiver: cross-sections in both polarisations, and specular paths of random rooms."""
    rng = np.random.default_rng(11)
    rows: list[Row] = []
    ways = ("VV", "HH", "VH", "HV")
    shapes: tuple[tuple[str, dict[str, Any]], ...] = (
        ("trihedral", {"size": 0.1}),
        ("dihedral", {"size": 0.1}),
        ("box", {}),
        ("cylinder", {"height": 0.2}),
    )
    one_way = []
    for name, params in shapes[: 2 if quick else 4]:
        if name == "box":
            params = {"length": 0.2, "width": 0.1, "height": 0.1}
        mesh, worst = build(name, params), 0.0
        for way in ways:
            a, b = rng.uniform(-40, 40, 2), rng.uniform(-30, 30, 2)
            there = rcs(mesh, FREQUENCY, a[0], b[0], way, tolerance_db=0.1, rx_azimuth_deg=a[1], rx_elevation_deg=b[1])
            back = rcs(
                mesh, FREQUENCY, a[1], b[1], way[::-1], tolerance_db=0.1, rx_azimuth_deg=a[0], rx_elevation_deg=b[0]
            )
            if there.sigma > 1e-12:
                worst = max(worst, abs(10 * np.log10(float(back.sigma / there.sigma))))
        geometry = geometry_of(mesh)
        one, two = far(a[0], b[0]), far(a[1], b[1])
        s, t = amplitudes(geometry, one, two, step=2), amplitudes(geometry, two, one, step=2).T
        one_way.append(float(20 * np.log10(np.linalg.norm(s) / np.linalg.norm(t))))
        rows.append(
            Row(
                f"{name}, four polarisations", 0.0, worst, 0.1, "dB", "symmetry: reciprocity",
                note=f"mean of both directions; one direction alone differs by {abs(one_way[-1]):.2f} dB",
            )
        )  # fmt: skip
    rooms, missing, apart = 5 if quick else 25, 0, 0.0
    for _ in range(rooms):
        scene = _room(rng)
        tx, rx = (np.array([rng.uniform(0.5, 9.5), rng.uniform(-4.5, 4.5), rng.uniform(0.3, 2.5)]) for _ in range(2))
        go, come = specular_paths(scene, tx, rx, 2), specular_paths(scene, rx, tx, 2)
        if len(go.length) != len(come.length):
            missing += abs(len(go.length) - len(come.length))
            continue
        # phi-hat changes its sign with the direction of travel, theta-hat does not.
        turned = np.transpose(come.gain, (0, 2, 1)) * np.array([[1, -1], [-1, 1]])
        apart = max(apart, float(np.abs(go.gain - turned).max() / np.abs(go.gain).max()))
    rows.append(Row(f"paths in {rooms} random rooms, count", 0, missing, 0, "paths", "symmetry: reciprocity"))
    rows.append(Row("paths in random rooms, gains", 0.0, apart, 1e-6, "of greatest", "symmetry: reciprocity"))
    return Outcome(rows)


def _room(rng: np.random.Generator) -> Scene:
    """Return a road with two walls and a block at random angles."""
    glass = Material(6.31, 1.2)
    bodies = [Body(name="road", shape="ground", params={"size": 60.0})]
    for i, side in enumerate((-5.0, 5.0)):
        shape = {"length": 12.0, "width": 0.3, "height": 3.0}
        at = (5.0, side + 0.2 * np.sign(side), 0.0)
        bodies.append(
            Body(name=f"wall{i}", shape="box", params=shape, position=at, yaw_deg=rng.uniform(-1, 1), material=glass)
        )
    at = (rng.uniform(12, 15), rng.uniform(-3, 3), 0.0)
    bodies.append(
        Body(name="block", shape="box", params={}, position=at, yaw_deg=rng.uniform(0, 90), material="concrete")
    )
    return Scene(bodies=bodies, frequency=FREQUENCY)


REGIMES = (
    Regime("grazing", "Grazing incidence to 89.9 deg", grazing),
    Regime("edge_on", "Edge-on plates", edge_on),
    Regime("exchange", "Exchange of transmitter and receiver", exchange),
)
