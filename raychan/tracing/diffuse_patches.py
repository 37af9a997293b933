"""Patches of rough surfaces that the radar sees: where diffuse scattering starts.

The ground is cut into sectors of rings about the foot of the radar, rings of half a range cell; facets of other bodies
that are larger into wedges about its foot on their planes, halved down to half a range cell along the range and to an
angle across it. Near the radar both are finer: over a plane the law of scattering changes with the range alone. Both
are halved on as long as a radar tells their ends apart by rate, by its array, or by the gain of its antenna. One ray
tells whether the middle of a patch is seen.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from raychan.geometry.patches import Patches
from raychan.poses import sizes
from raychan.records import MIRROR, Facets
from raychan.tracing.pieces import Pieces, Sectors
from raychan.tracing.wedges import wedges
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
Lines = tuple[Floats, Floats, Floats]
"""Starts, middles and ends (n, k, 3) [m] of the lines along which pieces may be halved."""
Excess = Callable[[Lines, Ints], Floats]

_MOST = 400_000  # patches of a body: beyond, they grow; each takes a ray and some 300 bytes (not measured)
_GROWTH = np.sqrt(2.0)  # of their sides, until there are no more: about half as many at a time
_TOUCH = 1e-3  # of the distance: a hit this near the middle of a patch is the patch

_NONE = Patches(np.zeros((0, 3)), np.zeros(0, np.int64), np.zeros(0))


@dataclass(frozen=True)
class Apart:
    """What a radar tells apart, of which a patch may extend over at most so much.

    Args: axes (3, 3) of the antenna, to the world; velocity (3,) [m/s] of the radar; rate [m/s], range rates; cosines
    (3,) of the direction along the antenna's axes, by the array; beam (2,) [rad] of the direction along theta and phi
    of the antenna, by its gain. Infinite where it tells nothing.
    """

    axes: Floats
    velocity: Floats
    rate: float
    cosines: Floats
    beam: Floats


@dataclass(frozen=True)
class PatchSize:
    """How large patches may be: along the range [m], across it (on the ground, about the foot of the radar) [rad], how
    far away they may be [m], which share of their distance they may extend along the range, and over how much of what a
    radar tells apart."""

    range: float
    angle: float
    farthest: float
    share: float
    apart: Apart | None = None

    @property
    def nearest(self) -> float:
        """Distance [m] within which patches become no finer: so near a radar stands on its surface."""
        return self.share * self.range


def visible_patches(geometry: Geometry, end: Floats, materials: Bools, size: PatchSize) -> Patches:
    """Return the patches of materials (m,) that scatter diffusely which a point (3,) [m] sees."""
    f = geometry.facets
    rough = materials[f.material] & (geometry.area > 0.0) if len(f.material) else np.zeros(0, bool)
    ground = rough & (f.role[f.body] == MIRROR)
    parts = [_sectors(geometry, end, body, size) for body in np.unique(f.body[ground])]
    parts.append(_facets(geometry, end, np.flatnonzero(rough & ~ground), size))
    return _seen(geometry, end, _joined(parts))


def _sectors(geometry: Geometry, end: Floats, body: int, size: PatchSize) -> Patches:
    """Return sectors of rings on the plane of a ground body, about the foot of `end`."""
    f = geometry.facets
    rows = np.flatnonzero(f.body == body)
    normal, first = geometry.normal[rows[0]], f.vertices[rows[0], 0]
    height = abs(float((end - first) @ normal))
    foot = end - ((end - first) @ normal) * normal
    reach = float(np.linalg.norm(f.vertices[rows] - foot, axis=2).max())
    farthest = min(size.farthest, float(np.hypot(reach, height)))
    count = max(int(np.ceil(2.0 * np.pi / size.angle)), 8)
    if farthest <= height:
        return _NONE
    edges = _ranges(height, farthest, size, max(_MOST // count, 1))
    squares = np.maximum(edges**2 - height**2, 0.0)
    angles = np.linspace(0.0, 2.0 * np.pi, count + 1)
    ring, turn = (np.stack([x[:-1], x[1:]], axis=1) for x in (squares, angles))
    along = np.eye(3)[np.argmin(np.abs(normal))]
    x = along - (along @ normal) * normal
    x /= np.linalg.norm(x)
    bounds = np.stack([np.repeat(ring, count, axis=0), np.tile(turn, (len(ring), 1))], axis=1)
    sectors = Sectors(bounds, np.stack([foot, x, np.cross(normal, x)]))
    facet = np.full(len(bounds), rows[0], np.int64)
    found = _small(sectors, facet, end, farthest, lambda lines, on: _spread(lines, on, f, end, size))
    return replace(found, grown=max(found.grown, float(np.diff(edges).max()) / size.range))


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


def _facets(geometry: Geometry, end: Floats, rows: Ints, size: PatchSize) -> Patches:
    """Return patches of facets (n,) that face `end` or are lit from both sides: the facets that are small enough, and
    pieces of the others."""
    f, corners = geometry.facets, geometry.facets.vertices[rows].astype(float)
    faces = np.einsum("ij,ij->i", end - corners[:, 0], geometry.normal[rows]) > 0.0
    kept = faces | geometry.both_sides[rows]
    corners, rows = corners[kept], rows[kept]

    def excess(lines: Lines, on: Ints) -> Floats:
        away = [sizes(at - end) for at in lines]
        middle, farther = (np.maximum(x, size.nearest) for x in (away[1], np.maximum(away[0], away[2])))
        along = _between(away) / np.minimum(size.share * middle, size.range)
        squared = ((lines[2] - lines[0]) ** 2).sum(axis=-1) - (away[2] - away[0]) ** 2
        across = np.sqrt(np.maximum(squared, 0.0)) / (size.angle * farther)
        return np.maximum(np.maximum(along, across), _spread(lines, on, f, end, size))

    def large(starts: Floats, stops: Floats, on: Ints) -> Bools:
        return np.asarray(excess((starts, 0.5 * (starts + stops), stops), on).max(axis=1) > 1.0)

    cut = large(corners, np.roll(corners, -1, axis=1), rows)
    middle = corners[~cut].mean(axis=1)
    whole = Patches(middle, rows[~cut], geometry.area[rows[~cut]]).take(sizes(middle - end) < size.farthest)
    rows = rows[cut]
    pieces, of = wedges(
        corners[cut], end, size.angle, lambda quads, on: large(quads[:, :, 0], quads[:, :, 1], rows[on])
    )
    return _joined([whole, _small(pieces, rows[of], end, size.farthest, excess)])


def _spread(lines: Lines, facet: Ints, facets: Facets, end: Floats, size: PatchSize) -> Floats:
    """Return over how many times what the radar tells apart lines (n, k) on facets (n,) extend, (n, k)."""
    told = size.apart
    if told is None:
        return np.zeros(lines[0].shape[:2])
    body, rates, looks = facets.body[facet, None], [], []
    moves, spin, origin = facets.velocity[body] - told.velocity, facets.spin[body], facets.origin[body]
    for at in lines:
        way = at - end
        # Directions within `nearest` count for less, so that halving ends where the radar touches the surface.
        look = way / np.maximum(sizes(way), size.nearest)[..., None]
        there = moves + np.cross(spin, at - origin) if spin.any() else np.broadcast_to(moves, look.shape)
        rates.append(np.einsum("nkc,nkc->nk", there, look))
        looks.append(np.einsum("nkc,cd->nkd", look, told.axes))
    changed, (x, y, _) = looks[2] - looks[0], np.moveaxis(looks[1], -1, 0)
    turned = np.abs(x * changed[..., 1] - y * changed[..., 0]) / np.maximum(np.hypot(x, y), 1e-9)
    raised = np.sqrt(np.maximum(np.einsum("nkc,nkc->nk", changed, changed) - turned**2, 0.0))
    gain = np.hypot(raised / told.beam[0], turned / told.beam[1])
    array = (np.abs(changed[..., c]) / told.cosines[c] for c in range(3))
    return reduce(np.maximum, array, np.maximum(_between(rates) / told.rate, gain))


def _between(three: Sequence[Floats]) -> Floats:
    """Return by how much three values (n, k) differ at most."""
    return np.asarray(reduce(np.maximum, three) - reduce(np.minimum, three))


def _small(pieces: Pieces, facet: Ints, end: Floats, farthest: float, excess: Excess) -> Patches:
    """Return pieces as patches no farther away than so far, halved until none is too large, or larger than that by a
    factor if they were too many."""
    grown = 1.0
    while (found := _halved(pieces, facet, end, farthest, excess, grown)) is None:
        grown *= _GROWTH
    return found


def _halved(pieces: Pieces, facet: Ints, end: Floats, farthest: float, excess: Excess, grown: float) -> Patches | None:
    """Return pieces halved along the axis over which they are largest, until none is larger than `grown` times its
    size; None if they become too many. Args: as for `_small`."""
    done, count, most = [_NONE], 0, max(_MOST, len(facet))
    while len(facet):
        middle, axes = pieces.middle, pieces.axes
        away = sizes(middle - end)
        start, stop = axes[:, :, 0], axes[:, :, 1]
        over = excess((start, 0.5 * (start + stop), stop), facet)
        axis = over.argmax(axis=1)
        large = over[np.arange(len(axis)), axis] > grown
        # What lies beyond in part is halved until its middle tells.
        reach = np.zeros(len(away))
        reach[large] = sizes(axes[large] - middle[large, None, None]).max(axis=(1, 2))
        near = away < farthest + reach
        small, rows = np.flatnonzero(near & ~large), np.flatnonzero(near & large)
        done.append(Patches(middle[small], facet[small], pieces.area[small], grown))
        count += len(small)
        if count + 2 * len(rows) > most:
            return None
        pieces, facet = pieces.take(rows).halved(axis[rows]), np.tile(facet[rows], 2)
    return _joined(done)


def _joined(parts: Sequence[Patches]) -> Patches:
    """Return the patches of all parts, of which there is one at least."""
    point, facet, area = (np.concatenate(x) for x in zip(*((p.point, p.facet, p.area) for p in parts), strict=True))
    return Patches(point, facet, area, max(p.grown for p in parts))


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
    return replace(patches.take(rows), facet=hit[rows].astype(np.int64))
