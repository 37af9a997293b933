"""From tubes on their last surface, and their leg out, to Routes: the interactions in order, and the last footprint."""

from __future__ import annotations

from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from raychan.columns import take
from raychan.compile.jit import njit
from raychan.parallel import parallel_for
from raychan.records import REFLECT, SCATTER, TRANSMIT, DiffractedRoutes, Routes
from raychan.tracing.footprints import footprints
from raychan.tracing.legs import Leg
from raychan.tracing.tubes import Tubes, edge_middles, slices
from raychan.vectors import copy_to, plane_distance
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bytes = NDArray[np.int8]
AnyRoutes = TypeVar("AnyRoutes", bound=Routes | DiffractedRoutes)

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
    """The leg out: mirror points (n, m, 3) [m], normals (m, 3) and facets (m,) of the mirrors, end's side first;
    layers passed (n, l) (see `leg_rays.follow_leg`); image (3,) of the end, or the direction to it when far; end
    (3,) [m], which fills unused slots."""

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
    first; passed (n, l) layers on it (see `leg_rays.follow_leg`). All routes have as many slots as the longest.
    """
    n, m, f = len(tubes), len(out.mirrors), geometry.facets
    end = np.asarray(out.end, float)
    middle, half_way = edge_middles(geometry, leg, tubes, first)
    # Column by column: numpy is slow over a short axis.
    slots = int(sum((x >= 0 for x in passed.T), tubes.slots.astype(np.int64)).max(initial=0)) + 1 + m
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
    passed = np.empty((len(tubes), layers * (mirrors + 1)), np.int32)
    same_leg_out(tubes.last, tubes.slots, tubes.history.rows, mirrors, corners, passed)
    return corners, passed


def counting(batches: list[AnyRoutes], keep: NDArray[np.bool_]) -> list[AnyRoutes]:
    """Return batches of routes with those that `keep` (w,), over all of them, tells."""
    ends = np.cumsum([0, *(len(b.kind) for b in batches)])
    return [take(b, keep[i:j]) for b, i, j in zip(batches, ends, ends[1:], strict=False)]


@njit(cache=True, nogil=True, uncounted=True)
def same_leg_out(last, slots, history, mirrors, corners, passed):  # type: ignore[no-untyped-def]
    """Write the mirror points (n, m, 3) of each history, and the layers (n, l) on each stretch between them, -1 for
    none.

    Args: last row of each history and how many rows it has, slots (n,); history place, normal (h, 3), facet, kind,
    before (h,); mirrors how many there are.
    """
    place, _, facet, kind, before = history
    layers = passed.shape[1] // (mirrors + 1)
    for i in range(len(last)):
        at, stretch, free = last[i], mirrors, layers
        for c in range(passed.shape[1]):
            passed[i, c] = -1
        for _ in range(slots[i]):
            if kind[at] == _TRANSMIT and free > 0:
                free -= 1
                passed[i, stretch * layers + free] = facet[at]
            elif kind[at] == _REFLECT and stretch > 0:
                stretch, free = stretch - 1, layers
                copy_to(corners[i, stretch], place[at])
            at = before[at]


@njit(cache=True, forceinline=True, uncounted=True)
def _write_history(i, used, tubes, history, retrace, planes, out):  # type: ignore[no-untyped-def]
    """Write the first `used` interactions of tube i from its history, newest first; with `retrace` and after plane
    mirrors alone each vertex moves to where the centre ray meets its plane (subdivision moved the centre)."""
    place, normal_of, facet_of, kind_of, before = history
    first, normal, _ = planes
    vertices, normals, facet, _, kind = out
    moves = retrace and tubes.flat[i]
    at = tubes.last[i]
    px, py, pz = tubes.points[i, 3, 0], tubes.points[i, 3, 1], tubes.points[i, 3, 2]
    kx, ky, kz = tubes.k[i, 3, 0], tubes.k[i, 3, 1], tubes.k[i, 3, 2]
    for s in range(used - 1, -1, -1):
        f = facet_of[at]
        facet[i, s], kind[i, s] = f, kind_of[at]
        for c in range(3):
            vertices[i, s, c], normals[i, s, c] = place[at, c], normal_of[at, c]
        if moves:
            t = plane_distance(normal[f], first[f], (px, py, pz), 0.0, (-kx, -ky, -kz))
            if abs(t) < 1e300:
                px, py, pz = px - t * kx, py - t * ky, pz - t * kz
            vertices[i, s, 0], vertices[i, s, 1], vertices[i, s, 2] = px, py, pz
            if kind_of[at] == _REFLECT:
                x, y, z = normal_of[at]
                turn = 2.0 * (kx * x + ky * y + kz * z)
                kx, ky, kz = kx - turn * x, ky - turn * y, kz - turn * z
        at = before[at]


@njit(cache=True, forceinline=True, uncounted=True)
def _write_layers_out(i, used, here, to, far, own, planes, out):  # type: ignore[no-untyped-def]
    """Write the layers `own` (l,) that the ray from `here` (3,) to a point (3,), or in this direction if far, passes,
    the last first, from slot `used` on; return the next slot."""
    first, normal, _ = planes
    wx, wy, wz = -to[0], -to[1], -to[2]
    if not far:
        wx, wy, wz = here[0] - to[0], here[1] - to[1], here[2] - to[2]
        size = (wx * wx + wy * wy + wz * wz) ** 0.5
        wx, wy, wz = wx / size, wy / size, wz / size
    for j in range(len(own) - 1, -1, -1):
        f = own[j]
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


@njit(cache=True, nogil=True, uncounted=True)
def interactions(tubes, history, retrace, planes, legs, out):  # type: ignore[no-untyped-def]
    """Write the interactions of tubes that scatter on their present footprint and leave over mirrors, in order.

    Args: tubes as `RouteTubes`; history as for `same_leg_out`; retrace whether vertices move to where the centre ray
    meets the plane mirrors; planes first, normal (f, 3) and body (f,) of facets; legs as `ReturnLegs`; out as
    `Interactions`.
    """
    body_of = planes[2]
    vertices, normals, facet, body, kind = out
    d, m = kind.shape[1], len(legs.facets)
    layers = legs.passed.shape[1] // (m + 1)
    for i in range(len(tubes.facet)):
        used, here = tubes.slots[i], tubes.points[i, 3]
        _write_history(i, used, tubes, history, retrace, planes, out)
        for c in range(3):
            vertices[i, used, c], normals[i, used, c] = here[c], tubes.normals[i, 3, c]
        facet[i, used], kind[i, used] = tubes.facet[i], _SCATTER
        used += 1
        for j in range(m, -1, -1):
            own, to = legs.passed[i, j * layers : (j + 1) * layers], legs.image if j == m else legs.end
            if 0 < j < m:
                to = legs.corners[i, j - 1]
            if layers:
                used = _write_layers_out(i, used, here, to, legs.far, own, planes, out)
            if not j:
                break
            here = legs.corners[i, j - 1]
            for c in range(3):
                vertices[i, used, c], normals[i, used, c] = here[c], legs.normals[j - 1, c]
            facet[i, used], kind[i, used] = legs.facets[j - 1], _REFLECT
            used += 1
        for s in range(used):
            body[i, s] = body_of[facet[i, s]] if facet[i, s] >= 0 else -1
        for s in range(used, d):
            facet[i, s], body[i, s], kind[i, s] = -1, -1, 0
            for c in range(3):
                vertices[i, s, c], normals[i, s, c] = legs.end[c], 0.0
