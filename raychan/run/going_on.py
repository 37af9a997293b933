"""Waves of the last order of bounces that meet a surface more: only of these can further bounces be told."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.records import REFLECT, SCATTER, Paths, Vectors
from raychan.run.labels import alike
from raychan.run.mirrored_rays import NARROW, followed, meets, of_each
from raychan.tracing.legs import legs_over, reachable
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


def going_on(paths: Paths, geometry: Geometry, last: Bools) -> Bools:
    """Return which paths (n,), of those of the `last` order (n,), are of chains of which a wave meets a surface more.

    It is mirrored at its last surface and meets another, or a mirror shows one end of its way to the receiver, or to
    the transmitter. Rays of each chain tell it; targets of given RCS, and what they are seen over, are taken to go on.
    """
    rows = np.flatnonzero(last)
    chain = alike(paths)[1][rows]
    some = of_each(chain)
    way = paths.trajectory[rows[some]].astype(np.int64)
    goes = np.zeros(int(chain.max(initial=0)) + 1, bool)
    own = chain[some]
    goes[own[(paths.trajectories.kind[way] != SCATTER).all(axis=1)]] = True
    goes[own[_mirrored(paths, geometry, way)]] = True
    for end, slot in ((paths.tx, np.zeros(len(way), np.int64)), (paths.rx, _last(paths, way))):
        left = np.flatnonzero(~goes[own])
        goes[own[left[_over_mirrors(geometry, end, paths.trajectories.vertices[way[left], slot[left]])]]] = True
    found = last.copy()
    found[rows] = goes[chain]
    return found


def _mirrored(paths: Paths, geometry: Geometry, way: Ints) -> Ints:
    """Return the rows of trajectories (w,) whose rays, mirrored where they scatter, meet a surface more."""
    kind, rows = paths.trajectories.kind[way], np.arange(len(way))
    slot = np.argmax(kind == SCATTER, axis=1)
    bounced = np.cumsum(kind == REFLECT, axis=1)
    # Rays are followed from one end over all surfaces but mirrors of the other end, where the wave then scatters.
    back = bounced[:, -1] > 2 * bounced[rows, slot]
    known = paths.trajectories.vertices[way].astype(float)
    beside = np.where(back, slot + 1, slot - 1)
    before = known[rows, np.minimum(beside, kind.shape[1] - 1)]
    before[beside < 0] = paths.tx
    before[beside == kind.shape[1]] = paths.rx
    # What mirrors of the other end the path meets already is no surface more.
    own = np.where(back, bounced[rows, slot], bounced[:, -1] - bounced[rows, slot])
    on = []
    for count in np.unique(own):
        some = np.flatnonzero(own == count)
        more = int(count) + 1
        # On its way back a wave meets all layers that it passed: not as a mirror.
        on.append(some[followed(geometry, before[some], known[some, slot[some]], more + 1, split=more).row])
    return np.concatenate([np.zeros(0, np.int64), *on])


def _last(paths: Paths, way: Ints) -> Ints:
    """Return the last slot used (w,) of trajectories (w,)."""
    used = paths.trajectories.kind[way] > 0
    return np.asarray(used.shape[1] - 1 - np.argmax(used[:, ::-1], axis=1))


def _over_mirrors(geometry: Geometry, end: Floats, points: Vectors) -> Ints:
    """Return the rows of points (n, 3) that an end (3,) of the link sees, and over a mirror too."""
    seen = followed(geometry, end, points.astype(float), 1, split=0)
    at, piece, on = seen.at[:, 0], geometry.piece[seen.facet[:, 0]], np.zeros(len(seen.row), bool)
    for leg in legs_over(geometry, end, 1)[1:]:
        left = np.flatnonzero(~on & reachable(geometry, leg)[piece])
        over = followed(geometry, at[left], leg.mirror_points(at[left])[:, 0], 1, split=0)
        on[left[over.row[meets(geometry, over, end, np.full(len(over.row), NARROW))]]] = True
    return seen.row[on]
