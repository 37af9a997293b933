"""Previews: seconds a frame in a sequence, and levels beside those of fine runs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from statistics import median
from time import perf_counter, process_time

import numpy as np
from support.boxes_and_balls import scene_of
from support.previews import beside

import raychan as rc
from bench.measure import Row, barred
from raychan.run.sequence import frames

_INTERVAL = 0.05  # s between frames
_CELL, _LEVEL_DB = 1.0, 3.0  # of a detection beside the fine run's, if that knows its own level as well


def preview(scenes: Path, repeats: int, quick: bool) -> Iterator[Row]:
    """Two streets frame by frame, of which the first is not counted; then their levels, and those of random scenes."""
    streets = {name: rc.Scene.load(scenes / f"{name}.toml") for name in ("urban", "living_street")}
    for name, scene in streets.items():
        walls, cpus, start = [], [], (perf_counter(), process_time())
        for _ in frames(scene.override(["model.mode=preview"]), repeats + 1, _INTERVAL):
            now = perf_counter(), process_time()
            walls.append(now[0] - start[0])
            cpus.append(now[1] - start[1])
            start = perf_counter(), process_time()
        row = Row("preview", f"{name}, a frame", median(walls[1:]), more={"cpu": median(cpus[1:]), "first": walls[0]})
        yield barred(row, "<= 0.2 s", row.seconds <= 0.2)
    for name, scene in streets.items():
        coarse, times = scene.override(["model.mode=preview"]), [_INTERVAL * k for k in range(1 if quick else 4)]
        yield _levels(name, [(scene.at(t), coarse.at(t)) for t in times])
    seeds = range(4 if quick else 30)
    yield _levels("random", [(scene_of(k, tolerance_db=1.0), scene_of(k, mode="preview")) for k in seeds])


def _levels(name: str, pairs: list[tuple[rc.Scene, rc.Scene]]) -> Row:
    """Return the row of levels of previews beside fine runs, of direct echoes that one body scattered once."""
    seen = [(beside(rc.simulate(fine), rc.simulate(coarse))) for fine, coarse in pairs]
    cells, level, stated, error = (
        np.concatenate([getattr(b, x) for b in seen]) for x in ("cells", "level", "stated", "error")
    )
    known = error <= _LEVEL_DB
    cells, level, stated = cells[known], level[known], stated[known]
    near = cells <= _CELL
    off = np.abs(level[near])
    more = {
        "detections": len(cells),
        "unknown to the fine run": int((~known).sum()),
        "within a cell": float(near.mean()),
        "within 3 dB": float((off <= _LEVEL_DB).mean()),
        "rms dB": float(np.sqrt(np.mean(off**2))),
        "largest dB": float(off.max()),
        "covered": float((off <= stated[near]).mean()),
    }
    row = Row("preview", f"{name}: direct echoes beside the fine run", float("nan"), more=more)
    return barred(
        row, "95 %", more["within a cell"] >= 0.95 and more["within 3 dB"] >= 0.95 and more["covered"] >= 0.95
    )
