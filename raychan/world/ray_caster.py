"""Ray casting: triangle ids from Embree, everything else in float64 (see `geometry.intersect`).

Embree answers in float32, whose spacing at 200 m is 15 um: 0.05 rad two-way at 77 GHz. So only the triangle's id is
taken; the hit point is the float64 intersection with that triangle's plane. The world is shifted to the centre of the
facets before it is cast to float32, so a scene far from the origin gives the answer of one at the origin.
"""

from __future__ import annotations

import threading
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.geometry.embree_packet import own_packet
from raychan.geometry.intersect import EDGE, OFFSET, CastRays, FacetGroups, FacetShapes, plane_distances
from raychan.geometry.near_rays import first_within
from raychan.geometry.shadow_rays import MetFacets, ShadowSurfaces, ShadowTargets, follow_rays
from raychan.geometry.triangles import extents, planes_of
from raychan.parallel import cached, parallel_for
from raychan.records import LAYER, Facets
from raychan.world.backed_layers import backed
from raychan.world.static_geometry import StaticGeometry, columns, computed_once
from raychan.world.triangle_groups import Group, facet_groups

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

_MISS = np.int32(-1)
_PARALLEL_FROM = 2048  # rays from which on a second thread pays; not measured
_NO_LIMIT, _NO_BODY, _NO_BOOL = np.zeros(0), np.zeros(0, np.int64), np.zeros(0, bool)
_NO_FACET, _NO_LAYERS = np.zeros(0, np.int32), np.zeros((0, 0), np.int32)
# Of the size of a small scene, or of 1 m in a larger one:
_TOUCH = 2e-5  # surfaces nearer than this lie on each other
_NEAREST = 1e-6  # a hit closer than this is the surface the ray leaves


class RayCaster:
    """A set of facets that rays are cast at; counts the rays of each thread.

    Args: facets; static what is kept of bodies that do not move.
    """

    def __init__(self, facets: Facets, static: StaticGeometry | None = None) -> None:
        self.facets = facets
        v, n = facets.vertices, len(facets.vertices)
        self.first = np.ascontiguousarray(v[:, 0])
        self.normal, self.area = columns(static, "planes", lambda rows: planes_of(v[rows]))
        self.extents = _extents(facets, static)
        kind = facets.materials.kind
        self.is_layer = computed_once(
            static, "layer", lambda: kind[facets.material] == LAYER if n else np.zeros(0, bool)
        )
        self._counts, self._uncut = threading.local(), [0]
        # Without topology each facet is a plane and a smooth patch of its own.
        self.plane = self.smooth = computed_once(static, "apart", lambda: np.arange(n, dtype=np.int32))
        self._any_layer = bool(self.is_layer.any())
        # Whether facets never hide each other from a point that looks at their lit sides.
        self.hides_nothing = False
        # Held while a property is computed that serves all threads.
        self.making = threading.RLock()
        self.extent, self._size, self.touch, self._nearest = 0.0, 1.0, _TOUCH, _NEAREST
        self._groups: list[Group] = []
        if n:
            low, high = self.extents[:, 0].min(axis=0), self.extents[:, 1].max(axis=0)
            self._centre = 0.5 * (low + high)
            self.extent = float(np.linalg.norm(high - low))
            self._size = min(self.extent, 1.0)
            # Far from the origin coordinates themselves are only known to their float64 spacing.
            blur = 8.0 * float(np.spacing(np.maximum(-low, high).max()))
            self.touch, self._nearest = _TOUCH * self._size + blur, _NEAREST * self._size + blur
            self._groups = self._one_group() if static is None else self._groups_of(static)

    def _one_group(self) -> list[Group]:
        """Return all facets as one group, but for layers upon something opaque, which counts before them."""
        v = self.facets.vertices
        upon = backed(v - self._centre, self.normal, self.area, self.is_layer, self.touch)
        if not upon.any():
            return [Group(lambda: v, self.extents, np.arange(len(v), dtype=np.int32))]
        rest, thin = (np.flatnonzero(x).astype(np.int32) for x in (~upon, upon))
        return [
            Group(lambda: v[rest], self.extents, rest),
            Group(lambda: v[thin], self.extents, thin, behind=self.touch).facet_by_facet(v[thin]),
        ]

    def _groups_of(self, static: StaticGeometry) -> list[Group]:
        """Return a group of what does not move, one of each large body that moves, and one of all small ones."""
        v, extents = self.facets.vertices, self.extents
        groups = []
        if len(static.rest):
            there = np.delete(extents, static.moving, 0)
            groups.append(static.computed_once("group", lambda: Group(lambda: v[static.rest], there, static.rest)))
        for r in static.instances:
            low, high = r.mesh.bounds
            one = partial(Group, lambda m=r.mesh: m.corners, np.array([[low, high]]), r.rows)
            groups.append(static.computed_once(f"group {r.body}", one).posed(r.turn, r.origin))
        if len(static.small):
            groups.append(Group(lambda: v[static.small_rows], extents[static.small], static.small_rows))
        return groups

    @property
    def rays(self) -> int:
        """Rays cast so far by this thread."""
        return int(getattr(self._counts, "rays", 0))

    @property
    def uncut(self) -> int:
        """Tubes that budgets kept from being subdivided so far, over all launches."""
        return self._uncut[0]

    def count_uncut(self, tubes: int) -> None:
        """Count tubes that a budget kept from being subdivided."""
        self._uncut[0] += tubes

    def count_rays(self, rays: int) -> None:
        """Count rays as cast by this thread."""
        self._counts.rays = self.rays + rays

    def distance(self, facet: Ints, origin: Floats, direction: Floats) -> Floats:
        """Return the distance (n,) [m] along each ray to the plane of its facet (n,), inf when parallel."""
        found: Floats = plane_distances(facet, origin, direction, self.first, self.normal)
        return found

    @cached
    def _facet_groups(self) -> FacetGroups:
        """The groups as compiled code reads them."""
        return facet_groups(self._groups)

    @cached
    def _shapes(self) -> FacetShapes:
        """The facets for rays."""
        return FacetShapes(self.facets.vertices, self.first, self.normal, self._size, self._nearest)

    @property
    def ray_targets(self) -> tuple[FacetGroups, FacetShapes]:
        """What compiled code casts rays at (see `geometry.intersect.first_hit`)."""
        return self._facet_groups, self._shapes

    @cached
    def _surfaces(self) -> ShadowSurfaces:
        """The facets for shadow rays."""
        layer = self.is_layer if self._any_layer else _NO_BOOL
        margin = EDGE * OFFSET * self._size
        f = self.facets
        return ShadowSurfaces(
            f.vertices, self.normal, self.plane, self.smooth, np.asarray(f.body, np.int32), layer, self.touch, margin
        )

    @cached
    def met_by_rays(self) -> tuple[FacetGroups, FacetShapes, ShadowSurfaces, bool]:
        """The facets as kernels read them that cast rays themselves, and whether facets hide nothing."""
        return self._facet_groups, self._shapes, self._surfaces, self.hides_nothing

    def _follow(self, rays: CastRays, targets: ShadowTargets, met: MetFacets) -> None:
        """Write what rays meet, on all threads; count them."""
        fixed = self._facet_groups, self._shapes, self._surfaces
        casts = []

        def some(rows: slice) -> None:
            part: list[Any] = [type(x)(*(column[rows] for column in x)) for x in (rays, targets, met)]  # type: ignore
            casts.append(follow_rays(part[0], part[1], *fixed, own_packet(), part[2]))

        parallel_for(len(rays.origin), some, _PARALLEL_FROM)
        self.count_rays(sum(casts))

    def cast(self, origin: Floats, direction: Floats, skip: Ints, start: Floats | None = None) -> tuple[Ints, Floats]:
        """Return the first facet (-1: none) hit by each ray and its distance [m].

        Args: origin (n, 3) [m], direction (n, 3) unit, skip (n,) facet that the ray leaves and cannot
        hit (-1: none), start (n,) distance [m] from which hits count.
        """
        n = len(origin)
        facet, distance = np.full(n, _MISS, np.int32), np.full(n, np.inf)
        if not len(self.first) or n == 0:
            return facet, distance
        met = MetFacets(facet, distance, _NO_BOOL, _NO_LAYERS, _NO_FACET)
        at_nothing = ShadowTargets(_NO_LIMIT, _NO_LIMIT, _NO_FACET, _NO_BODY)
        self._follow(_rays(origin, direction, skip, start), at_nothing, met)
        return facet, distance

    def within(self, origin: Floats, direction: Floats, own: Ints, reach: float) -> Ints:
        """Return the first facet (n,; -1: none) that each ray meets within a reach [m]; no facet may be a layer.

        Args: origin (n, 3) [m], direction (n, 3) unit, own (n,) facet that each leaves and cannot meet.
        """
        found, fixed = np.full(len(origin), _MISS, np.int32), (reach, self._facet_groups, self._shapes)

        def some(r: slice) -> None:
            first_within(origin[r], direction[r], own[r], *fixed, own_packet(), found[r])

        parallel_for(len(origin), some, _PARALLEL_FROM)
        return found

    def walk(
        self,
        origin: Floats,
        direction: Floats,
        limit: Floats,
        slack: Floats,
        skip: Ints,
        target: Ints,
        layers: int,
        inside: Ints | None = None,
    ) -> tuple[NDArray[np.bool_], Ints, Ints]:
        """Follow shadow rays through thin layers to their targets.

        Args: origin (n, 3) [m], direction (n, 3) unit; limit (n,) [m] distance of the target; slack (n,) [m] by which
        the target's own smooth surface may lie before it; skip (n,) facet that the ray leaves; target (n,) facet aimed
        at, which never blocks, -1 for none; layers that a ray may pass; inside (n,) body in which the target lies,
        which never blocks, -1 for none.
        Returns: reached (n,) bool; passed (n, layers) facets in order, -1 unused; blocker (n,) the facet in the way, -1
        for none.
        """
        n = len(origin)
        reached, blocker, passed = np.zeros(n, bool), np.full(n, _MISS), np.full((n, layers), _MISS)
        if n and self.hides_nothing:
            # A facet that faces the ray's start is then seen from there; each such point still counts as a ray.
            towards = np.einsum("ij,ij->i", direction, self.normal[target]) < 0.0
            reached = towards & (target >= 0) & (skip < 0)
            self.count_rays(int(np.count_nonzero(reached)))
        if not len(self.first):
            return np.ones(n, bool), passed, blocker
        body = _NO_BODY if inside is None else np.ascontiguousarray(inside, np.int64)
        targets = ShadowTargets(_floats(limit), _floats(slack), _int32(target), body)
        met = MetFacets(_NO_FACET, _NO_LIMIT, reached, passed, blocker)
        if n and not reached.all():
            self._follow(_rays(origin, direction, skip, None), targets, met)
        return reached, passed, blocker


def _floats(x: NDArray[Any]) -> Floats:
    # Kernels are compiled for contiguous arrays only.
    return np.ascontiguousarray(x, float)


def _int32(x: NDArray[Any]) -> Ints:
    return np.ascontiguousarray(x, np.int32)


def _rays(origin: Floats, direction: Floats, skip: Ints, start: Floats | None) -> CastRays:
    """Return rays as kernels read them."""
    return CastRays(_floats(origin), _floats(direction), _int32(skip), _NO_LIMIT if start is None else _floats(start))


def _extents(facets: Facets, static: StaticGeometry | None) -> Floats:
    """Return the lowest and highest corner (b, 2, 3) [m] of each body."""
    count = len(facets.role)
    shared = static if static is not None and static.shares else None
    found: Floats = computed_once(shared, "extents", lambda: extents(facets.vertices, facets.body, count))
    if shared is not None:
        moved = extents(facets.vertices[shared.rows], facets.body[shared.rows], count)
        found = found.copy()
        found[shared.moving] = moved[shared.moving]
    return found
