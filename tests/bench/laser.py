"""Laser scans of 181 beams in a scene of 100,000 triangles: CPU time of a scan against the time a scanner takes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from statistics import median
from time import process_time

import numpy as np
import trimesh
from support.facets import facets

from bench.measure import Row, barred
from raychan.sensors.laser import LaserScan, Scanner, SensorPoses, scan
from raychan.sensors.sea import SeaState, waves
from raychan.sensors.spot import Spot
from raychan.world.ray_caster import RayCaster

_CALLS = 100  # scans timed together: one is shorter than the clock's ticks


def laser(scenes: Path, repeats: int, quick: bool) -> Iterator[Row]:
    """CPU seconds of a scan, against the 13.3 ms that the mirror takes."""
    balls = [trimesh.creation.icosphere(subdivisions=6, radius=10.0), trimesh.creation.icosphere(5, radius=5.0)]
    balls[0].apply_translation([40.0, 0.0, 0.0])
    balls[1].apply_translation([0.0, 30.0, 0.0])
    caster = RayCaster(facets(balls))
    sea = waves(SeaState(1.0, 5.0), np.random.default_rng(0))
    n = Scanner().count
    poses = SensorPoses(
        position=np.tile([0.0, 0.0, 5.0], (n, 1)), yaw=np.zeros(n), pitch=np.zeros(n), roll=np.full(n, 0.1)
    )
    wide = Spot()
    cases = (
        ("no width", None, None),
        ("7 sub-rays", wide, None),
        ("waves", None, sea),
        ("7 sub-rays, waves", wide, sea),
    )
    for name, spot, moving_sea in cases:
        scanner = Scanner(spot=spot)

        def once(scanner: Scanner = scanner, moving_sea: object = moving_sea) -> LaserScan:
            return scan(scanner, poses, caster, np.ones(2), 1.0, moving_sea)

        cost = median(_cpu(once) for _ in range(repeats))
        share = cost / scanner.duration
        row = Row(
            "laser", f"{n} beams, {len(caster.first):,} triangles, {name}", cost, "mirror", scanner.duration, share
        )
        yield barred(row, "<= 0.1", share <= 0.1) if name in ("no width", "7 sub-rays") else row


def _cpu(call: Callable[[], LaserScan]) -> float:
    """Return the CPU time [s] of one of many calls."""
    call()
    start = process_time()
    for _ in range(_CALLS):
        call()
    return (process_time() - start) / _CALLS
