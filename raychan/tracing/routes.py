"""From tubes on their last surface, and their leg out, to Routes: the interactions in order, and the last footprint."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.parallel import parallel_for
from raychan.records import REFLECT, SCATTER, TRANSMIT, Routes
from raychan.tracing.footprints import footprints
from raychan.tracing.legs import Leg
from raychan.tracing.tubes import Tubes, edge_middles, slices
from raychan.vectors import copy_to, dot, plane_distance, row
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bytes = NDArray[np.int8]

_REFLECT, _TRANSMIT, _SCATTER = int(REFLECT), int(TRANSMIT), int(SCATTER)  # plain numbers for the kernels


class RouteTubes(NamedTuple):
    """Columns of `tubes.Tubes` from which interactions follow."""

    points: Floats
    k: Floats
    normals: Floats
    facet: Ints
    last: Ints
    slots: Bytes
    flat: NDArray[np.bool_]


class ReturnLegs(NamedTuple):
    """The leg out: mirror points (n, m, 3) [m], normals (m, 3) and facets (m,) of the mirrors, end's side first; layers
    passed (n, l) on the last stretch; image (3,) of the end, or the direction to it when far; end (3,) [m], which fills
    unused slots."""

    corners: Floats
    normals: Floats
    facets: NDArray[np.int64]
    passed: Ints
    image: Floats
    far: bool
    end: Floats


class Interactions(NamedTuple):
    """Interactions to be written: vertices, normals (n, d, 3), facet, body, kind (n, d)."""

    vertices: Floats
    normals: Floats
    facet: Ints
    body: NDArray[np.int16]
    kind: Bytes


def routes_of(
    geometry: Geometry, leg: Leg, out: Leg, tubes: Tubes, first: bool, corners: Floats, passed: Ints
) -> Routes:
    """Return the routes of tubes that scatter on their present footprint and leave over `out`.

    Args: first whether this is their first surface; corners (n, m, 3) [m] mirror points of the leg out, receiver's side
    first; passed (n, l) layers on its last stretch. All routes have as many slots as the longest.
    """
    n, m, f = len(tubes), len(out.mirrors), geometry.facets
    end = np.asarray(out.end, float)
    middle, half_way = edge_middles(geometry, leg, tubes, first)
    slots = int((tubes.slots + (passed >= 0).sum(axis=1)).max(initial=0)) + 1 + m
    vertices, normals = np.empty((2, n, slots, 3))
    facet, body = np.empty((n, slots), np.int32), np.empty((n, slots), np.int16)
    kind = np.empty((n, slots), np.int8)
    points, lengths, taper = np.empty((n, 6, 3)), np.empty((n, 6)), np.empty((n, 3))
    length, area, back_length = np.empty((3, n))
    written = Interactions(vertices, normals, facet, body, kind)
    columns = [getattr(tubes, name) for name in RouteTubes._fields]
    mirrors = np.array([x.normal for x in out.mirrors]).reshape(m, 3), np.array([x.facet for x in out.mirrors], int)
    planes = geometry.first, geometry.normal, f.body
    shape = geometry.normal, f.vertices, geometry.edge_curvature, geometry.curved
    # A receiver that is a direction has no point to fill unused slots with.
    fill = np.zeros(3) if out.far else end

    def some(at: slice) -> None:
        interactions(
            RouteTubes(*(x[at] for x in columns)), tubes.history.rows, not first, planes,
            ReturnLegs(corners[at], *mirrors, passed[at], out.image, out.far, fill),
            slices(written, at),
        )  # fmt: skip
        footprints(
            tuple(getattr(tubes, x)[at] for x in ("points", "k", "normals", "length", "facet", "bary")), middle[at],
            half_way[at], shape, out.image, out.far,
            tuple(x[at] for x in (points, lengths, length, taper, area, back_length)),
        )  # fmt: skip

    parallel_for(n, some)
    return Routes(
        tx=np.asarray(leg.end, float),
        rx=end,
        far=out.far,
        vertices=vertices,
        normals=normals,
        facet=facet,
        body=body,
        kind=kind,
        scatter=tubes.slots.copy(),
        points=points,
        lengths=lengths,
        length=length,
        taper=taper,
        area=area,
        spread_in=tubes.spread,
        spread_out=out.spread(back_length),
        caustics=tubes.caustics,
        sigma=np.zeros(n),
    )


def ray_routes(tx: Floats, rx: Floats, rows: Interactions, length: Floats, **given: Any) -> Routes:
    """Return routes of single rays, which have no footprint: specular paths, and targets given by their RCS.

    Args: tx, rx (3,) [m]; rows their interactions; length (n,) [m] of each; given columns in place of those of a
    specular path: scatter, spread_in, spread_out, sigma.
    """
    n = len(length)
    specular: dict[str, Any] = {
        "scatter": np.full(n, -1, np.int8),
        "spread_in": 1.0 / length,
        "spread_out": np.ones(n),
        "sigma": np.zeros(n),
    }
    return Routes(
        tx=tx,
        rx=rx,
        far=False,
        **rows._asdict(),
        points=np.zeros((n, 6, 3)),
        lengths=np.repeat(length[:, None], 6, axis=1),
        length=length,
        taper=np.ones((n, 3)),
        area=np.zeros(n),
        caustics=np.zeros(n, np.int8),
        **(specular | given),
    )


def leg_of_arrival(tubes: Tubes, mirrors: int, layers: int) -> tuple[Floats, Ints]:
    """Return the mirror points (n, m, 3) [m] and the layers (n, l) on the leg out of first-bounce tubes that leave by
    the leg over which they came, from their history."""
    corners = np.zeros((len(tubes), mirrors, 3))
    passed = np.empty((len(tubes), layers), np.int32)
    same_leg_out(tubes.last, tubes.slots, tubes.history.rows, mirrors, corners, passed)
    return corners, passed


@njit(cache=True, nogil=True)
def same_leg_out(last, slots, history, mirrors, corners, passed):  # type: ignore[no-untyped-def]
    """Write the mirror points (n, m, 3) at the start of each history, and the layers (n, l) right behind them, -1 for
    none.

    Args: last row of each history and how many rows it has, slots (n,); history place, normal (h, 3), facet, kind,
    before (h,); mirrors how many there are.
    """
    place, _, facet, kind, before = history
    layers = passed.shape[1]
    for i in range(len(last)):
        at = last[i]
        for c in range(layers):
            passed[i, c] = -1
        for s in range(slots[i] - 1, -1, -1):
            if s < mirrors:
                copy_to(corners[i, s], place[at])
            elif s < mirrors + layers and kind[at] == _TRANSMIT:
                passed[i, s - mirrors] = facet[at]
            at = before[at]


@njit(cache=True, forceinline=True)
def _put(out, i, j, x):  # type: ignore[no-untyped-def]
    """Write x into slot j of route i of out (n, d, 3)."""
    out[i, j, 0], out[i, j, 1], out[i, j, 2] = x


@njit(cache=True, forceinline=True)
def _write_layers_out(i, used, here, planes, legs, out):  # type: ignore[no-untyped-def]
    """Write the layers that the ray from `here` (3,) to the end passes, from slot `used` on; return the next slot."""
    first, normal, _ = planes
    image = legs.image
    wx, wy, wz = -image[0], -image[1], -image[2]
    if not legs.far:
        wx, wy, wz = here[0] - image[0], here[1] - image[1], here[2] - image[2]
        size = (wx * wx + wy * wy + wz * wz) ** 0.5
        wx, wy, wz = wx / size, wy / size, wz / size
    for j in range(legs.passed.shape[1] - 1, -1, -1):
        f = legs.passed[i, j]
        if f < 0:
            continue
        t = plane_distance(normal[f], first[f], here, 0.0, (-wx, -wy, -wz))
        out.vertices[i, used, 0] = here[0] - t * wx
        out.vertices[i, used, 1] = here[1] - t * wy
        out.vertices[i, used, 2] = here[2] - t * wz
        for c in range(3):
            out.normals[i, used, c] = normal[f, c]
        out.facet[i, used], out.kind[i, used] = f, _TRANSMIT
        used += 1
    return used


@njit(cache=True, nogil=True)
def interactions(tubes, history, retrace, planes, legs, out):  # type: ignore[no-untyped-def]
    """Write the interactions of tubes that scatter on their present footprint and leave over mirrors, in order.

    Args: tubes as `RouteTubes`; history as for `same_leg_out`; retrace whether, after plane mirrors alone, vertices
    move to where the centre ray meets the mirrors, as subdivision moved the centre; planes first, normal (f, 3) and
    body (f,) of facets; legs as `ReturnLegs`; out as `Interactions`.
    """
    # Taken out of the tuples once: each access counts a reference.
    (vertices, normals, facet, body, kind), (first, normal, body_of) = out, planes
    place, normal_of, facet_of, kind_of, before = history
    points, k, own, facets, last, slots, flat = tubes
    corners, mirrors, mirror_facets, passed, _, _, end = legs
    d, out_mirrors, layers = kind.shape[1], len(mirror_facets), passed.shape[1] > 0
    for i in range(len(facets)):
        used, at, moves = slots[i], last[i], retrace and flat[i]
        p, ahead = (points[i, 3, 0], points[i, 3, 1], points[i, 3, 2]), (k[i, 3, 0], k[i, 3, 1], k[i, 3, 2])
        _put(vertices, i, used, p)
        _put(normals, i, used, (own[i, 3, 0], own[i, 3, 1], own[i, 3, 2]))
        facet[i, used], kind[i, used] = facets[i], _SCATTER
        # The history, newest first; each vertex that moves does so to where the centre ray meets its plane.
        for s in range(used - 1, -1, -1):
            f, n = facet_of[at], row(normal_of, at)
            facet[i, s], kind[i, s] = f, kind_of[at]
            _put(normals, i, s, n)
            if moves:
                t = plane_distance(row(normal, f), row(first, f), p, 0.0, (-ahead[0], -ahead[1], -ahead[2]))
                if abs(t) < 1e300:
                    p = p[0] - t * ahead[0], p[1] - t * ahead[1], p[2] - t * ahead[2]
                if kind_of[at] == _REFLECT:
                    turn = 2.0 * dot(ahead, n)
                    ahead = ahead[0] - turn * n[0], ahead[1] - turn * n[1], ahead[2] - turn * n[2]
            _put(vertices, i, s, p if moves else row(place, at))
            at = before[at]
        used += 1
        if layers:
            used = _write_layers_out(i, used, points[i, 3], planes, legs, out)
        for j in range(out_mirrors - 1, -1, -1):
            _put(vertices, i, used, (corners[i, j, 0], corners[i, j, 1], corners[i, j, 2]))
            _put(normals, i, used, row(mirrors, j))
            facet[i, used], kind[i, used] = mirror_facets[j], _REFLECT
            used += 1
        for s in range(used):
            body[i, s] = body_of[facet[i, s]] if facet[i, s] >= 0 else -1
        for s in range(used, d):
            facet[i, s], body[i, s], kind[i, s] = -1, -1, 0
            _put(vertices, i, s, (end[0], end[1], end[2]))
            _put(normals, i, s, (0.0, 0.0, 0.0))
