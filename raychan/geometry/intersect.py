"""Rays: what is done in float64 about the float32 casts of a ray and its two companions (numba loops).

Everywhere: origin, direction (n, 3) [m], unit; normal (m, 3), first (m, 3) and vertices (m, 3, 3) of the facets.
"""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit

_FAR = 32.0  # radii of the ball about all facets from which an origin is far off
_ALONG = 1e-9  # sine of the angle under which a ray runs along a facet: far from the origin rounding is of this size
_BESIDE = 1e-3  # of a facet's length along a ray: what a grazing ray's hit may lie beside it
_PACES = 64.0  # the same in paces of the ray, of which a small facet is no more


@njit(cache=True, forceinline=True)
def plane_distance(n, v, x, along, d):  # type: ignore[no-untyped-def]
    """Return the distance from x + along d to the plane through v of normal n, along d."""
    slope = n[0] * d[0] + n[1] * d[1] + n[2] * d[2]
    if slope == 0.0:
        return np.inf
    height = 0.0
    for c in range(3):
        height += n[c] * (v[c] - (x[c] + along * d[c]))
    return height / slope


@njit(cache=True, nogil=True)
def plane_distances(facet, origin, direction, first, normal):  # type: ignore[no-untyped-def]
    """Return the distance [m] along each ray to the plane of its facet (n,), inf when parallel."""
    out = np.empty(len(facet))
    for i in range(len(facet)):
        f = facet[i]
        out[i] = plane_distance(normal[f], first[f], origin[i], 0.0, direction[i])
    return out


@njit(cache=True, forceinline=True)
def _holds(v, n, x, t, d, margin):  # type: ignore[no-untyped-def]
    """Tell whether x + t d, a point of a facet's plane, lies on it, or at most `margin` [m] outside."""
    for a in range(3):
        b = (a + 1) % 3
        sx, sy, sz = v[b, 0] - v[a, 0], v[b, 1] - v[a, 1], v[b, 2] - v[a, 2]
        px, py, pz = x[0] + t * d[0] - v[a, 0], x[1] + t * d[1] - v[a, 1], x[2] + t * d[2] - v[a, 2]
        depth = px * (n[1] * sz - n[2] * sy) + py * (n[2] * sx - n[0] * sz) + pz * (n[0] * sy - n[1] * sx)
        if depth <= -margin * math.sqrt(sx * sx + sy * sy + sz * sz):
            return False
    return True


@njit(cache=True, nogil=True)
def near_ball(origin, direction, most, centre, radius):  # type: ignore[no-untyped-def]
    """Return the rays (k,) of those (n,) that may meet a ball, centre (3,) and radius [m], before `most` (n,) [m]."""
    rows = np.empty(len(origin), np.int64)
    count = 0
    for i in range(len(origin)):
        along, apart = 0.0, 0.0
        for c in range(3):
            d = centre[c] - origin[i, c]
            along += d * direction[i, c]
            apart += d * d
        aside = apart - along * along
        if along > -radius and along - radius < most[i] and aside < radius * radius * (1.0 + 1e-9) + 1e-9 * apart:
            rows[count] = i
            count += 1
    return rows[:count].copy()


@njit(cache=True, nogil=True)
def set_out(origin, direction, skip, start, centre, radius, slack, size):  # type: ignore[no-untyped-def]
    """Return how far ahead (n,) [m] rays are cast, and their pace (n,) [m]: a few float32 spacings.

    Args: skip, start (n,) as for `RayCaster.cast`; centre (3,), radius [m] of a ball about all facets; slack, the pace
    in parts of a coordinate; size [m] that a coordinate counts at least.
    """
    n = len(origin)
    ahead, pace = np.empty(n), np.empty(n)
    for i in range(n):
        x, d = origin[i], direction[i]
        along = 0.0
        for c in range(3):
            along += (centre[c] - x[c]) * d[c]
        aside = 0.0
        for c in range(3):
            aside += (x[c] + along * d[c] - centre[c]) ** 2
        # Before the ball about all facets nothing is hit: rays from far off set out there, where float32 is finer.
        at = along - math.sqrt(max(radius * radius - aside, 0.0))
        at = at if at > max(start[i], _FAR * radius) else start[i]
        most = 0.0
        for c in range(3):
            most = max(most, abs(x[c] + at * d[c] - centre[c]))
        pace[i] = slack * (size + most)
        ahead[i] = at + (pace[i] if at == start[i] and (skip[i] >= 0 or start[i] > 0.0) else 0.0)
    return ahead, pace


@njit(cache=True, nogil=True)
def companions(todo, origin, direction, ahead, pace, centre, turn):  # type: ignore[no-untyped-def]
    """Return float32 origins and directions (3 m, 3) of the rays `todo` (m,), each with two companions, a pace to
    either side, or a quarter turn from there if `turn`: no plane through the ray holds both pairs."""
    m = len(todo)
    o, d = np.empty((3 * m, 3), np.float32), np.empty((3 * m, 3), np.float32)
    side = np.empty(3)
    for j in range(m):
        i = todo[j]
        x, y, z = direction[i]
        # Not parallel to the direction, and not along the axes, on which edges like to lie.
        side[0] = y * (y - 0.7) - z * (x + 0.3)
        side[1] = z * z - x * (y - 0.7)
        side[2] = x * (x + 0.3) - y * z
        if turn:
            u, v, w = side
            side[0], side[1], side[2] = y * w - z * v, z * u - x * w, x * v - y * u
        for c in range(3):
            at, way = origin[i, c] + ahead[i] * direction[i, c], pace[i] * side[c]
            o[3 * j, c], d[3 * j, c] = at - centre[c], direction[i, c]
            o[3 * j + 1, c], d[3 * j + 1, c] = at + way - centre[c], direction[i, c]
            o[3 * j + 2, c], d[3 * j + 2, c] = at - way - centre[c], direction[i, c]
    return o, d


@njit(cache=True, forceinline=True)
def _met(v, n, x, d, t, pace):  # type: ignore[no-untyped-def]
    """Tell whether the distance t [m] along a ray to a facet's plane is one to the facet: not before it nor beyond.

    A facet seen edge-on, which float32 meets, has none, or any: the ray runs along its plane but for rounding.
    """
    if not (abs(n[0] * d[0] + n[1] * d[1] + n[2] * d[2]) > _ALONG and math.isfinite(t)):
        return False
    low, high = np.inf, -np.inf
    for q in range(3):
        along = 0.0
        for c in range(3):
            along += (v[q, c] - x[c]) * d[c]
        low, high = min(low, along), max(high, along)
    room = _BESIDE * (high - low) + _PACES * pace
    return low - room < t < high + room


@njit(cache=True, forceinline=True)
def _beside(j, hit, x, d, ahead, pace, vertices, first, normal):  # type: ignore[no-untyped-def]
    """Return what stands for a facet that a ray runs along: the nearest that its companions meet, -1 if nothing; -2 if
    they run along one too."""
    h, old = -1, np.inf
    for s in range(1, 3):
        other = hit[3 * j + s]
        if other < 0:
            continue
        new = plane_distance(normal[other], first[other], x, 0.0, d)
        if other == hit[3 * j] or not _met(vertices[other], normal[other], x, d, new, pace):
            return -2
        if ahead < new < old:
            h, old = other, new
    return h


@njit(cache=True, nogil=True)
def land(  # type: ignore[no-untyped-def]
    todo, hit, origin, direction, skip, start, ahead, pace, edge, nearest, vertices, first, normal, facet, distance
):
    """Write facets and distances of the rays `todo` (m,); return those to be cast again, from farther on or with
    companions farther aside.

    Args: hit (3 m,) what each ray and its companions met. Of rays aimed at corners Embree lets one in some hundreds
    through, of those aimed at edges one in a million: what a companion met nearer counts, where the ray meets it too,
    or misses it by `edge` of its pace at most. nearest [m]: a hit closer to the start is the surface left.
    """
    again = np.empty(len(todo), np.int64)
    count = 0
    for j in range(len(todo)):
        i = todo[j]
        x, d = origin[i], direction[i]
        h = hit[3 * j]
        t = plane_distance(normal[h], first[h], x, 0.0, d) if h >= 0 else 0.0
        if h >= 0 and not _met(vertices[h], normal[h], x, d, t, pace[i]):
            h = _beside(j, hit, x, d, ahead[i], pace[i], vertices, first, normal)
            if h == -2:
                pace[i] *= 2.0
                again[count] = i
                count += 1
                continue
        for s in range(1, 3):
            other = hit[3 * j + s]
            if other < 0 or other == h:
                continue
            old = np.inf if h < 0 else plane_distance(normal[h], first[h], x, ahead[i], d)
            new = plane_distance(normal[other], first[other], x, ahead[i], d)
            at = ahead[i] + new
            if (
                0.0 < new < old - pace[i]
                and _met(vertices[other], normal[other], x, d, at, pace[i])
                and _holds(vertices[other], normal[other], x, at, d, edge * pace[i])
            ):
                h = other
        if h < 0:
            continue
        t = plane_distance(normal[h], first[h], x, 0.0, d)
        if h != skip[i] and t > start[i] + nearest:
            facet[i], distance[i] = h, t
            continue
        ahead[i] = max(t, ahead[i]) + 2.0 * pace[i]
        pace[i] *= 2.0
        again[count] = i
        count += 1
    return again[:count].copy()


@njit(cache=True, forceinline=True)
def _clear(  # type: ignore[no-untyped-def]
    a, b, t, x, d, limit, slack, touch, plane, smooth, vertices, normal, margin
):
    """Tell whether a ray aimed at facet b (-1: none) that met facet a at t [m] reached its `limit` [m].

    Only the target's own smooth surface may lie before it by `slack` [m], others by `touch` [m]. Where another
    surface lies in the plane of the target, at the same place, that counts and the target does not: what is drawn
    twice returns once. Facets of one plane overlap where the point lies within both, by `margin` [m].
    """
    if a < 0 or a == b:
        return True
    own = b >= 0 and smooth[a] == smooth[b]
    close = min(slack, touch)
    free = t >= limit - (slack if own else close)
    if b < 0 or abs(t - limit) >= close:
        return free
    if abs(normal[a, 0] * normal[b, 0] + normal[a, 1] * normal[b, 1] + normal[a, 2] * normal[b, 2]) <= 1.0 - 1e-9:
        return free
    if plane[a] != plane[b] and not own:
        return False
    return free and not (
        _holds(vertices[a], normal[a], x, t, d, -margin) and _holds(vertices[b], normal[b], x, t, d, -margin)
    )


@njit(cache=True, nogil=True)
def arrive(  # type: ignore[no-untyped-def]
    todo, facet, t, origin, direction, limit, slack, target, touch, plane, smooth, vertices, normal, margin, body,
    inside, is_layer, reached, passed, blocker,
):  # fmt: skip
    """Write what became of the rays `todo` (m,) that met `facet` (m,) at t (m,) [m]; return which of these (k,) go on
    behind a thin layer.

    Args: origin, direction (m, 3); limit, slack [m], target facet and the body that it stands `inside`, which never
    blocks (n,; empty: none); is_layer (f,), empty where nothing is; reached (n,), passed (n, layers), blocker (n,).
    """
    more = np.empty(len(todo), np.int64)
    count = 0
    for j in range(len(todo)):
        i, a = todo[j], facet[j]
        free = _clear(
            a, target[i], t[j], origin[j], direction[j], limit[i], slack[i], touch, plane, smooth, vertices, normal,
            margin,
        )  # fmt: skip
        if not free and len(inside):
            free = body[a] == inside[i]
        if free:
            reached[i] = True
            blocker[i] = -1
            continue
        blocker[i] = a
        if not len(is_layer) or not is_layer[a]:
            continue
        for q in range(passed.shape[1]):
            if passed[i, q] < 0:
                passed[i, q] = a
                more[count] = j
                count += 1
                break
    return more[:count].copy()
