"""Legs: one-way paths from an end of the link to a surface, straight or over plane mirrors (image method)."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import cached_property
from itertools import compress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.columns import row_numbers
from raychan.radar.beam_table import Beam
from raychan.records import BLOCKER, MIRROR, REFLECT, TRANSMIT
from raychan.tracing.cache import cache_of
from raychan.tracing.image_paths import may_leave, may_reach, mirror_points, rays_from, weights
from raychan.tracing.leg_rays import LegChain
from raychan.tracing.mirrors import Mirror
from raychan.tracing.tube_rays import ShadowRays, points_seen
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]
Stop = tuple[Floats, Floats, int, int]

_LEAST_AREA = 0.5  # m^2 of a mirror; at street distances smaller faces lie within a few Fresnel zones
_BEFORE = 1e-6  # m: what lies no farther before a mirror lies in its plane, or shares an edge with it: rounding
# Mirrors kept as seen from one end, and as many that face away: bounds the legs. Seconds of CPU with 24, 48, 64, 100:
# 40 boxes on ground at 3 bounces 1.6, 1.9, 2.0, 2.6, at 4 2.1, 3.6, 4.6, 5.3; 100 boxes 3.3, 3.8, 4.3, 4.8, and 4.3,
# 7.1, 10.3, 17.5 (no command).
_MOST = 48


@dataclass(frozen=True, eq=False)
class View:
    """How points are seen over a leg: `seen` (n,), mirror points `corners` (n, m, 3) [m], end's side first, layers
    `passed` (n, l) (see `leg_rays.follow_leg`), and the facet `blocker` (n,) that hides it, -1 for none."""

    seen: Bools
    corners: Floats
    passed: Ints
    blocker: Ints

    def take(self, index: NDArray[np.generic]) -> View:
        """Return how the points at `index` (mask or numbers) are seen."""
        rows = row_numbers(index)
        return View(*(getattr(self, f.name).take(rows, axis=0) for f in fields(View)))

    @staticmethod
    def of(rays: ShadowRays) -> View:
        """Return how the points of rays to centres are seen."""
        return View(rays.seen, rays.corners, rays.passed, rays.blocker)

    @staticmethod
    def join(parts: list[View]) -> View:
        """Return how the points of several views are seen as one."""
        return View(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(View)))


@dataclass(frozen=True, eq=False)
class Leg:
    """The one-way path between an end (a point, or a direction when `far`) and a surface, over mirrors, end's side
    first; `image` (3,) the end mirrored at all of them; `beam` of the end's antenna; `chain` what kernels follow."""

    end: Floats
    far: bool = False
    mirrors: tuple[Mirror, ...] = ()
    beam: Beam | None = None
    image: Floats = field(init=False)
    chain: LegChain = field(init=False, repr=False)
    _circles: tuple[Floats, Floats] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        images = [np.asarray(self.end, float)]
        for m in self.mirrors:
            images.append(m.image(images[-1]))
        object.__setattr__(self, "image", images[-1])
        at, normal, centre = (
            np.array([getattr(m, name) for m in self.mirrors]).reshape(-1, 3) for name in ("point", "normal", "centre")
        )
        low, high = (np.array([getattr(m, name) for m in self.mirrors]).reshape(-1, 2) for name in ("low", "high"))
        axes = np.array([m.axes for m in self.mirrors]).reshape(-1, 2, 3)
        facet = np.array([m.facet for m in self.mirrors], np.int64)
        chain = LegChain(np.array(images), at, normal, facet, low, high, axes, bool(self.far))
        object.__setattr__(self, "chain", chain)
        object.__setattr__(self, "_circles", (centre, np.array([m.radius for m in self.mirrors])))

    def pieces(self, geometry: Geometry) -> Ints:
        """Return the pieces (m,) of the mirrors."""
        return geometry.piece[[m.facet for m in self.mirrors]]

    def rays(self, points: Floats) -> tuple[Floats, Floats]:
        """Return unit directions (..., 3) at the points, travelling from the end, and lengths [m]."""
        k, length = rays_from(np.ascontiguousarray(points).reshape(-1, 3), self.image, self.far)
        return k.reshape(points.shape), length.reshape(points.shape[:-1])

    def spread(self, length: Floats) -> Floats:
        """Return the field's spreading [1/m] (1 for a plane wave)."""
        return np.ones_like(length) if self.far else 1.0 / length

    def weight(self, points: Floats) -> Floats:
        """Return the field (n,) that the end's antenna sends to points (n, 3) [m] over this leg, relative to its
        strongest."""
        found: Floats = weights(np.ascontiguousarray(points), *self.antenna)
        return found

    @property
    def antenna(self) -> tuple[Any, ...]:
        """What kernels need of the end's antenna: images, far, normals of the mirrors, table of its beam (empty:
        isotropic)."""
        return (
            self.chain.images,
            self.far,
            self.chain.normal,
            np.zeros((0, 0)) if self.beam is None else self.beam.table,
        )

    @property
    def gain_ends(self) -> Floats:
        """Normals (k, 3) of the planes through the image behind which the end's gain ends at once."""
        normals = np.zeros((0, 3)) if self.beam is None or self.far else self.beam.ends
        for m in self.mirrors:
            normals = normals - 2.0 * np.outer(normals @ m.normal, m.normal)
        return normals

    @cached_property
    def windows(self) -> Floats:
        """Normals (k, 3), inward, of the planes through the image and the sides of the rectangles about the mirrors:
        all rays over the mirrors run between them."""
        found = np.zeros((0, 3))
        for m in self.mirrors:
            found = found - 2.0 * np.outer(found @ m.normal, m.normal)
            to = m.corners - self.chain.images[1 + len(found) // 4]
            sides = np.cross(to, to[[1, 2, 3, 0]])
            sides *= np.sign(sides @ to.mean(axis=0))[:, None]
            found = np.concatenate([found, sides / np.linalg.norm(sides, axis=1)[:, None]])
        return found

    def outside_beam(self, points: Floats, radius: Floats) -> Bools:
        """Tell which spheres (n,), about points (n, 3) of this radius (n,) [m], lie outside the beam over this leg."""
        if self.beam is None or self.far:
            return np.zeros(len(points), bool)
        look, length = self._look(points)
        return self.beam.outside_beam(
            look, np.where(radius < length, np.arcsin(np.minimum(radius / length, 1.0)), np.pi)
        )

    def _look(self, points: Floats) -> tuple[Floats, Floats]:
        """Return the unit directions (n, 3) in which the end looks at points, and their distances (n,) [m]."""
        look, length = self.rays(points)
        for m in reversed(self.mirrors):
            look = look - 2.0 * np.outer(look @ m.normal, m.normal)
        return look, length

    def mirror_points(self, points: Floats) -> Floats:
        """Return the mirror points (n, m, 3) [m] on the way to each point (n, 3) [m], end's side first."""
        found: Floats = mirror_points(points, *self.chain[:3])
        return found

    def may_reach(self, points: Floats, size: Floats) -> Bools:
        """Tell which spheres about points (n, 3) of radius `size` (n,) [m] the leg may reach: in front of the last
        mirror, over the circle about each mirror."""
        ok: Bools = may_reach(points, size, *self.chain[:3], *self._circles)
        return ok

    def may_leave(self, points: Floats, rows: NDArray[np.signedinteger] | None = None) -> Bools:
        """Tell from which triangles of corners (n, 3 or more, 3) [m], or of these from which `rows` (k,), a ray may
        come to the end, and to which from it, over the rectangle about each mirror."""
        every = np.arange(len(points)) if rows is None else rows.astype(np.int64, copy=False)
        ok: Bools = may_leave(points, every, *self.edges_of_mirrors)
        return ok

    @property
    def edges_of_mirrors(self) -> tuple[Floats, ...]:
        """What kernels need to know of where rays over the mirrors run (see `image_paths.may_leave`)."""
        return *self.chain[:3], *self.chain[4:7], self.windows

    def visible(
        self, geometry: Geometry, points: Floats, facet: Ints, slack: Floats, layers: int, inside: Ints | None = None
    ) -> View:
        """Return which points the end sees over this leg, and through which layers.

        Args: points (n, 3) [m] on facets (n,); slack (n,) [m] by which the points' own smooth surface may lie before
        them; layers that each stretch may pass; inside (n,) bodies in which the points lie, which do not hide them.
        """
        return View.of(points_seen(geometry, self.chain, points, facet, slack, layers, inside))

    def stops(self, geometry: Geometry, view: View, row: int, point: Floats) -> list[Stop]:
        """Return the interactions on the way to a point (3,) [m], seen as row of a view, in order: place, normal (3,),
        facet, kind."""
        found, start, per = list[Stop](), self.end, view.passed.shape[1] // (len(self.mirrors) + 1)
        for i in range(len(self.mirrors) + 1):
            stop = view.corners[row, i] if i < len(self.mirrors) else point
            for f in view.passed[row, i * per : (i + 1) * per]:
                if f >= 0:
                    d = stop - start
                    t = geometry.distance(np.array([f]), start[None], d[None])[0]
                    found.append((start + t * d, geometry.normal[f], int(f), int(TRANSMIT)))
            if i < len(self.mirrors):
                found.append((stop, self.mirrors[i].normal, self.mirrors[i].facet, int(REFLECT)))
            start = stop
        return found


def planes_that_mirror(geometry: Geometry, end: Floats, away: bool = False) -> list[Mirror]:
    """Return the mirrors that `end` (3,) [m] lights: ground planes, and the plane faces of at least half a square metre
    that look largest from there. Smaller faces only scatter. Or those that face `away`, which only others light."""
    found: list[tuple[float, Mirror]] = []
    for facet, height, area in zip(*_large_faces(geometry, end, away), strict=True):
        mirror = Mirror.of(geometry, int(facet), 1.0 if height >= 0.0 or away else -1.0)
        ground = geometry.facets.role[geometry.facets.body[facet]] == MIRROR
        found.append((np.inf if ground else area * abs(height) / np.linalg.norm(end - mirror.centre) ** 3, mirror))
    found.sort(key=lambda pair: -pair[0])
    return [m for _, m in found[:_MOST]]


def mirrors_left_out(geometry: Geometry, end: Floats, bounces: int) -> tuple[int, int]:
    """Return how many faces large enough for a mirror no leg from `end` (3,) [m] over at most `bounces` mirrors leads
    over, as others look larger from there, and of how many."""
    every = [len(_large_faces(geometry, end, away)[0]) for away in (False, True)[:bounces]]
    return sum(max(n - _MOST, 0) for n in every), sum(every)


def _large_faces(geometry: Geometry, end: Floats, away: bool) -> tuple[Ints, Floats, Floats]:
    """Return the plane faces large enough for a mirror that look at `end` (3,) [m], or `away` from it: the largest
    facet of each (k,), how high [m] the end stands over it, and the area [m^2]."""
    f = geometry.facets
    usable = ~geometry.curved & (f.role[f.body] != BLOCKER)
    area = np.bincount(geometry.plane, weights=np.where(usable, geometry.area, 0.0))
    largest, large = np.full(len(area), -1, np.int32), area >= _LEAST_AREA
    rows = np.flatnonzero(large.take(geometry.plane))
    order = rows[np.argsort(geometry.area[rows], kind="stable")]
    largest[geometry.plane[order]] = order
    planes = np.flatnonzero(large)
    facet = largest[planes]
    height = np.einsum("ij,ij->i", end - geometry.first[facet], geometry.normal[facet])
    back = (height < 0.0) & ~geometry.both_sides[facet]
    some = back & (f.role[f.body[facet]] != MIRROR) if away else ~back
    return facet[some], height[some], area[planes][some]


def legs_over(geometry: Geometry, end: Floats, bounces: int, beam: Beam | None = None) -> list[Leg]:
    """Return the legs from `end` (3,) [m], whose antenna has a `beam`, over at most `bounces` mirrors, the direct one
    first."""
    direct = Leg(end=np.asarray(end, float), beam=beam)
    legs = [direct]
    if bounces < 1:
        return legs
    mirrors = planes_that_mirror(geometry, direct.end)
    if bounces > 1:
        mirrors = _both_sides(geometry, mirrors) + planes_that_mirror(geometry, direct.end, away=True)
    last = [direct]
    for _ in range(bounces):
        last = [more for leg in last for more in _longer(leg, mirrors)]
        legs += last
    return legs


def _both_sides(geometry: Geometry, mirrors: list[Mirror]) -> list[Mirror]:
    """Return the mirrors, and the backs of those that reflect on both sides: a second mirror may be met from behind."""
    backs = [m.turned() for m in mirrors if geometry.both_sides[m.facet]]
    return mirrors + [m for m in backs if geometry.facets.role[m.body] != MIRROR]


def _longer(leg: Leg, mirrors: list[Mirror]) -> list[Leg]:
    """Return the legs over one mirror more: one before which the image lies and that is not all behind the last one, to
    whose rectangle rays run over all others."""
    found = [m for m in mirrors if (leg.image - m.point) @ m.normal > 1e-9]
    if leg.mirrors:
        last = leg.mirrors[-1]
        found = [m for m in found if ((m.corners - last.point) @ last.normal).max() > _BEFORE]
    if leg.mirrors and found:
        halves = np.concatenate([m.corners[[[0, 1, 2], [0, 2, 3]]] for m in found])
        one, other = leg.may_leave(halves).reshape(-1, 2).T
        found = list(compress(found, one | other))
    return [Leg(end=leg.end, mirrors=(*leg.mirrors, m), beam=leg.beam) for m in found]


def reachable(geometry: Geometry, leg: Leg) -> Bools:
    """Return which pieces (p,) a leg can reach: in front of its last mirror, over the circle about each mirror."""

    def found() -> Bools:
        ok = np.ones(len(geometry.piece_role), bool)
        if leg.mirrors:
            ok = leg.may_reach(*geometry.piece_spheres)
            ok[leg.pieces(geometry)[-1]] = False
        return ok

    return cache_of(geometry).by_leg("reachable pieces", leg, found)
