"""Bare Embree: the rays that a computation cast, cast again with nothing around them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from raychan.geometry.intersect import CastRays
from raychan.geometry.shadow_rays import MetFacets, ShadowTargets
from raychan.world.ray_caster import RayCaster

_CHUNK = 1 << 16
_EACH = 3  # a ray and its two companions
Cast = tuple[RayCaster, np.ndarray, np.ndarray]


@contextmanager
def recorded() -> Iterator[list[Cast]]:
    """Give the list to which every cast inside the block goes: caster, origins and directions (n, 3) float32.

    What is cast again from farther on, or behind a layer, is not in it: some percent of the rays.
    """
    casts: list[Cast] = []
    real = RayCaster._follow

    def recorder(caster: RayCaster, rays: CastRays, targets: ShadowTargets, met: MetFacets) -> None:
        left = ~met.reached if len(met.reached) else slice(None)
        origin, direction = (
            (x[left] - c).astype(np.float32) for x, c in ((rays.origin, _middle(caster)), (rays.direction, 0.0))
        )
        casts.append((caster, origin, direction))
        real(caster, rays, targets, met)

    RayCaster._follow = recorder  # type: ignore[method-assign]
    try:
        yield casts
    finally:
        RayCaster._follow = real  # type: ignore[method-assign]


def _middle(caster: RayCaster) -> np.ndarray:
    return caster.facets.vertices.reshape(-1, 3).mean(axis=0)


def replay(casts: list[Cast]) -> tuple[Callable[[], None], int]:
    """Return a call that casts recorded rays again with embreex, each three times as it has two companions, all that
    meet one scene together, on both cores; and their number.

    This is the least that a computation which casts them could take.
    """
    casters = {id(caster): caster for caster, _, _ in casts}
    jobs = []
    for key, caster in casters.items():
        scene = EmbreeScene(robust=True)
        TriangleMesh(scene, (caster.facets.vertices - _middle(caster)).astype(np.float32))
        mine = [(o, d) for c, o, d in casts if id(c) == key]
        origins, directions = (np.repeat(np.concatenate(x), _EACH, axis=0) for x in zip(*mine, strict=True))
        starts = range(0, len(origins), _CHUNK)
        jobs += [(scene, origins[i : i + _CHUNK], directions[i : i + _CHUNK]) for i in starts]
        scene.run(origins[:1], directions[:1])  # built

    def cast(job: tuple[EmbreeScene, np.ndarray, np.ndarray]) -> None:
        job[0].run(job[1], job[2])

    def all_of_them() -> None:
        with ThreadPoolExecutor(2) as pool:
            list(pool.map(cast, jobs))

    return all_of_them, sum(len(o) for _, o, _ in jobs)
