"""Patches of rough surfaces that the radar sees: where diffuse scattering starts.

The ground is cut into sectors of rings about the foot of the radar, rings of half a range cell; other bodies into their
facets, and these into triangles of half a range cell. One ray tells whether the middle of a patch is seen.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.geometry.patches import Patches
from raychan.records import MIRROR
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

_MOST = 400_000  # patches of a body: beyond, they grow; each takes a ray and some 300 bytes (not measured)
_TOUCH = 1e-3  # of the distance: a hit this near the middle of a patch is the patch


@dataclass(frozen=True)
class PatchSize:
    """How large patches may be: along the range [m], across it [rad], and how far away they may be [m]."""

    range: float
    angle: float
    farthest: float


def visible_patches(geometry: Geometry, end: Floats, materials: Bools, size: PatchSize) -> Patches:
    """Return the patches of materials (m,) that scatter diffusely which a point (3,) [m] sees."""
    f = geometry.facets
    rough = materials[f.material] & (geometry.area > 0.0) if len(f.material) else np.zeros(0, bool)
    ground = rough & (f.role[f.body] == MIRROR)
    parts = [_rings(geometry, end, body, size) for body in np.unique(f.body[ground])]
    parts.append(_triangles(geometry, end, np.flatnonzero(rough & ~ground), size))
    found = Patches(*(np.concatenate(x) for x in zip(*((p.point, p.facet, p.area) for p in parts), strict=True)))
    return _seen(geometry, end, found)


def _rings(geometry: Geometry, end: Floats, body: int, size: PatchSize) -> Patches:
    """Return sectors of rings on the plane of a ground body, about the foot of `end`."""
    f = geometry.facets
    rows = np.flatnonzero(f.body == body)
    normal, first = geometry.normal[rows[0]], f.vertices[rows[0], 0]
    height = abs(float((end - first) @ normal))
    foot = end - ((end - first) @ normal) * normal
    reach = float(np.linalg.norm(f.vertices[rows] - foot, axis=2).max())
    farthest = min(size.farthest, float(np.hypot(reach, height)))
    sectors = max(int(np.ceil(2.0 * np.pi / size.angle)), 8)
    rings = min(int(np.ceil(max(farthest - height, 0.0) / size.range)), max(_MOST // sectors, 1))
    if rings == 0:
        return Patches(np.zeros((0, 3)), np.zeros(0, np.int64), np.zeros(0))
    edges = np.sqrt(np.maximum(np.linspace(height, farthest, rings + 1) ** 2 - height**2, 0.0))
    # The middle of area: half of a ring lies on either side.
    radius = np.sqrt(0.5 * (edges[1:] ** 2 + edges[:-1] ** 2))
    angle = 2.0 * np.pi * (np.arange(sectors) + 0.5) / sectors
    along = np.eye(3)[np.argmin(np.abs(normal))]
    x = along - (along @ normal) * normal
    x /= np.linalg.norm(x)
    y = np.cross(normal, x)
    point = foot + np.einsum("i,jk->ijk", radius, np.outer(np.cos(angle), x) + np.outer(np.sin(angle), y))
    area = np.repeat(np.pi / sectors * np.diff(edges**2), sectors)
    return Patches(point.reshape(-1, 3), np.full(len(area), rows[0], np.int64), area)


def _triangles(geometry: Geometry, end: Floats, rows: Ints, size: PatchSize) -> Patches:
    """Return triangles of facets (n,) that face `end` or are lit from both sides."""
    v = geometry.facets.vertices[rows]
    middle = v.mean(axis=1)
    faces = np.einsum("ij,ij->i", end - middle, geometry.normal[rows]) > 0.0
    near = np.linalg.norm(middle - end, axis=1) < size.farthest
    kept = (faces | geometry.both_sides[rows]) & near
    rows, v = rows[kept], v[kept]
    longest = np.linalg.norm(v - np.roll(v, 1, axis=1), axis=2).max(axis=1, initial=0.0)
    step = max(size.range, float(np.sqrt(geometry.area[rows].sum() / _MOST)))
    splits = np.maximum(np.ceil(longest / step), 1).astype(np.int64)
    point, facet, area = [np.zeros((0, 3))], [np.zeros(0, np.int64)], [np.zeros(0)]
    for n in np.unique(splits):
        some = np.flatnonzero(splits == n)
        bary = _middles(int(n))
        point.append(np.einsum("kc,ncx->nkx", bary, v[some]).reshape(-1, 3))
        facet.append(np.repeat(rows[some], len(bary)))
        area.append(np.repeat(geometry.area[rows[some]] / len(bary), len(bary)))
    return Patches(np.concatenate(point), np.concatenate(facet), np.concatenate(area))


def _middles(n: int) -> Floats:
    """Return the barycentric middles (n^2, 3) of a triangle cut into n^2 equal ones."""
    i, j = (x.ravel() for x in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    up, down = i + j < n, i + j < n - 1
    a = np.concatenate([i[up] + 1 / 3, i[down] + 2 / 3])
    b = np.concatenate([j[up] + 1 / 3, j[down] + 2 / 3])
    return np.column_stack([a, b, n - a - b]) / n


def _seen(geometry: Geometry, end: Floats, patches: Patches) -> Patches:
    """Return the patches whose middle a ray from `end` meets first, each with the facet that the ray meets."""
    way = patches.point - end
    distance = np.linalg.norm(way, axis=1)
    n = len(distance)
    if not n:
        return patches
    origin = np.broadcast_to(end, (n, 3))
    hit, at = geometry.cast(origin, way / distance[:, None], np.full(n, -1, np.int32))
    of = geometry.facets.body
    same = (hit >= 0) & (of[np.maximum(hit, 0)] == of[patches.facet])
    rows = np.flatnonzero(same & (np.abs(at - distance) < _TOUCH * distance))
    return Patches(patches.point[rows], hit[rows].astype(np.int64), patches.area[rows])
