"""Subdivision of tubes: bisected at an edge, or clipped along the line in which an edge of a body runs through them.

A tube is a triangle of corner rays, so its parts need no new casts: on the first surface their rays are computed anew,
later they are interpolated between the parent's corners.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.geometry.curved_patches import write_rays_on
from raychan.tracing.image_paths import ON_PLANE
from raychan.tracing.legs import Leg
from raychan.tracing.part_rays import (
    bisect_each,
    bisection_weights,
    clip_each,
    longest_edges,
    nonempty_parts,
    part_coordinates,
    part_rays,
)
from raychan.tracing.tube_rows import copy_history, copy_tubes, room_for_tubes
from raychan.tracing.tubes import Tubes
from raychan.vectors import distance, largest
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Rows = NDArray[np.signedinteger]


class Patches(NamedTuple):
    """What kernels need to compute rays to parts of facets anew: vertices, normals, edge_curvature (f, 3, 3) and
    both_sides (f,) of the facets; image (3,), far of the leg by which rays come."""

    vertices: Floats
    normals: Floats
    edge_curvature: Floats
    both_sides: NDArray[np.bool_]
    image: Floats
    far: bool


def patches_of(geometry: Geometry, leg: Leg) -> Patches:
    """Return the facets of a geometry, lit over a leg."""
    f = geometry.facets
    return Patches(f.vertices, f.normals, geometry.edge_curvature, geometry.both_sides, leg.image, leg.far)


def bisect(
    geometry: Geometry, leg: Leg, tubes: Tubes, rows: Rows, edge: Rows, first: bool, jitter: float = 0.0
) -> Tubes:
    """Return both halves of the tubes `rows` (m,), cut from the middle of edge 0, 1 or 2 (m,) to the opposite corner.

    Args: first whether they stand on their first surface; jitter share of the edge by which cuts lie off its middle.
    """
    if not len(rows):
        return tubes.take(rows)
    found = bisected(tubes.columns, rows, edge, patches_of(geometry, leg), first, jitter)
    return Tubes(*found, history=tubes.history)


def clipped(geometry: Geometry, leg: Leg, tubes: Tubes, side: Floats) -> Tubes:
    """Return the tubes, on their first surface, clipped where a height `side` (n, 3) [m] at their corners changes its
    sign."""
    across = (side.min(axis=1) < -ON_PLANE) & (side.max(axis=1) > ON_PLANE)
    if not across.any():
        return tubes
    parts, _ = subdivide(geometry, leg, tubes, np.flatnonzero(across), side, True, 0.0)
    return Tubes.join([tubes.take(~across), parts])


def as_if_straight(side: Floats, middle: Floats) -> Floats:
    """Return heights (n, 3) [m] at corners that, linear along edges, are zero where quadratic ones are.

    Args: side (n, 3), not all of a row of one sign, and middle (n, 3) [m]: at the corners, and halfway to the next.
    """
    one = np.where((side > 0.0).sum(axis=1, keepdims=True) == 1, side > 0.0, side <= 0.0)
    lone, row = one.argmax(axis=1), np.arange(len(side))
    found, here = side.copy(), side[row, lone]
    for other, between in (((lone + 1) % 3, lone), ((lone + 2) % 3, (lone + 2) % 3)):
        there, mid = side[row, other], middle[row, between]
        half, bend = 0.5 * (4.0 * mid - 3.0 * here - there), 2.0 * (here - 2.0 * mid + there)
        # Between heights of opposite signs there is one zero. Neither formula of a root subtracts like numbers.
        q = -(half + np.copysign(np.sqrt(np.maximum(half**2 - bend * here, 0.0)), half))
        with np.errstate(all="ignore"):
            zero = np.where((here / q > 0.0) & (here / q <= 1.0), here / q, q / bend)
        found[row, other] = here * (1.0 - 1.0 / np.clip(zero, 1e-9, 1.0))
    return found


def subdivide(
    geometry: Geometry, leg: Leg, tubes: Tubes, rows: Rows, side: Floats, first: bool, jitter: float
) -> tuple[Tubes, Rows]:
    """Clip the tubes `rows` (m,) along the edge that runs through them, or bisect them at their longest edge where none
    is known; return the parts, and the parent of each.

    Args: side (n, 3) of all tubes, signed distances [m] of the corners from that edge, zeros where none is known; first
    and jitter as for `bisect`.
    """
    if not len(rows):
        return tubes.take(rows), rows
    found, parent = subdivided(tubes.columns, rows, side, patches_of(geometry, leg), first, jitter)
    return Tubes(*found, history=tubes.history), parent


@njit(cache=True, nogil=True, error_model="numpy")
def bisected(tubes, rows, edge, patches, first, jitter):  # type: ignore[no-untyped-def]
    """Return what `bisect` does, as a tuple of columns."""
    n = len(rows)
    parent = np.empty(2 * n, np.int64)
    for i in range(2 * n):
        parent[i] = rows[i % n]
    return _parts(tubes, parent, bisection_weights(edge, jitter), patches, first)[0:]


@njit(cache=True, nogil=True, error_model="numpy")
def subdivided(tubes, rows, side, patches, first, jitter):  # type: ignore[no-untyped-def]
    """Return what `subdivide` does, as a tuple of columns, and the parents."""
    parts, parent, kept = parts_and_parents(tubes, rows, side, patches, first, jitter)
    if len(kept) == len(parent):
        return parts[0:], parent
    out, parents = room_for_tubes(len(kept), first), np.empty(len(kept), np.int64)
    copy_tubes(parts, kept, out, 0)
    for j in range(len(kept)):
        parents[j] = parent[kept[j]]
    return out[0:], parents


@njit(cache=True, nogil=True, error_model="numpy")
def parts_and_parents(tubes, rows, side, patches, first, jitter):  # type: ignore[no-untyped-def]
    """Return all parts that `subdivide` makes, as columns, the parent (m,) of each, and which (k,) have an area."""
    n, clipped = len(rows), 0
    for i in rows:
        clipped += 1 if side[i, 0] != 0.0 or side[i, 1] != 0.0 or side[i, 2] != 0.0 else 0
    halves = n - clipped
    parent = np.empty(2 * halves + 3 * clipped, np.int64)
    half, clip = 0, 2 * halves
    for i in rows:
        if side[i, 0] != 0.0 or side[i, 1] != 0.0 or side[i, 2] != 0.0:
            parent[clip] = parent[clip + clipped] = parent[clip + 2 * clipped] = i
            clip += 1
        else:
            parent[half] = parent[half + halves] = i
            half += 1
    weights = np.zeros((len(parent), 3, 3))
    bisect_each(longest_edges(tubes.points, parent[:halves]), jitter, weights[: 2 * halves])
    clip_each(side, parent[2 * halves : 2 * halves + clipped], weights[2 * halves :])
    parts = _parts(tubes, parent, weights, patches, first)
    return parts, parent, nonempty_parts(parts.points, 2 * halves)


@njit(cache=True, nogil=True, error_model="numpy")
def _parts(tubes, parent, weights, patches, first):  # type: ignore[no-untyped-def]
    """Return part tubes whose corner i is the mean of the parent's corners by weights[:, i] (m, 3, 3); parent (m,)."""
    out = room_for_tubes(len(parent), first)
    for j in range(len(parent)):
        i = parent[j]
        out.facet[j], out.spread[j] = tubes.facet[i], tubes.spread[i]
        copy_history(tubes, i, out, j)
    if not first:
        part_rays(
            weights,
            parent,
            tubes.points,
            tubes.k,
            tubes.length,
            tubes.normals,
            out.points,
            out.k,
            out.length,
            out.normals,
            np.empty(3),
        )
        return out
    v, normals, b, both_sides, image, far = patches
    part_coordinates(weights, parent, tubes.bary, out.bary)
    write_rays_on(
        out.facet, out.bary, v, normals, b, both_sides, image, far, out.points, out.k, out.length, out.normals
    )
    for j in range(len(parent)):
        out.spread[j] = 1.0 if far else 1.0 / out.length[j, 3]
    return out


@njit(cache=True, nogil=True)
def edge_of_spread(k, normals, facet, curved, fan):  # type: ignore[no-untyped-def]
    """Return the edge (n,) between whose corners the reflected rays of each tube spread most; -1 where they spread by
    no more than `fan` [rad], or the facet is not curved (f,)."""
    out, d = np.full(len(k), -1, np.int64), np.empty((3, 3))
    for i in range(len(k)):
        if curved[facet[i]]:
            for q in range(3):
                twice = 0.0
                for c in range(3):
                    twice += 2.0 * k[i, q, c] * normals[i, q, c]
                for c in range(3):
                    d[q, c] = k[i, q, c] - twice * normals[i, q, c]
            e0, e1, e2 = distance(d[0], d[1]), distance(d[1], d[2]), distance(d[2], d[0])
            if max(e0, e1, e2) > fan:
                out[i] = largest(e0, e1, e2)
    return out
