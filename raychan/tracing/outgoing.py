"""Outgoing legs: which tubes may leave over which of them, for all legs at once."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.parallel import parallel_for
from raychan.tracing.cache import cache_of
from raychan.tracing.image_paths import each_may_leave
from raychan.tracing.images import scattering, turning
from raychan.tracing.legs import Leg, reachable
from raychan.tracing.radiation import radiates
from raychan.tracing.tubes import Tubes
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]
Rows = NDArray[np.intp]

_SETS_KEPT = 8  # of legs; each takes some hundred bytes a mirror, and a byte for each leg and piece
_PARALLEL_FROM = 20_000  # tubes times legs from which on a second thread pays; not measured


class _OutgoingLegs(NamedTuple):
    """Legs, the arrays of each filled up to those of the longest: how many `mirrors` (k,); of which pieces (k, p) each
    can carry a return; whether it leads over a mirror that scatters too (k,); else as in `image_paths.may_leave`."""

    mirrors: NDArray[np.int64]
    pieces: Bools
    over: Bools
    far: Bools
    images: Floats
    at: Floats
    normal: Floats
    low: Floats
    high: Floats
    axes: Floats
    windows: Floats


class _LeavingTubes(NamedTuple):
    """Columns of `tubes.Tubes` by which these leave, and what of them is to be found: which `scatter` (n,), and which
    are `twice` (n,), returned by legs over mirrors already (but over a leg without a mirror that scatters, or that they
    came by, if `but_plain`)."""

    points: Floats
    k: Floats
    normals: Floats
    facet: Ints
    scatter: Bools
    twice: Bools
    but_plain: bool


class Leaving:
    """Which tubes may leave over each of some legs.

    Args: outs all legs; wanted numbers of those that are asked for; scatter (n,) tubes that return; twice (n,) those
    that legs over mirrors carry, but_plain: but over a leg without a mirror that scatters or over those that they came
    by; which of them radiate (see `tracing.radiation`), no matter which over those of the leg `came_by`."""

    def __init__(
        self,
        geometry: Geometry,
        outs: list[Leg],
        wanted: list[int],
        tubes: Tubes,
        scatter: Bools,
        twice: Bools,
        but_plain: bool,
        which: int,
        came_by: Leg | None,
    ) -> None:
        known = cache_of(geometry).newest("outgoing legs", tuple(outs), _SETS_KEPT, lambda: _known(geometry, outs))
        legs, self._back = known
        self._there = [] if came_by is None else scattering(geometry, came_by)
        given = _LeavingTubes(tubes.points, tubes.k, tubes.normals, tubes.facet, scatter, twice, but_plain)
        numbers = np.array(wanted, np.int64)
        alike = (len(self._there) > 0 and self._back[i] == self._there for i in wanted)
        every = np.array([same or outs[i] is came_by for i, same in zip(wanted, alike, strict=True)], bool)
        self._rows: dict[int, Rows] = {}

        def some(part: slice) -> None:
            of = numbers[part]
            rows, ends = _leaving(given, geometry.piece, legs, of, every[part], which)
            for i, (begin, end) in zip(of, pairwise(ends), strict=True):
                self._rows[int(i)] = rows[begin:end]

        parallel_for(len(numbers), some, max(2, _PARALLEL_FROM // max(len(tubes), 1)))

    def over(self, i: int) -> Rows:
        """Return the tubes that may leave over leg i."""
        return self._rows[i]

    def any_over(self, i: int) -> bool:
        """Tell whether any tube may leave over leg i."""
        return len(self._rows[i]) > 0

    def turned(self, i: int) -> int:
        """Return the facet of the mirror from which tubes leave over leg i by the way that they came by, past where
        they turned (see `images.turning`); -1 if from none."""
        return turning(self._there, self._back[i])


def _known(geometry: Geometry, outs: list[Leg]) -> tuple[_OutgoingLegs, list[list[int]]]:
    """Return legs as kernels read them, and the mirrors of each that scatter."""
    return _packed(geometry, outs), [scattering(geometry, out) for out in outs]


def _packed(geometry: Geometry, outs: list[Leg]) -> _OutgoingLegs:
    """Return legs as kernels read them."""
    k, m = len(outs), max((len(out.mirrors) for out in outs), default=0)
    legs = _OutgoingLegs(
        mirrors=np.array([len(out.mirrors) for out in outs], np.int64),
        pieces=np.array([reachable(geometry, out) for out in outs]).reshape(k, len(geometry.piece_role)),
        over=np.array([len(scattering(geometry, out)) > 0 for out in outs], bool),
        far=np.array([out.far for out in outs], bool),
        images=np.zeros((k, m + 1, 3)),
        at=np.zeros((k, m, 3)),
        normal=np.zeros((k, m, 3)),
        low=np.zeros((k, m, 2)),
        high=np.zeros((k, m, 2)),
        axes=np.zeros((k, m, 2, 3)),
        windows=np.zeros((k, 4 * m, 3)),
    )
    for i, out in enumerate(outs):
        for name in ("images", "at", "normal", "low", "high", "axes"):
            column = getattr(out.chain, name)
            getattr(legs, name)[i, : len(column)] = column
        legs.windows[i, : len(out.windows)] = out.windows
    return legs


@njit(cache=True, nogil=True, error_model="numpy")
def _leaving(tubes, piece, legs, wanted, every, which):  # type: ignore[no-untyped-def]
    """Return the rows of tubes that may leave, leg by leg, and where those of each of the wanted legs begin, and the
    last ones end (k + 1,).

    Args: tubes as `_LeavingTubes`; piece (f,) of facets; legs as `_OutgoingLegs`; wanted (k,) numbers of legs; every
    (k,) over which also tubes leave that do not radiate; which of them radiate.
    """
    n, m, w = len(tubes.facet), legs.at.shape[1], legs.windows.shape[1]
    rows, bounds, end = np.empty(4 * n, np.int64), np.zeros(len(wanted) + 1, np.int64), 0
    found, ok = np.empty(n, np.int64), np.empty(n, np.bool_)
    # Tubes that do not scatter stand on no piece.
    own, present = np.empty(n, np.int32), np.zeros(legs.pieces.shape[1], np.bool_)
    for j in range(n):
        own[j] = piece[tubes.facet[j]] if tubes.scatter[j] else -1
        if own[j] >= 0:
            present[own[j]] = True
    most = 3 + 5 * m
    polygons, planes = (np.empty((most, 3)), np.empty((most, 3))), (np.empty((1 + w, 3)), np.empty(1 + w))
    for o in range(len(wanted)):
        if end + n > len(rows):
            before = rows
            rows = np.empty(2 * len(before), np.int64)
            for i in range(end):
                rows[i] = before[i]
        i = wanted[o]
        count = 0
        if _any_of(present, legs.pieces[i]):
            count = _candidates(tubes, own, legs, i, every[o], which, found)
        if legs.mirrors[i]:
            _each_may_leave(tubes.points, found[:count], legs, i, polygons, planes, ok)
        for j in range(count):
            if ok[j] or not legs.mirrors[i]:
                rows[end] = found[j]
                end += 1
        bounds[o + 1] = end
    return rows[:end], bounds


@njit(cache=True, forceinline=True, uncounted=True)
def _any_of(some, others):  # type: ignore[no-untyped-def]
    """Tell whether a piece (p,) is among both."""
    found = False
    for p in range(len(some)):
        found |= some[p] and others[p]
    return found


@njit(cache=True, nogil=True, error_model="numpy", uncounted=True)
def _candidates(tubes, piece, legs, i, every, which, found):  # type: ignore[no-untyped-def]
    """Write the rows of tubes, on pieces (n,), of which leg i can carry a return, and that radiate to its end, or
    `every`; return their number."""
    count, image, far, allowed = 0, legs.images[i, legs.mirrors[i]], legs.far[i], legs.pieces[i]
    plain = tubes.but_plain and (every or not legs.over[i])
    for j in range(len(piece)):
        if piece[j] < 0 or not allowed[piece[j]] or (tubes.twice[j] and not plain):
            continue
        if every or radiates(tubes.points[j, 3], tubes.k[j, 3], tubes.normals[j, 3], image, far, which)[0] > 0.0:
            found[count] = j
            count += 1
    return count


@njit(cache=True, nogil=True, error_model="numpy", uncounted=True)
def _each_may_leave(points, rows, legs, i, polygons, planes, ok):  # type: ignore[no-untyped-def]
    """Write of which tubes `rows` a ray may come to the end over leg i (see `image_paths.may_leave`)."""
    m = legs.mirrors[i]
    normals, offsets = planes
    each_may_leave(
        points, rows, legs.images[i, : m + 1], legs.at[i, :m], legs.normal[i, :m], legs.low[i, :m], legs.high[i, :m],
        legs.axes[i, :m], legs.windows[i, : 4 * m], polygons, (normals[: 1 + 4 * m], offsets[: 1 + 4 * m]), ok,
    )  # fmt: skip
