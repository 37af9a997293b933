"""Patches of rough surfaces that the radar sees: where diffuse scattering starts.

The ground is cut into sectors of rings about the foot of the radar, rings of half a range cell; other bodies into their
facets, and these into triangles of half a range cell. Near the radar both are finer: over a plane the law of scattering
changes with the range alone. One ray tells whether the middle of a patch is seen.
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
    """How large patches may be: along the range [m], across it [rad], how far away they may be [m], and which share of
    their distance they may extend along the range."""

    range: float
    angle: float
    farthest: float
    share: float

    @property
    def nearest(self) -> float:
        """Distance [m] within which patches become no finer: so near a radar stands on its surface."""
        return self.share * self.range


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
    if farthest <= height:
        return Patches(np.zeros((0, 3)), np.zeros(0, np.int64), np.zeros(0))
    edges = np.sqrt(np.maximum(_ranges(height, farthest, size, max(_MOST // sectors, 1)) ** 2 - height**2, 0.0))
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


def _ranges(height: float, farthest: float, size: PatchSize, most: int) -> Floats:
    """Return the distances [m] of the edges of at most so many rings: each a share of its distance wide, and at most
    `size.range`."""
    start = min(max(height, size.nearest), farthest)
    turn = min(max(size.range / size.share, start), farthest)
    finer = np.log(turn / start) / size.share
    count = finer + (farthest - turn) / size.range
    at = np.linspace(0.0, count, min(int(np.ceil(count)), most) + 1)
    edges = np.where(at < finer, start * np.exp(size.share * at), turn + (at - finer) * size.range)
    edges[0] = height
    return edges


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
    corners, facet, area = [np.zeros((0, 3, 3))], [np.zeros(0, np.int64)], [np.zeros(0)]
    for n in np.unique(splits):
        some = np.flatnonzero(splits == n)
        corners.append(_cut(v[some], int(n)))
        facet.append(np.repeat(rows[some], n**2))
        area.append(np.repeat(geometry.area[rows[some]] / n**2, n**2))
    return _finer(np.concatenate(corners), np.concatenate(facet), np.concatenate(area), end, size)


def _finer(corners: Floats, facet: Ints, area: Floats, end: Floats, size: PatchSize) -> Patches:
    """Return triangles of corners (n, 3, 3) as patches, cut into four as long as they extend over more than a share of
    their distance along the range, and are not too many."""
    done, count = [], len(corners)
    while True:
        middle = corners.mean(axis=1)
        away = np.linalg.norm(np.concatenate([corners, middle[:, None]], axis=1) - end, axis=2)
        wide = np.ptp(away, axis=1) > size.share * np.maximum(away[:, 3], size.nearest)
        count += 3 * int(wide.sum())
        wide &= count <= _MOST
        done.append(Patches(middle[~wide], facet[~wide], area[~wide]))
        if not wide.any():
            return Patches(*(np.concatenate(x) for x in zip(*((p.point, p.facet, p.area) for p in done), strict=True)))
        corners, facet, area = _cut(corners[wide], 2), np.repeat(facet[wide], 4), np.repeat(0.25 * area[wide], 4)


def _cut(corners: Floats, n: int) -> Floats:
    """Return the corners (m n^2, 3, 3) of triangles (m, 3, 3) cut into n^2 equal ones each."""
    i, j = (x.ravel() for x in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    at = np.stack([i, j], axis=1)[:, None]
    up, down = at + np.array([[0, 0], [1, 0], [0, 1]]), at + np.array([[1, 1], [0, 1], [1, 0]])
    at = np.concatenate([up[i + j < n], down[i + j < n - 1]])
    bary = np.concatenate([at, n - at.sum(axis=2, keepdims=True)], axis=2) / n
    return np.einsum("kjc,mcx->mkjx", bary, corners).reshape(-1, 3, 3)


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
