"""The rays that lead to the corners of a footprint: where they leave the ends, and how they meet surfaces on their
way (numba kernels).

Fields of the centre alone would jump from tube to tube, and what off the mirror direction should cancel where tubes
meet would not.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raychan.channel.fields_along import cosine, curved, heading, mirrored, slot, vec
from raychan.compile.jit import njit
from raychan.records import REFLECT, SCATTER, TRANSMIT, Facets, Routes

Floats = NDArray[np.float64]

_INSIDE = 1e-6  # of the way to the centre: beyond the rounding of cuts, below what a pattern changes by; not measured


class CornerRays(NamedTuple):
    """Rays of routes: one each, or those to the three corners of a footprint, or to these and its centre.

    Fields: first (n + 1,) rows of each route, with the end of the last; away, look (m, 3) unit directions in which the
    transmitter radiates and to which the receiver looks; cos_in, cos_out (m, d) cosines of incidence on the surfaces in
    each slot, of rays from either end, known where there are several.
    """

    first: NDArray[np.int64]
    away: Floats
    look: Floats
    cos_in: Floats
    cos_out: Floats


def departures(routes: Routes) -> tuple[Floats, Floats]:
    """Return the unit directions (n, 3) in which the transmitter radiates and to which the receiver looks."""
    away, look = np.empty((2, len(routes.kind), 3))
    _departures(routes.tx, routes.rx, routes.far, routes.vertices, routes.kind, away, look)
    return away, look


def corner_rays(routes: Routes, facets: Facets, several: int) -> CornerRays:
    """Return so many rays, 3 or 4, to footprints that are reached over layers and plane mirrors only: to the corners,
    then to the centre; of all other routes, and where `several` is 1, that to the centre."""
    normals, kind, scatter = routes.normals, routes.kind, routes.scatter
    first = _rows(kind, routes.facet, scatter, facets.normals, several)
    away, look = np.empty((2, first[-1], 3))
    cosines = np.empty((2, first[-1], kind.shape[1]))
    _write(
        routes.tx, routes.rx, routes.vertices, normals, kind, scatter, routes.points, first, *departures(routes), away,
        look, cosines[0], cosines[1],
    )  # fmt: skip
    return CornerRays(first, away, look, cosines[0], cosines[1])


@njit(cache=True, forceinline=True, uncounted=True)
def outward(tx, rx, far, vertices, i, used):  # type: ignore[no-untyped-def]
    """Return the directions in which the transmitter radiates and to which the receiver looks, route i of so many
    slots."""
    if far:
        return (-tx[0], -tx[1], -tx[2]), (-rx[0], -rx[1], -rx[2])
    if used == 0:
        return heading(vec(tx), vec(rx)), heading(vec(rx), vec(tx))
    return heading(vec(tx), slot(vertices, i, 0)), heading(vec(rx), slot(vertices, i, used - 1))


@njit(cache=True, nogil=True, uncounted=True)
def _departures(tx, rx, far, vertices, kind, away, look):  # type: ignore[no-untyped-def]
    for i in range(len(kind)):
        out, back = outward(tx, rx, far, vertices, i, used_of(kind, i))
        for c in range(3):
            away[i, c], look[i, c] = out[c], back[c]


@njit(cache=True, forceinline=True, uncounted=True)
def used_of(kind, i):  # type: ignore[no-untyped-def]
    """Return how many slots (n, d) route i uses."""
    used = 0
    while used < kind.shape[1] and kind[i, used] > 0:
        used += 1
    return used


@njit(cache=True, nogil=True)
def _rows(kind, facet, scatter, normals, several):  # type: ignore[no-untyped-def]
    """Return the first of the rows of each route, with the end of the last: several where each corner has a ray."""
    first = np.zeros(len(kind) + 1, np.int64)
    for i in range(len(kind)):
        plane = several > 1 and scatter[i] >= 0 and kind[i, scatter[i]] == SCATTER
        for j in range(used_of(kind, i) if plane else 0):
            plane &= kind[i, j] != REFLECT or facet[i, j] < 0 or not curved(normals, facet[i, j])
        first[i + 1] = first[i] + (several if plane else 1)
    return first


@njit(cache=True, nogil=True, error_model="numpy", uncounted=True)
def _write(  # type: ignore[no-untyped-def]
    tx, rx, vertices, normals, kind, scatter, points, first, away, look, out, back, cos_in, cos_out
):
    """Write directions (m, 3) and cosines (m, d) of the rows of routes, from those of their centres (n, 3)."""
    for i in range(len(kind)):
        begin, ways = first[i], first[i + 1] - first[i]
        if ways > 1:
            last = used_of(kind, i) - 1
            _incidences(points, ways, tx, i, 0, scatter[i], 1, vertices, normals, kind, begin, cos_in, out)
            _incidences(points, ways, rx, i, last, scatter[i], -1, vertices, normals, kind, begin, cos_out, back)
        for w in range(begin, begin + ways):
            # Footprints are cut where an antenna's gain ends: corners there lie on the centre's side of that line.
            for c in range(3):
                out[w, c] = away[i, c] if ways == 1 else out[w, c] + _INSIDE * (away[i, c] - out[w, c])
                back[w, c] = look[i, c] if ways == 1 else back[w, c] + _INSIDE * (look[i, c] - back[w, c])


@njit(cache=True, error_model="numpy", uncounted=True)
def _incidences(  # type: ignore[no-untyped-def]
    points, ways, end, i, first, stop, step, vertices, normals, kind, begin, cosines, starts
):
    """Write, in rows from `begin` on, the cosines of incidence (m, d) on the surfaces first, first + step, ... up to
    the footprint in slot `stop` of route i for so many rays that come from `end` over the same planes, three to its
    corners, points (n, 6, 3), a fourth to its centre, and the unit directions (m, 3) in which they leave that end."""
    image = vec(end)
    for j in range(first, stop, step):
        if kind[i, j] != TRANSMIT:
            image = mirrored(image, slot(vertices, i, j), slot(normals, i, j))
    for c in range(ways):
        ahead = heading(image, slot(points, i, c) if c < 3 else slot(vertices, i, stop))
        cosines[begin + c, stop] = cosine(ahead, slot(normals, i, stop))
        for j in range(stop - step, first - step, -step):
            n = slot(normals, i, j)
            cosines[begin + c, j] = cosine(ahead, n)
            if kind[i, j] != TRANSMIT:
                ahead = mirrored(ahead, (0.0, 0.0, 0.0), n)
        for q in range(3):
            starts[begin + c, q] = ahead[q]
