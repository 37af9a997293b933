"""Bare Embree: the rays that a computation cast, cast again with nothing around them."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from raychan import parallel
from raychan.geometry.embree_packet import COMPANIONS, DIRECTION, LANES, ORIGIN
from raychan.world import triangle_groups
from raychan.world.embree_library import EmbreeScene as OwnScene
from raychan.world.embree_library import intersect_address

_CHUNK = 1 << 16
_WORDS = DIRECTION + 3 * LANES  # of a packet: origins and directions
_HELD = 4096  # packets
_FUNCTION = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 4)


class Casts:
    """Recorded packets by scene of Embree, in the order in which they were cast, and the triangles of each scene."""

    def __init__(self) -> None:
        self.scenes: list[tuple[OwnScene, np.ndarray]] = []  # alive, or another would have the address of one
        self._packets: list[tuple[np.ndarray, np.ndarray]] = []
        self._room, self._scene, self._count = np.empty((_HELD, _WORDS), np.float32), np.empty(_HELD, np.uint64), 0
        self._real = _FUNCTION(int(intersect_address()))
        self.record = _FUNCTION(self._record)

    def _record(self, valid: int, scene: int, rays: int, arguments: int) -> None:
        ctypes.memmove(self._room.ctypes.data + 4 * _WORDS * self._count, rays, 4 * _WORDS)
        self._scene[self._count] = scene
        self._count += 1
        if self._count == _HELD:
            self._flush()
        self._real(valid, scene, rays, arguments)

    def _flush(self) -> None:
        self._packets.append((self._room[: self._count].copy(), self._scene[: self._count].copy()))
        self._count = 0

    def rays(self) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """Give the triangles (t, 3, 3) of each scene, and origins and directions (n, 3) of the rays cast at it."""
        self._flush()
        packets, scene = (np.concatenate(x) for x in zip(*self._packets, strict=True))
        every = packets.reshape(len(packets), -1, LANES)[:, :, : 1 + COMPANIONS]
        first, then = ORIGIN // LANES, DIRECTION // LANES
        for made, corners in self.scenes:
            mine = every[scene == made.address].transpose(0, 2, 1)
            origin, direction = (mine[:, :, i : i + 3].reshape(-1, 3) for i in (first, then))
            yield corners, np.ascontiguousarray(origin), np.ascontiguousarray(direction)


_made: list[Casts] = []  # for ever: compiled code may hold the addresses of their functions


@contextmanager
def recorded() -> Iterator[Casts]:
    """Give what records every packet of rays cast inside the block, on one thread, at scenes that are made inside it.

    Scenes that are made inside the block go on being recorded: time other ones.
    """
    casts = Casts()
    _made.append(casts)
    address, scene = triangle_groups.intersect_address, triangle_groups.EmbreeScene

    def made(corners: np.ndarray) -> OwnScene:
        built = scene(corners)
        casts.scenes.append((built, corners))
        return built

    triangle_groups.intersect_address = lambda: np.uintp(ctypes.cast(casts.record, ctypes.c_void_p).value)  # type: ignore
    triangle_groups.EmbreeScene = made  # type: ignore[assignment, misc]
    parallel.set_threads(1)
    try:
        yield casts
    finally:
        triangle_groups.intersect_address, triangle_groups.EmbreeScene = address, scene  # type: ignore[misc]
        parallel.set_threads(None)


def replay(casts: Casts) -> tuple[Callable[[], None], int]:
    """Return a call that casts recorded rays again with embreex, all that meet one scene together, on both cores; and
    their number.

    This is the least that a computation which casts them could take.
    """
    jobs = []
    for corners, origins, directions in casts.rays():
        if not len(origins):
            continue
        scene = EmbreeScene(robust=True)
        TriangleMesh(scene, corners.astype(np.float32))
        starts = range(0, len(origins), _CHUNK)
        jobs += [(scene, origins[i : i + _CHUNK], directions[i : i + _CHUNK]) for i in starts]
        scene.run(origins[:1], directions[:1])  # built

    def cast(job: tuple[EmbreeScene, np.ndarray, np.ndarray]) -> None:
        job[0].run(job[1], job[2])

    def all_of_them() -> None:
        with ThreadPoolExecutor(2) as pool:
            list(pool.map(cast, jobs))

    return all_of_them, sum(len(o) for _, o, _ in jobs)
