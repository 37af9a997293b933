"""Culling: which facets a leg may light at all.

Facets are dropped by clusters of neighbours, each with a bounding sphere: clusters that lie beyond all rays over the
leg's mirrors, that an occluder (a wall or a solid body) hides, or that lie outside the antenna's beam. Of the others
each facet is dropped that turns away.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.parallel import parallel_for
from raychan.tracing.cache import cache_of
from raychan.tracing.legs import Leg
from raychan.tracing.occluders import Occluders
from raychan.vectors import dot
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]

_PARALLEL_FROM = 1000  # clusters from which on a second thread pays; not measured
_ROUNDING = 1e-6  # rad: what grazes within it is kept
_BESIDE = 1e-3  # m beyond the planes between which rays run: more than `image_paths.may_leave` leaves


class _Clusters(NamedTuple):
    """Clusters of facets: which are wanted (k,), their bodies (k,), and bounding spheres, centre (k, 3) and radius (k,)
    [m]."""

    wanted: Bools
    body: Ints
    centre: Floats
    radius: Floats


class _Source(NamedTuple):
    """Where rays come from: the image (3,) [m] (a unit direction when far), and the planes between which those over
    mirrors run: normals (k, 3), inward, and their offsets (k,) [m]."""

    image: Floats
    far: bool
    inward: Floats
    offset: Floats


def seed_facets(geometry: Geometry, leg: Leg, pieces: Bools) -> Ints:
    """Return the facets (n,) that a leg may light, in order, of those pieces (p,) that are wanted."""
    f = geometry.facets
    if not len(f.body) or not pieces.any():
        return np.zeros(0, np.int32)
    c = geometry.clusters
    occluders = cache_of(geometry).single("occluders", lambda: Occluders(geometry))
    walls, spheres = occluders.walls_over(leg), occluders.spheres_over(leg)
    image = np.asarray(leg.image, float)
    inward, offset = np.zeros((0, 3)), np.zeros(0)
    if leg.mirrors and not leg.far:
        m = leg.mirrors[-1]
        inward = np.concatenate([m.normal[None], leg.windows])
        offset = np.append(m.normal @ m.point, leg.windows @ image)
    source = _Source(image, leg.far, inward, offset)
    lead = c.order[c.first[:-1]]
    of, piece = f.body[lead], geometry.scene_topology.cluster_piece
    # Of clusters of several pieces each facet is tested below.
    wanted = pieces[piece] | (piece < 0)
    alive = np.zeros(len(lead), np.bool_)

    def some(rows: slice) -> None:
        clusters = _Clusters(wanted[rows], of[rows], c.centre[rows], c.radius[rows])
        _may_be_lit(clusters, source, walls, spheres, alive[rows])

    parallel_for(len(lead), some, _PARALLEL_FROM)
    left = np.flatnonzero(alive)
    left = left[~leg.outside_beam(c.centre[left], c.radius[left])]
    shape = f.vertices, f.normals, geometry.area, geometry.both_sides
    rows = np.sort(_lit_facets(left, c.order, c.first, *shape, image, leg.far))
    if not pieces.all():
        rows = rows[pieces[geometry.piece[rows]]]
    if leg.mirrors:
        rows = rows[leg.may_leave(f.vertices, rows)]
    return rows


@njit(cache=True, forceinline=True, uncounted=True)
def _half_width(radius, distance):  # type: ignore[no-untyped-def]
    """Return half the angle [rad] under which a sphere is seen; pi from within."""
    return math.asin(radius / distance) if radius < distance else math.pi


@njit(cache=True, forceinline=True, uncounted=True)
def _depth(centre, source):  # type: ignore[no-untyped-def]
    """Return how far [m] a point lies within the planes between which rays run, below 0 beyond one of them."""
    depth = np.inf
    for k in range(len(source.offset)):
        depth = min(depth, dot(source.inward[k], centre) - source.offset[k])
    return depth


@njit(cache=True, forceinline=True, uncounted=True)
def _behind_wall(centre, radius, body, walls):  # type: ignore[no-untyped-def]
    """Tell whether a wall of another body hides a sphere: it lies behind, within the planes through the wall's
    edges."""
    for w in range(len(walls.body)):
        if walls.body[w] == body:
            continue
        depth = 0.0
        for c in range(3):
            depth -= (centre[c] - walls.point[w, c]) * walls.normal[w, c]
        hides = depth > radius
        for e in range(walls.first[w], walls.first[w + 1]):
            if not hides:
                break
            inside = 0.0
            for c in range(3):
                inside += (centre[c] - walls.edge[e, c]) * walls.inward[e, c]
            hides = inside > radius
        if hides:
            return True
    return False


@njit(cache=True, forceinline=True, uncounted=True)
def _eclipsed(centre, radius, body, image, far, spheres):  # type: ignore[no-untyped-def]
    """Tell whether a sphere lies wholly in the shadow of a sphere inside another body: within its cone or, from far,
    cylinder, and behind where rays enter it."""
    for w in range(len(spheres.body)):
        size = spheres.radius[w]
        if spheres.body[w] == body or (far and radius >= size):
            continue
        along, here, there = 0.0, 0.0, 0.0
        for c in range(3):
            a = spheres.centre[w, c] - (centre[c] if far else image[c])
            b = image[c] if far else centre[c] - image[c]
            along, here, there = along + a * b, here + a * a, there + b * b
        if far:
            # The image is the direction towards the end: a sphere nearer to it lies higher.
            if along > radius and here - along * along < (size - radius) ** 2:
                return True
            continue
        # Rays enter the sphere nearer than where they touch it.
        rim, apart = here - size * size, math.sqrt(there)
        if rim <= 0.0 or apart <= radius or (apart - radius) ** 2 <= rim:
            continue
        off = math.acos(min(max(along / math.sqrt(here * there), -1.0), 1.0))
        if off + _half_width(radius, apart) < _half_width(size, math.sqrt(here)) - _ROUNDING:
            return True
    return False


@njit(cache=True, nogil=True, uncounted=True)
def _may_be_lit(clusters, source, walls, spheres, out):  # type: ignore[no-untyped-def]
    """Write which clusters (k,) may hold a facet that the source lights; named tuples as their types say."""
    image, far = source.image, source.far
    for i in range(len(clusters.radius)):
        if not clusters.wanted[i]:
            continue
        centre, radius = clusters.centre[i], clusters.radius[i]
        if _depth(centre, source) < -radius - _BESIDE:
            continue
        swell = 1.001 * radius + walls.touch
        if _behind_wall(centre, swell, clusters.body[i], walls):
            continue
        out[i] = not _eclipsed(centre, swell, clusters.body[i], image, far, spheres)


@njit(cache=True, nogil=True)
def _lit_facets(clusters, order, first, v, n, area, is_open, image, far):  # type: ignore[no-untyped-def]
    """Return the facets of clusters that face the image at one corner or more, or are lit from both sides, in no
    order."""
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
