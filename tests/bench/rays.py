"""Rays: what the tracer adds to bare Embree for the same rays in the same scene."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from bench.bare import recorded, replay
from bench.measure import Row, against
from raychan.poses import direction
from raychan.world.ray_caster import RayCaster
from raychan.world.scene import Scene


def rays(scenes: Path, repeats: int, quick: bool) -> Iterator[Row]:
    """Cast rays from the radar into the urban street; ours finds the hit points in double precision too."""
    scene = Scene.load(scenes / "urban.toml")
    count = 100_000 if quick else 1_000_000
    rng = np.random.default_rng(0)
    way = direction(rng.uniform(-0.8, 0.8, count), rng.uniform(-0.2, 0.2, count))
    start = np.broadcast_to(np.asarray(scene.radar.position), (count, 3)).copy()
    left = np.full(count, -1, np.int32)
    with recorded() as casts:
        RayCaster(scene.facets()).cast(start, way, left)
    bare, cast = replay(casts)
    tracer = RayCaster(scene.facets())
    tracer.cast(start, way, left)
    row = against(
        "rays", f"{count:,} rays, urban", lambda: tracer.cast(start, way, left), "bare embreex", bare, repeats
    )
    row.more |= {"rays": cast, "rays_per_second": count / row.seconds}
    yield row
