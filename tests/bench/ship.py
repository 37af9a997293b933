"""Ship: how much faster than real time the closed loop of ship and laser scanner runs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from time import process_time

import numpy as np
import trimesh

from bench.measure import Row, barred, paired, seconds
from raychan.run.ship.loop import ShipLoop
from raychan.run.ship.scene import ShipScene, ship_scene
from raychan.world.body import Body
from raychan.world.scene import Scene

_BAR = 10.0  # times real time
_SECONDS = 10.0  # of the voyage that is timed


def coast(triangles: int) -> trimesh.Trimesh:
    """Return rough land, a ring from 30 to 75 m around the origin and 8 to 12 m high, of about so many triangles."""
    around = round((2.0 * triangles) ** 0.5)
    out = triangles // (2 * around) + 1
    angle, radius = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, around), np.linspace(30.0, 75.0, out), indexing="ij")
    rng = np.random.default_rng(0)
    height = np.where(radius <= 30.0, -1.0, rng.uniform(8.0, 12.0, radius.shape))
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=-1).reshape(-1, 3)
    corner = (np.arange(around - 1)[:, None] * out + np.arange(out - 1)).ravel()
    faces = np.concatenate(
        [np.stack([corner, corner + out, corner + 1], 1), np.stack([corner + 1, corner + out, corner + out + 1], 1)]
    )
    return trimesh.Trimesh(points, faces, process=False)


def harbour(model: str, controller: str) -> ShipScene:
    """Return a ship that circles within 100,000 triangles of land."""
    tables = {
        "ship": {"model": model, "speed_mps": 2.0},
        "steering": {"controller": controller, "max_rudder_deg": 30.0, "gain": [0.0, 0.0, 2.0, 0.0, 1.0]},
        "programme": {"headings": [[0.0, 0.0], [1.0, 3600.0]], "turn_rate_dps": 10.0},
        "scanner": {"noise_m": 0.01},
        "sea": {"reflectivity": 0.3},
        "run": {"duration_s": _SECONDS},
    }
    if controller == "pd":
        tables["steering"] = {"controller": "pd", "kp": 1.0, "kd": 2.0, "max_rudder_deg": 30.0}
    land = Scene(bodies=[Body(name="coast", mesh=coast(100_000), material="pec")])
    return replace(ship_scene(tables), bodies=land, reflectivity=np.array([0.5]))


def _cpu(call: Callable[[], None]) -> float:
    """Return what a call takes of this process alone [s], which another load does not lengthen much."""
    start = process_time()
    call()
    return process_time() - start


def ship(scenes: Path, repeats: int, quick: bool) -> Iterator[Row]:
    """Run the closed loop of 181 beams at 75 Hz among 100,000 triangles; a ratio of 0.1 is ten times real time.

    Each run begins anew in the middle of the land; the ray caster is built before the clock starts.
    """
    for model, controller in (("container", "lqg"), ("yacht", "lqr"), ("corrected", "pd")):
        scene = harbour(model, controller)
        loops, met = [ShipLoop(scene) for _ in range(repeats + 2)], list[float]()

        def sail(loops: list[ShipLoop] = loops, met: list[float] = met) -> None:
            loop = loops.pop()
            while not loop.done:
                met.append(float(np.isfinite(loop.step_scan().scan.range).mean()))

        sail()
        pairs = [(seconds(sail), _SECONDS) for _ in range(repeats)]
        row = paired("ship", f"{model}, {controller}, {_SECONDS:g} s", pairs, "real time")
        row.more |= {
            "triangles": len(scene.bodies.facets().vertices),
            "beams": scene.scanner.count,
            "beams_met": float(np.mean(met)),
            "times_real_time": 1.0 / (row.ratio or np.inf),
            "times_real_time_of_cpu": _SECONDS / _cpu(sail),
        }
        yield barred(row, f"at least {_BAR:g} times real time", row.ratio is not None and row.ratio <= 1.0 / _BAR)
