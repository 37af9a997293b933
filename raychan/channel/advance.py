"""Advance: how long paths are when their bodies have moved on, as rigid bodies do; no ray is traced.

Each vertex goes with its body. Over plane mirrors the length is that to the images of both ends in the planes where
they are by then, so it is exact for any turn as long as the same mirrors are met; on curved mirrors the plane at the
vertex stands in for the surface.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from raychan.tables import DIFFRACT, POINT, REFLECT, SCATTER, Paths

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Poses:
    """Where bodies and the radar have gone: world points x of body b are at turn[b] @ (x - origin[b]) + place[b]."""

    turn: Floats
    """(b, 3, 3)."""
    origin: Floats
    """(b, 3) [m] before."""
    place: Floats
    """(b, 3) [m] after."""
    radar: Floats
    """(3,) [m] after."""


def length_changes(paths: Paths, poses: Poses) -> Floats:
    """Return by how much each path (n,) has grown [m] once bodies and radar stand at `poses`."""
    still = Poses(np.broadcast_to(np.eye(3), poses.turn.shape).copy(), poses.origin, poses.origin, paths.tx)
    return _lengths(paths, poses) - _lengths(paths, still)


def _lengths(paths: Paths, poses: Poses) -> Floats:
    out = np.empty(len(paths.delay))
    _fill(
        paths.vertices, paths.kind, paths.body, np.ascontiguousarray(paths.tx), poses.turn, poses.origin, poses.place,
        np.ascontiguousarray(poses.radar), out,
    )  # fmt: skip
    return out


@njit(cache=True, inline="always")
def _moved(x, b, turn, origin, place):  # type: ignore[no-untyped-def]
    u, v, w = x[0] - origin[b, 0], x[1] - origin[b, 1], x[2] - origin[b, 2]
    r, o = turn[b], place[b]
    return (
        r[0, 0] * u + r[0, 1] * v + r[0, 2] * w + o[0],
        r[1, 0] * u + r[1, 1] * v + r[1, 2] * w + o[1],
        r[2, 0] * u + r[2, 1] * v + r[2, 2] * w + o[2],
    )


@njit(cache=True, inline="always")
def _way(a, b):  # type: ignore[no-untyped-def]
    x, y, z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    s = (x * x + y * y + z * z) ** 0.5
    s = s if s > 0.0 else 1.0
    return x / s, y / s, z / s


@njit(cache=True)
def _image(source, before, vertex, after, b, turn, origin, place):  # type: ignore[no-untyped-def]
    """Mirror a point in the plane at a vertex, which `before` and `after` tell of, where body b has carried it."""
    d, e = _way(before, vertex), _way(vertex, after)
    n = (e[0] - d[0], e[1] - d[1], e[2] - d[2])
    size = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) ** 0.5
    if size < 1e-9:
        return source
    r = turn[b]
    x = (r[0, 0] * n[0] + r[0, 1] * n[1] + r[0, 2] * n[2]) / size
    y = (r[1, 0] * n[0] + r[1, 1] * n[1] + r[1, 2] * n[2]) / size
    z = (r[2, 0] * n[0] + r[2, 1] * n[1] + r[2, 2] * n[2]) / size
    p = _moved(vertex, b, turn, origin, place)
    h = 2.0 * ((source[0] - p[0]) * x + (source[1] - p[1]) * y + (source[2] - p[2]) * z)
    return source[0] - h * x, source[1] - h * y, source[2] - h * z


@njit(cache=True, inline="always")
def _apart(a, b):  # type: ignore[no-untyped-def]
    return ((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2) ** 0.5


@njit(cache=True, parallel=True)
def _fill(vertices, kind, body, end, turn, origin, place, radar, out):  # type: ignore[no-untyped-def]
    n, d = kind.shape
    old = (end[0], end[1], end[2])
    new = (radar[0], radar[1], radar[2])
    for i in prange(n):
        used = 0
        while used < d and kind[i, used] > 0:
            used += 1
        at, bent = used, False
        for j in range(used):
            if kind[i, j] == SCATTER or kind[i, j] == POINT:
                at = j
            bent = bent or kind[i, j] == DIFFRACT
        if bent:
            # An edge has no image: along the vertices, which is right to first order of the motion.
            last, total = new, 0.0
            for j in range(used):
                v = vertices[i, j]
                here = _moved((float(v[0]), float(v[1]), float(v[2])), body[i, j], turn, origin, place)
                total += _apart(last, here)
                last = here
            out[i] = total + _apart(last, new)
            continue
        forth = new
        for j in range(at):
            if kind[i, j] == REFLECT:
                a, v = vertices[i, j - 1], vertices[i, j]
                before = (float(a[0]), float(a[1]), float(a[2])) if j > 0 else old
                c = vertices[i, j + 1] if j + 1 < used else vertices[i, j]
                after = (float(c[0]), float(c[1]), float(c[2])) if j + 1 < used else old
                here = (float(v[0]), float(v[1]), float(v[2]))
                forth = _image(forth, before, here, after, body[i, j], turn, origin, place)
        if at == used:
            out[i] = _apart(forth, new)
            continue
        back = new
        for j in range(used - 1, at, -1):
            if kind[i, j] == REFLECT:
                a, v = vertices[i, j - 1], vertices[i, j]
                before = (float(a[0]), float(a[1]), float(a[2]))
                c = vertices[i, j + 1] if j + 1 < used else vertices[i, j]
                after = (float(c[0]), float(c[1]), float(c[2])) if j + 1 < used else old
                here = (float(v[0]), float(v[1]), float(v[2]))
                back = _image(back, before, here, after, body[i, j], turn, origin, place)
        s = vertices[i, at]
        point = _moved((float(s[0]), float(s[1]), float(s[2])), body[i, at], turn, origin, place)
        out[i] = _apart(forth, point) + _apart(back, point)
