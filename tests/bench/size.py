"""Cost of a frame by triangles, tubes and bounces, each against the smallest of its kind."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import trimesh

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
    balls = [trimesh.creation.icosphere(subdivisions=n, radius=1.0) for n in steps]
    yield from grown("triangles", [_hidden(b) for b in balls], repeats, bar=3.0)
    # The same out of the beam, behind a curved body instead of a wall, and with a body that moves from frame to frame.
    ends = balls[0], balls[-1]
    yield from grown("triangles out of the beam", [_hidden(b, x=-12.0) for b in ends], repeats, bar=3.0)
    yield from grown("triangles behind a ball", [_hidden(b, wall=False) for b in ends], repeats, bar=3.0)
    yield from grown("triangles, moved", [_moved(b) for b in ends], repeats, bar=3.0)
    urban = rc.Scene.load(scenes / "urban.toml")
    tolerances = (3.0, 0.5) if quick else (3.0, 1.5, 0.5, 0.25)
    yield from grown(
        "tubes", [(f"tolerance {t:g} dB", lambda: urban, {"tolerance_db": t}) for t in tolerances], repeats
    )
    bounces = (1, 2, 3) if quick else (1, 2, 3, 4)
    jobs = [(f"{n} bounce{'s'[: n > 1]}", lambda: urban, {"tolerance_db": 3.0, "max_bounces": n}) for n in bounces]
    yield from grown("bounces", jobs, repeats)


Job = tuple[str, Callable[[], rc.Scene], dict[str, Any]]


def _hidden(ball: trimesh.Trimesh, x: float = 12.0, wall: bool = True, speed: float = 0.0) -> Job:
    """Return a job: a plate or a ball, and hidden behind it a ball of ever more triangles. The tubes are the same."""
    front: dict[str, Any] = {"shape": "plate", "params": {"width": 3.0, "height": 3.0}, "yaw_deg": 180.0}
    if not wall:
        front = {"mesh": trimesh.creation.icosphere(subdivisions=3, radius=1.8)}
    bodies = [
        rc.Body(name="front", position=(6, 0, 1.5), velocity=(speed, 0, 0), **front),
        rc.Body(name="ball", mesh=ball, position=(x, 0, 1.5)),
    ]
    scene = rc.Scene(bodies=bodies, radar=RADAR, model={"max_bounces": 1, "tolerance_db": 0.5})
    return f"{len(ball.faces):,} triangles", lambda: scene, {}


def _moved(ball: trimesh.Trimesh) -> Job:
    """Return the job at a slightly later time each run, so that nothing kept with the scene can be used again."""
    name, scene, settings = _hidden(ball, speed=1e-3)
    steps = itertools.count(1)
    return name, lambda: scene().at(1e-3 * next(steps)), settings


def grown(group: str, jobs: list[Job], repeats: int, bar: float | None = None) -> Iterator[Row]:
    """Give the ratio of each job's time to that of the first."""
    stats: dict[str, dict[str, Any]] = {}

    def call(job: Job) -> Callable[[], Any]:
        return lambda: stats.update({job[0]: rc.simulate(job[1](), **job[2]).stats})

    for row in rounds(f"frame by {group}", [(job[0], call(job)) for job in jobs], repeats):
        ends = stats[jobs[0][0]], stats[row.name]
        row.more = {k: {"first": ends[0][k], "this": ends[1][k]} for k in ("rays", "tubes", "mirror_chains")}
        yield barred(row, f"<= {bar:g}", row.ratio <= bar) if bar else row
