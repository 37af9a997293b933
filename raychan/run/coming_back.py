"""Waves that a limit on bounces ends just before they come to the receiver: no ratio of what was traced tells them.

A corner of three faces returns by three interactions: what two bring, 100 dB less, says nothing of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.records import TRANSMIT, Paths
from raychan.run.mechanisms import interactions
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_RAYS = 6_000  # at most, of all chains as many; the rest of a chain counts as these do (not measured)
_NARROW = 0.01  # rad between normals or to the receiver that counts as none (not measured)
_LOBES = 3  # side lobes of a mirror's beam, 21 dB below its middle where it is evenly lit (not measured)
_ASIDE = 0.003  # rad by which rays pass a specular point: a corner's own lies on its edge (not measured)
_MANY, _SOME = 0.1, 2  # of the rays over the same bodies: far above chance; a corner's all come back (not measured)
_START = 1e-3  # m from which hits count: places of paths are rounded


@dataclass(frozen=True)
class _Followed:
    """Rays over mirrors: which (m,) met as many as asked for; where, with which normals (m, b, 3), of which facets
    (m, b), and whither they leave (m, 3)."""

    row: Ints
    at: Floats
    normal: Floats
    facet: NDArray[np.int32]
    leaves: Floats


def coming_back(paths: Paths, geometry: Geometry, bounces: int, wavelength: float) -> tuple[str, ...]:
    """Return the bodies over which waves come to the receiver by one interaction more than `bounces`, as off plane
    mirrors; empty where there are none.

    Each ray tells the planes that it meets, these the place of the wave's specular path, and a second ray whether that
    is one: whether it meets the same planes over there, and then the receiver. Where the mirrors are too small for
    one, the receiver may stand in the wave's next side lobes. Args: wavelength [m].
    """
    way = paths.trajectories
    last = np.unique(paths.trajectory[interactions(paths) == bounces])
    # Behind thin layers the mirrored rays would meet the layer once more.
    last = last[(way.kind[last] != TRANSMIT).all(axis=1)]
    last = last[_some(way.body[last, :bounces])]
    if not len(last):
        return ()
    first = _followed(geometry, paths.tx, way.vertices[last, 0], bounces + 1)
    place = _specular(first, paths.tx, paths.rx)
    towards, known = _unit(place - paths.tx), _unit(first.at[:, 0] - paths.tx)
    aside = known - towards
    aside *= np.minimum(1.0, _ASIDE / np.maximum(np.linalg.norm(aside, axis=1), 1e-300))[:, None]
    again = _followed(geometry, paths.tx, paths.tx + towards + aside, bounces + 1)
    same = np.linalg.norm(again.normal - first.normal[again.row], axis=2).max(axis=1, initial=0.0) < _NARROW
    ways, own, count = np.unique(geometry.facets.body[first.facet], axis=0, return_inverse=True, return_counts=True)
    size = np.array([np.linalg.norm(np.ptp(first.at[own.ravel() == k, -1], axis=0)) for k in range(len(ways))])
    lobes = _LOBES * wavelength / np.maximum(size, wavelength)
    back = _meets(geometry, first, paths.rx, (_NARROW + lobes)[own.ravel()])
    back[again.row[same & _meets(geometry, again, paths.rx, np.full(len(same), _NARROW))]] = True
    some = np.bincount(own.ravel(), back, len(ways))
    some[some < np.maximum(_MANY * count, _SOME)] = 0.0
    if not some.any():
        return ()
    names = [paths.body_names[b] for b in ways[np.argmax(some)]]
    return tuple(name for k, name in enumerate(names) if k == 0 or names[k - 1] != name)


def _meets(geometry: Geometry, rays: _Followed, end: Floats, slack: Floats) -> NDArray[np.bool_]:
    """Return which rays leave towards a point (3,) that nothing hides, to within angles (m,) [rad]."""
    towards = end - rays.at[:, -1]
    far = np.linalg.norm(towards, axis=1)
    towards = _unit(towards)
    near = np.flatnonzero(np.linalg.norm(rays.leaves - towards, axis=1) < slack)
    hits = geometry.cast(rays.at[near, -1], towards[near], rays.facet[near, -1], np.full(len(near), _START))[1]
    out = np.zeros(len(far), bool)
    out[near] = hits > far[near]
    return out


def _some(bodies: NDArray[np.integer[Any]]) -> Ints:
    """Return rows of chains of bodies (n, b), of all chains as many and at most _RAYS."""
    if not len(bodies):
        return np.zeros(0, np.int64)
    ways, own, count = np.unique(bodies, axis=0, return_inverse=True, return_counts=True)
    rows = np.argsort(own.ravel(), kind="stable")
    place = np.arange(len(rows)) - np.repeat(np.cumsum(count) - count, count)
    every = np.repeat(-(-count // max(_RAYS // len(ways), 1)), count)
    return rows[place % every == 0]


def _followed(geometry: Geometry, start: Floats, towards: Floats, bounces: int) -> _Followed:
    """Return how rays from a point (3,) to points (m, 3) run over as many mirrors."""
    row, facet = np.arange(len(towards)), np.full(len(towards), -1, np.int32)
    begin, leaves = np.tile(start, (len(towards), 1)), _unit(towards - start)
    at, normals = np.zeros((2, len(towards), bounces, 3))
    facets = np.zeros((len(towards), bounces), np.int32)
    for k in range(bounces):
        facet, reach = geometry.cast(begin[row], leaves[row], facet, np.full(len(row), _START))
        met = facet >= 0
        row, facet = row[met], facet[met]
        begin[row] += reach[met, None] * leaves[row]
        normal = geometry.normal[facet]
        leaves[row] -= 2.0 * np.einsum("ij,ij->i", leaves[row], normal)[:, None] * normal
        at[row, k], normals[row, k], facets[row, k] = begin[row], normal, facet
    return _Followed(row, at[row], normals[row], facets[row], leaves[row])


def _specular(met: _Followed, start: Floats, end: Floats) -> Floats:
    """Return where the specular paths (m, 3) over the planes that rays met leave from a point to another, (3,)."""
    images = [np.broadcast_to(start, (len(met.row), 3))]
    for k in range(met.at.shape[1]):
        off = np.einsum("ij,ij->i", images[-1] - met.at[:, k], met.normal[:, k])
        images.append(images[-1] - 2.0 * off[:, None] * met.normal[:, k])
    target = np.broadcast_to(end, (len(met.row), 3))
    for k in range(met.at.shape[1] - 1, -1, -1):
        line = target - images[k + 1]
        over = np.einsum("ij,ij->i", met.at[:, k] - images[k + 1], met.normal[:, k])
        slope = np.einsum("ij,ij->i", line, met.normal[:, k])
        share = np.divide(over, slope, out=np.ones(len(over)), where=slope != 0.0)
        target = images[k + 1] + share[:, None] * line
    return np.asarray(target)


def _unit(v: Floats) -> Floats:
    return np.asarray(v / np.maximum(np.linalg.norm(v, axis=1), 1e-300)[:, None])
