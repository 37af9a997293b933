"""Seeds: the facets that could be met over a leg; clusters of them that all turn away are passed over whole, and so are
those out of a mirror's reach, behind a wall or a solid body, or where the antenna does not look."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.parallel import parallel_for
from raychan.poses import sizes
from raychan.tracing.edge_crossings import dot
from raychan.tracing.legs import Leg
from raychan.tracing.occluders import Occluders
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]

_MANY = 1000  # clusters from which on a second thread pays
_WIDE = 1e-6  # rad: rounding must not hide what grazes


def seed_facets(geometry: Geometry, leg: Leg, pieces: Bools) -> Ints:
    """Return the facets of pieces (p,) that could be met over a leg, in order."""
    f = geometry.facets
    if not len(f.body) or not pieces.any():
        return np.zeros(0, np.int32)
    c, screens = geometry.clusters, _screens(geometry)
    walls, balls = screens.over(leg), screens.within(leg)
    mirror = np.zeros(3), np.zeros(3), np.zeros(3), 0.0
    if leg.mirrors and not leg.far:
        m = leg.mirrors[-1]
        mirror = m.point, m.normal, m.centre, m.radius
    image = np.asarray(leg.image, float)
    way = image, leg.far, bool(leg.mirrors) and not leg.far, *mirror
    lead = c.order[c.first[:-1]]
    of, sides, piece = f.body[lead], geometry.scene_topology.cluster_sides, geometry.scene_topology.cluster_piece
    # Of clusters of several pieces each facet is asked later.
    wanted = pieces[piece] | (piece < 0)
    alive = np.zeros(len(lead), np.bool_)

    def some(rows: slice) -> None:
        hull = c.centre[rows], c.radius[rows], c.axis[rows], c.spread[rows]
        about = wanted[rows], of[rows], sides[rows], *hull
        _alive(*(*about, *way, *walls, *balls, alive[rows]))

    parallel_for(len(lead), some, _MANY)
    left = np.flatnonzero(alive)
    left = left[~leg.outside_beam(c.centre[left], c.radius[left])]
    shape = f.vertices, f.normals, geometry.area, geometry.both_sides
    rows = np.sort(_lit(left, c.order, c.first, *shape, image, leg.far))
    if not pieces.all():
        rows = rows[pieces[geometry.piece[rows]]]
    if leg.mirrors:
        v = f.vertices[rows]
        middle = v.mean(axis=1)
        rows = rows[leg.may_reach(middle, sizes(v - middle[:, None]).max(axis=1))]
    return rows


def _screens(geometry: Geometry) -> Any:
    with geometry.making:
        if geometry.screens is None:
            geometry.screens = Occluders(geometry)
    return geometry.screens


@njit(cache=True, forceinline=True)
def _angle(a, b):  # type: ignore[no-untyped-def]
    """Return the angle [rad] between two vectors."""
    size = math.sqrt(dot(a, a) * dot(b, b))
    return math.acos(min(max(dot(a, b) / size, -1.0), 1.0)) if size > 0.0 else 0.0


@njit(cache=True, forceinline=True)
def _half(radius, distance):  # type: ignore[no-untyped-def]
    """Return half the angle [rad] under which a ball is seen; pi from within."""
    return math.asin(radius / distance) if radius < distance else math.pi


@njit(cache=True, forceinline=True)
def _over(centre, radius, d, image, point, normal, middle, reach, work):  # type: ignore[no-untyped-def]
    """Tell whether something in a ball, at d from the image, could be met over a mirror within a ball about middle."""
    height = 0.0
    for c in range(3):
        height += (centre[c] - point[c]) * normal[c]
        work[c] = middle[c] - image[c]
    # A facet in the ball has a ball of its own, of up to twice the radius, that may lie across.
    if height < -3.0 * radius:
        return False
    widest = _half(reach + 2.0 * radius, math.sqrt(dot(work, work))) + _half(radius, math.sqrt(dot(d, d)))
    return _angle(work, d) <= widest + _WIDE


@njit(cache=True, forceinline=True)
def _hidden(centre, radius, body, point, normal, owner, first, edge, inward):  # type: ignore[no-untyped-def]
    """Tell whether a wall of another body hides a ball: it lies behind, within the planes through the wall's edges."""
    for w in range(len(owner)):
        if owner[w] == body:
            continue
        depth = 0.0
        for c in range(3):
            depth -= (centre[c] - point[w, c]) * normal[w, c]
        hides = depth > radius
        for e in range(first[w], first[w + 1]):
            if not hides:
                break
            within = 0.0
            for c in range(3):
                within += (centre[c] - edge[e, c]) * inward[e, c]
            hides = within > radius
        if hides:
            return True
    return False


@njit(cache=True, forceinline=True)
def _eclipsed(centre, radius, body, image, far, core, size, owner):  # type: ignore[no-untyped-def]
    """Tell whether a ball lies wholly in the shadow of a core of another body: within its cone or, from far, cylinder,
    and behind where rays enter the core."""
    for w in range(len(owner)):
        if owner[w] == body or (far and radius >= size[w]):
            continue
        along, here, there = 0.0, 0.0, 0.0
        for c in range(3):
            a = core[w, c] - (centre[c] if far else image[c])
            b = image[c] if far else centre[c] - image[c]
            along, here, there = along + a * b, here + a * a, there + b * b
        if far:
            # The image is the direction towards the end: a core nearer to it lies higher.
            if along > radius and here - along * along < (size[w] - radius) ** 2:
                return True
            continue
        # Rays enter the core nearer than where they touch it.
        rim, apart = here - size[w] * size[w], math.sqrt(there)
        if rim <= 0.0 or apart <= radius or (apart - radius) ** 2 <= rim:
            continue
        off = math.acos(min(max(along / math.sqrt(here * there), -1.0), 1.0))
        if off + _half(radius, apart) < _half(size[w], math.sqrt(here)) - _WIDE:
            return True
    return False


@njit(cache=True, nogil=True)
def _alive(  # type: ignore[no-untyped-def]
    wanted, body, is_open, centre, radius, axis, spread, image, far, mirrored, at, normal, middle, reach, walls,
    normals, owners, begins, edges, inwards, touch, inner_spheres, sizes, solids, out,
):  # fmt: skip
    """Tell of clusters (k,), each with a ball and a cone of normals, which may hold a facet that could be met."""
    d, work = np.empty(3), np.empty(3)
    for i in range(len(radius)):
        if not wanted[i]:
            continue
        for c in range(3):
            d[c] = -image[c] if far else centre[i, c] - image[c]
        if not is_open[i]:
            around = 0.0 if far else _half(radius[i], math.sqrt(dot(d, d)))
            if _angle(d, axis[i]) + spread[i] + around < 0.5 * math.pi - _WIDE:
                continue
        if mirrored and not _over(centre[i], radius[i], d, image, at, normal, middle, reach, work):
            continue
        swell = 1.001 * radius[i] + touch
        if _hidden(centre[i], swell, body[i], walls, normals, owners, begins, edges, inwards):
            continue
        out[i] = not _eclipsed(centre[i], swell, body[i], image, far, inner_spheres, sizes, solids)


@njit(cache=True, nogil=True)
def _lit(clusters, order, first, v, n, area, is_open, image, far):  # type: ignore[no-untyped-def]
    """Return the facets of clusters that face the image at a corner at least, or are open, in no order."""
    total = 0
    for i in clusters:
        total += first[i + 1] - first[i]
    out, count = np.empty(total, np.int32), 0
    for i in clusters:
        for j in range(first[i], first[i + 1]):
            f = order[j]
            if not area[f] > 0.0:
                continue
            lit = is_open[f]
            for q in range(3):
                towards = 0.0
                for c in range(3):
                    towards += (-image[c] if far else v[f, q, c] - image[c]) * n[f, q, c]
                lit |= towards < 0.0
            if lit:
                out[count] = f
                count += 1
    return out[:count].copy()
