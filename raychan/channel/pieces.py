"""Footprints over which the phase at the elements of an array turns far, in pieces: a path for each corner of a piece.

The phase integral's terms at corners carry a factor linear over the triangle without error. The phase that an element
adds turns as exp(-j x): over a triangle where x runs by 1 rad along an edge a linear factor is too weak by 1/12.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raychan.channel.ends import RadarEnds
from raychan.channel.transfer import corner_gains
from raychan.columns import take
from raychan.compile.jit import njit
from raychan.em.phase_integral import triangle_terms
from raychan.parallel import parallel_for
from raychan.records import Facets, Routes
from raychan.units import C0

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Ints = NDArray[np.int64]

_LINEAR = 1e-4  # rad: deviation from a linear phase up to which a part of a piece is integrated in closed form


class Split(NamedTuple):
    """Footprints that become a path for each of their corners: routes (r,); gains (r, q, 3) of the corners for q
    receivers; rates of length (r, 3) [m/s] and places (r, 3, e, 3) [m] of the corners (see `corner_places`)."""

    route: Ints
    gain: Complexes
    rate: Floats
    place: NDArray[np.float32]

    def some(self, rows: Ints) -> Split:
        """Return some of the footprints."""
        return Split(self.route[rows], self.gain[rows], self.rate[rows], self.place[rows])


class Parts(NamedTuple):
    """Corners (p,) of footprints or of their pieces, each a path: its route, length [m], rate of length [m/s], gain
    (p, q) for q receivers, and place (p, e, 3) [m]."""

    route: Ints
    length: Floats
    rate: Floats
    gain: Complexes
    place: NDArray[np.float32]


def parts_of(routes: Routes, split: Split, count: Ints, facets: Facets, radar: RadarEnds, frequency: float) -> Parts:
    """Return the paths of footprints (r,) that become several, of so many pieces along each edge, count (r,)."""
    one, more = np.flatnonzero(count == 1), np.flatnonzero(count > 1)
    held = split.some(one)
    shape = 3 * len(one), *split.place.shape[2:]
    corners = Parts(
        np.repeat(held.route, 3),
        routes.lengths[held.route, :3].ravel(),
        held.rate.ravel(),
        held.gain.swapaxes(1, 2).reshape(shape[0], split.gain.shape[1]),
        held.place.reshape(shape),
    )
    if not len(more):
        return corners
    pieces = _in_pieces(routes, split.some(more), count[more], facets, radar, frequency)
    both: Any = zip(corners, pieces, strict=True)
    return Parts(*(np.concatenate(x) for x in both))


def _in_pieces(routes: Routes, split: Split, count: Ints, facets: Facets, radar: RadarEnds, frequency: float) -> Parts:
    """Return the corners of the pieces of some footprints: of each one path, to which all pieces about it add."""
    rows = split.route
    corners = (count + 1) * (count + 2) // 2
    first = np.cumsum(corners) - corners
    total = int(corners.sum())
    row = np.repeat(np.arange(len(rows)), corners)
    bary, length, term = np.empty((total, 3)), np.empty(total), np.zeros(total, np.complex128)

    def some(at: slice) -> None:
        _terms(
            first[at], count[at], routes.lengths[rows[at]], routes.taper[rows[at]], 2.0 * np.pi * frequency / C0, bary,
            length, term,
        )  # fmt: skip

    parallel_for(len(rows), some)
    n = len(rows)
    # Without phase and taper: what a footprint of a mean of one scatters, a third of it at each corner.
    bare: Any = take(routes, rows).replace(lengths=np.zeros((n, 6)), length=np.zeros(n), taper=np.ones((n, 3)))
    strength = corner_gains(bare, facets, radar, frequency)
    if facets.attenuation:
        strength *= np.exp(-facets.attenuation * routes.length[rows])[:, None, None]
    rate = np.einsum("pc,pc->p", bary, split.rate[row])
    place = np.einsum("pc,pcex->pex", bary, split.place[row]).astype(np.float32)
    gain = 3.0 * np.einsum("pc,pqc->pq", bary, strength[row]) * term[:, None]
    return Parts(rows[row], length, rate, gain, place)


@njit(cache=True, forceinline=True)
def _length(lengths, v, w):  # type: ignore[no-untyped-def]
    """Return the quadratic length at barycentric (1 - v - w, v, w)."""
    u = 1.0 - v - w
    a, b, c = lengths[0], lengths[1], lengths[2]
    ab, bc, ca = lengths[3] - 0.5 * (a + b), lengths[4] - 0.5 * (b + c), lengths[5] - 0.5 * (c + a)
    return u * a + v * b + w * c + 4.0 * (ab * u * v + bc * v * w + ca * w * u)


@njit(cache=True, forceinline=True)
def _number(i, j, m):  # type: ignore[no-untyped-def]
    """Return the number of corner (i, j), i + j <= m, row by row."""
    return i * (m + 1) - i * (i - 1) // 2 + j


@njit(cache=True, nogil=True)
def _terms(first, count, lengths, taper, k, bary, length, term):  # type: ignore[no-untyped-def]
    six, parts = np.empty(6), np.empty(3, np.complex128)
    for r in range(len(count)):
        m, start = count[r], first[r]
        h = 1.0 / m
        for i in range(m):
            for flipped in range(2):
                for j in range(m - i - flipped):
                    _piece(lengths[r], (i, j, m), flipped == 1, k, six, parts)
                    a, b, c = _corners(i, j, flipped == 1)
                    term[start + _number(a[0], a[1], m)] += parts[0] * h * h
                    term[start + _number(b[0], b[1], m)] += parts[1] * h * h
                    term[start + _number(c[0], c[1], m)] += parts[2] * h * h
        for i in range(m + 1):
            for j in range(m + 1 - i):
                at = start + _number(i, j, m)
                bary[at, 0], bary[at, 1], bary[at, 2] = 1.0 - (i + j) * h, i * h, j * h
                length[at] = _length(lengths[r], i * h, j * h)
                term[at] *= bary[at, 0] * taper[r, 0] + bary[at, 1] * taper[r, 1] + bary[at, 2] * taper[r, 2]


@njit(cache=True, forceinline=True)
def _corners(i, j, flipped):  # type: ignore[no-untyped-def]
    """Return the corners of the upright piece at (i, j), or of its flipped neighbour."""
    if flipped:
        return (i + 1, j + 1), (i, j + 1), (i + 1, j)
    return (i, j), (i + 1, j), (i, j + 1)


@njit(cache=True)
def _piece(lengths, place, flipped, k, six, parts):  # type: ignore[no-untyped-def]
    """Write the parts (3,) of the mean of exp(-j k L) over a piece at (i, j) of m along each edge."""
    i, j, m = place
    a, b, c = _corners(i, j, flipped)
    h = 1.0 / m
    six[0] = k * _length(lengths, a[0] * h, a[1] * h)
    six[1] = k * _length(lengths, b[0] * h, b[1] * h)
    six[2] = k * _length(lengths, c[0] * h, c[1] * h)
    six[3] = k * _length(lengths, 0.5 * (a[0] + b[0]) * h, 0.5 * (a[1] + b[1]) * h)
    six[4] = k * _length(lengths, 0.5 * (b[0] + c[0]) * h, 0.5 * (b[1] + c[1]) * h)
    six[5] = k * _length(lengths, 0.5 * (c[0] + a[0]) * h, 0.5 * (c[1] + a[1]) * h)
    triangle_terms(six, _LINEAR, parts)
