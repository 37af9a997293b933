"""Waves that a limit on bounces ends just before they come to the receiver: no ratio of what was traced tells them.

A corner of three faces returns by three interactions: what two bring, 100 dB less, says nothing of it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.records import Paths
from raychan.run.ledger.mirrored_rays import NARROW, Followed, followed, meets, of_each
from raychan.run.mechanisms import interactions
from raychan.tracing.tubes import unit
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_LOBES = 3  # side lobes of a mirror's beam, 21 dB below its middle where it is evenly lit (not measured)
_ASIDE = 0.003  # rad by which rays pass a specular point: a corner's own lies on its edge (not measured)
_MANY, _SOME = 0.1, 2  # of the rays over the same bodies: far above chance; a corner's all come back (not measured)


def coming_back(paths: Paths, geometry: Geometry, bounces: int, wavelength: float) -> tuple[str, ...]:
    """Return the bodies over which waves come to the receiver by one interaction more than `bounces`, as off plane
    mirrors; empty where there are none.

    Each ray tells the planes that it meets, these the place of the wave's specular path, and a second ray whether that
    is one: whether it meets the same planes over there, and then the receiver. Where the mirrors are too small for
    one, the receiver may stand in the wave's next side lobes. Args: wavelength [m].
    """
    way, met = paths.trajectories, interactions(paths)
    # What the receiver does not see has no path of the last order: there rays to first surfaces tell.
    begun = [_some(paths, met == n, n) for n in dict.fromkeys((bounces, 1))]
    more = bounces + 1
    first = followed(geometry, paths.tx, way.vertices[np.concatenate(begun), 0], more, split=more)
    place = _specular(first, paths.tx, paths.rx)
    towards, known = unit(place - paths.tx), unit(first.at[:, 0] - paths.tx)
    aside = known - towards
    aside *= np.minimum(1.0, _ASIDE / np.maximum(np.linalg.norm(aside, axis=1), 1e-300))[:, None]
    again = followed(geometry, paths.tx, paths.tx + towards + aside, more, split=more)
    same = np.linalg.norm(again.normal - first.normal[again.row], axis=2).max(axis=1, initial=0.0) < NARROW
    ways, own, count = np.unique(geometry.facets.body[first.facet], axis=0, return_inverse=True, return_counts=True)
    size = np.array([np.linalg.norm(np.ptp(first.at[own.ravel() == k, -1], axis=0)) for k in range(len(ways))])
    lobes = _LOBES * wavelength / np.maximum(size, wavelength)
    back = meets(geometry, first, paths.rx, (NARROW + lobes)[own.ravel()])
    back[again.row[same & meets(geometry, again, paths.rx, np.full(len(same), NARROW))]] = True
    some = np.bincount(own.ravel(), back, len(ways))
    some[some < np.maximum(_MANY * count, _SOME)] = 0.0
    if not some.any():
        return ()
    names = [paths.body_names[b] for b in ways[np.argmax(some)]]
    return tuple(name for k, name in enumerate(names) if k == 0 or names[k - 1] != name)


def _some(paths: Paths, rows: NDArray[np.bool_], bounces: int) -> Ints:
    """Return some trajectories of paths (n,) with as many interactions, of all chains of bodies as many."""
    taken = np.zeros(len(paths.trajectories.kind), bool)
    taken[paths.trajectory[rows]] = True
    found = np.flatnonzero(taken)
    met = paths.trajectories.body[found, :bounces]
    # Neighbours are mostly alike: one of each run is sorted.
    heads = np.flatnonzero(np.append(True, (met[1:] != met[:-1]).any(axis=1))[: len(met)])
    group = np.unique(met[heads], axis=0, return_inverse=True)[1].ravel()
    return found[of_each(np.repeat(group, np.diff(heads, append=len(met))))]


def _specular(met: Followed, start: Floats, end: Floats) -> Floats:
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
