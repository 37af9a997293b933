"""Waves that a limit on bounces ends just before they come back to the radar: no ratio of what was traced tells them.

A corner of three faces returns by three interactions: what two bring, 100 dB less, says nothing of it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.records import TRANSMIT, Paths
from raychan.run.mechanisms import interactions
from raychan.world.geometry import Geometry

_RAYS = 20_000  # at most; the rest of the paths counts as these do (not measured)
_NARROW = (
    0.01  # rad off the way by which they came: a face of 0.1 m at 77 GHz has beams twice as wide; chance 1 in 40,000
)
_MANY, _SOME = 0.1, 2  # of the rays over the same bodies: far above chance; a corner's all come back (not measured)
_START = 1e-3  # m from which hits count: places of paths are rounded


def coming_back(paths: Paths, geometry: Geometry, bounces: int) -> tuple[str, ...]:
    """Return the bodies over which waves come back to where they came from by one interaction more than `bounces`;
    empty where there are none."""
    way = paths.trajectories
    last = np.unique(paths.trajectory[interactions(paths) == bounces])
    # Behind thin layers the mirrored rays would meet the layer once more.
    last = last[(way.kind[last] != TRANSMIT).all(axis=1)]
    last = last[:: -(-len(last) // _RAYS) or 1]
    if not len(last):
        return ()
    begin = np.concatenate([np.broadcast_to(paths.tx, (len(last), 1, 3)), way.vertices[last, :bounces]], axis=1)
    came, towards = _unit(begin[:, 1] - begin[:, 0]), _unit(begin[:, -1] - begin[:, -2])
    begin = begin[:, -2]
    chain, left = way.body[last, :bounces], np.full(len(last), -1, np.int32)
    for _ in range(2):
        facet, reach = geometry.cast(begin, towards, left, np.full(len(begin), _START))
        met = np.flatnonzero(facet >= 0)
        begin, towards = begin[met] + reach[met, None] * towards[met], towards[met]
        chain, came, left = chain[met], came[met], facet[met]
        normal = geometry.normal[left]
        towards = towards - 2.0 * np.einsum("ij,ij->i", towards, normal)[:, None] * normal
    back = np.linalg.norm(towards + came, axis=1) < _NARROW
    chain = np.column_stack([chain, geometry.facets.body[left]])
    ways, own, count = np.unique(chain, axis=0, return_inverse=True, return_counts=True)
    some = np.bincount(own.ravel(), back, len(ways))
    some[some < np.maximum(_MANY * count, _SOME)] = 0.0
    if not some.any():
        return ()
    names = [paths.body_names[b] for b in ways[np.argmax(some)]]
    return tuple(name for k, name in enumerate(names) if k == 0 or names[k - 1] != name)


def _unit(v: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(v / np.maximum(np.linalg.norm(v, axis=1), 1e-300)[:, None])
