"""Cost of a frame by triangles, tubes and bounces, each against the smallest of its kind."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import raychan as rc
from bench.measure import Row, barred, rounds

RADAR = {
    "position": [0.0, 0.0, 1.5],
    "noise": False,
    "waveform": {"bandwidth_mhz": 500.0, "chirp_us": 30.0, "chirps": 64, "samples": 128},
}


def size(scenes: Path, repeats: int, quick: bool) -> Iterator[Row]:
    """Frames of growing scenes: more triangles out of sight, more tubes, more bounces."""
    steps = (3, 5, 6) if quick else (3, 5, 7, 8)
    yield from grown("triangles", [_hidden(20 * 4**n) for n in steps], repeats, bar=3.0)
    urban = rc.Scene.load(scenes / "urban.toml")
    tolerances = (3.0, 0.5) if quick else (3.0, 1.5, 0.5, 0.25)
    yield from grown("tubes", [(f"tolerance {t:g} dB", urban, {"tolerance_db": t}) for t in tolerances], repeats)
    bounces = (1, 2, 3) if quick else (1, 2, 3, 4)
    jobs = [(f"{n} bounce{'s'[: n > 1]}", urban, {"tolerance_db": 3.0, "max_bounces": n}) for n in bounces]
    yield from grown("bounces", jobs, repeats)


Job = tuple[str, rc.Scene, dict[str, Any]]


def _hidden(triangles: int) -> Job:
    """A plate seen and a sphere of ever more triangles behind it: the tubes that count are the same."""
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=round(math.log(triangles / 20, 4)), radius=1.0)
    bodies = [
        rc.Body(name="plate", shape="plate", params={"width": 3.0, "height": 3.0}, position=(6, 0, 1.5), yaw_deg=180.0),
        rc.Body(name="ball", mesh=ball, position=(12, 0, 1.5)),
    ]
    scene = rc.Scene(bodies=bodies, radar=RADAR, model={"max_bounces": 1, "tolerance_db": 0.5})
    return f"{triangles:,} triangles", scene, {}


def grown(group: str, jobs: list[Job], repeats: int, bar: float | None = None) -> Iterator[Row]:
    """Give the ratio of each job's time to that of the first."""
    stats: dict[str, dict[str, Any]] = {}

    def call(job: Job) -> Callable[[], Any]:
        return lambda: stats.update({job[0]: rc.simulate(job[1], **job[2]).stats})

    for row in rounds(f"frame by {group}", [(job[0], call(job)) for job in jobs], repeats):
        ends = stats[jobs[0][0]], stats[row.name]
        row.more = {k: {"first": ends[0][k], "this": ends[1][k]} for k in ("rays", "tubes", "mirror_chains")}
        yield barred(row, f"<= {bar:g}", row.ratio <= bar) if bar else row
