"""What a tube must know of the surfaces: planes, smooth patches, closed bodies, and the true surface behind facets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from raychan.em.fresnel import coefficients_array
from raychan.geometry.silhouettes import turning
from raychan.geometry.triangles import edge_curvatures, ends, extents, hulls
from raychan.parallel import cached
from raychan.records import MIRROR, PEC, Facets
from raychan.world.inner_spheres import closed_pieces, inner_spheres_of
from raychan.world.ray_caster import RayCaster
from raychan.world.scene_topology import SceneTopology
from raychan.world.static_geometry import StaticGeometry, columns, lasting
from raychan.world.topology import MeshTopology, joined, places

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

Balls = tuple[Floats, Floats, Ints]

_METAL = 1e3  # relative permittivity from which a surface returns nearly all


class Geometry(RayCaster):
    """A tracer that also knows which facets share a plane or a smooth patch, and the curved surface through corner
    normals.

    Args: facets; joints of each body's facets, bodies one after the other, and balls inside bodies, centre (k, 3) [m],
    radius (k,) [m], body (k,); both found anew if not given; still what is kept of bodies that do not move.
    """

    def __init__(
        self,
        facets: Facets,
        topology: Sequence[MeshTopology] = (),
        inner_spheres: Balls | None = None,
        still: StaticGeometry | None = None,
    ) -> None:
        super().__init__(facets, still)
        v, n, m = facets.vertices, facets.normals, facets.materials
        self._still, self._cores = still, inner_spheres
        poor = (m.kind != PEC) & (np.abs(m.eps) < _METAL)
        self.dull = lasting(still, "dull", lambda: poor[facets.material])
        self.matter = facets.material, (m.kind, m.eps, m.thickness, m.roughness)
        self.edge_curvature, self.curved = columns(still, "bulges", lambda rows: edge_curvatures(v[rows], n[rows]))
        self.uncut = 0  # tubes that budgets kept from being cut, over all launches
        # What others made of all this, once.
        self.between: Any = None
        self.screens: Any = None
        # What was found out about a leg, once.
        self.shadows: dict[Any, Any] = {}
        self.reach: WeakKeyDictionary[Any, Any] = WeakKeyDictionary()
        self.scene_topology = lasting(
            still, "fabric", lambda: SceneTopology(facets, topology or ([self._joints()] if len(v) else []))
        )
        self.plane, self.smooth = self.scene_topology.plane, self.scene_topology.smooth
        self.both_sides, self.piece = self.scene_topology.both_sides, self.scene_topology.piece
        self.convex_alone, self.hides_nothing = self.scene_topology.convex_alone, self.scene_topology.hides_nothing

    def _joints(self) -> MeshTopology:
        """Return how all facets hang together; those of different bodies never do."""
        f = self.facets
        vertex = places((f.vertices - self._centre).reshape(-1, 3), np.repeat(f.body, 3)).reshape(-1, 3)
        kind = f.part * np.int64(len(f.materials.kind)) + f.material
        return joined(vertex, kind, f.vertices, f.normals, f.body)

    def ends(self, half: Ints) -> Floats:
        """Return both ends (e, 2, 3) [m] of half edges."""
        found: Floats = ends(self.facets.vertices, np.ascontiguousarray(half, np.int64))
        return found

    @cached
    def outline(self) -> Floats:
        """Edges (e, 2, 3) [m] around the planes, not those shared within one or a smooth patch: of plane p those of
        `outline[first_edge[p] : first_edge[p + 1]]`."""
        return self.ends(self.scene_topology.outlines[0])

    @property
    def first_edge(self) -> NDArray[np.int64]:
        """See `outline`."""
        return self.scene_topology.outlines[1]

    @property
    def outline_facet(self) -> Ints:
        """Facets (e,) to which the edges of `outline` belong."""
        return self.scene_topology.outlines[0] // 3

    @cached
    def edge_ends(self) -> Floats:
        """Ends (e, 2, 3) [m] of every edge that can be a body's outline. Hollow edges hide nothing; between coplanar
        facets none is seen. Where a pane meets its frame, the frame ends as at a rim."""
        return self.ends(self.scene_topology.silhouettes[0])

    @property
    def edge_faces(self) -> Ints:
        """Facets (e, 2) on both sides of `edge_ends`, -1 beyond a rim."""
        return self.scene_topology.silhouettes[1]

    def turning(self, image: Floats, far: bool) -> tuple[Ints, Ints]:
        """Return the edges at which bodies turn away from a place (3,) [m], or from a direction when far, and the rims
        of open sheets: their half edges (e,) and the facets (e, 2) on both sides, -1 beyond a rim."""
        half, faces = self.scene_topology.silhouettes
        if not len(half):
            return half, faces
        c = self.clusters
        seen = c.centre, c.radius, c.axis, c.spread, self.first, self.normal, np.asarray(image, float), far
        found = np.sort(turning(*(*self.scene_topology.outlining, *seen)))
        return half[found], faces[found]

    @cached
    def wedge_facet(self) -> Ints:
        """Faces 0 and n (w, 2) of convex edges; the rims of open sheets are half planes."""
        rim = self.scene_topology.halves("rim") // 3
        return np.concatenate([self.scene_topology.halves("pair", "sharp") // 3, np.stack([rim, rim], axis=1)]).astype(
            np.int32
        )

    @cached
    def wedge(self) -> Floats:
        """Ends (w, 2, 3) [m] of the edges of `wedge_facet`."""
        return self.ends(
            np.concatenate([self.scene_topology.halves("pair", "sharp")[:, 0], self.scene_topology.halves("rim")])
        )

    @cached
    def wedge_n(self) -> Floats:
        """Exterior angle (w,) over pi of the edges of `wedge_facet`."""
        turns = [j.turn[j.sharp] for j, _ in self.scene_topology.joined]
        return 1.0 + np.concatenate([*turns, np.ones(len(self.scene_topology.halves("rim")))])

    @cached
    def clusters(self) -> Clusters:
        """The facets in clusters of neighbours, each of one body."""
        order, first = self.scene_topology.clusters
        f = self.facets
        shape = f.vertices, f.normals, self.normal, self.edge_curvature
        if self._still is None or not self._still.shares:
            return Clusters(order, first, *hulls(order, first, *shape))
        hull = self._still.lasting("hulls", lambda: hulls(order, first, *shape))
        out = tuple(x.copy() for x in hull)
        body = f.body[order[first[:-1]]]
        for b in self._still.moving:
            begin, end = np.searchsorted(body, [b, b + 1])
            for column, part in zip(out, hulls(order, first[begin : end + 1], *shape), strict=True):
                column[begin:end] = part
        return Clusters(order, first, *out)

    @cached
    def wall_area(self) -> Floats:
        """Area (p,) [m^2] of each plane that is flat and lets nothing through, mirrors aside."""
        f, still = self.facets, self._still

        def found(rows: Any) -> Floats:
            solid = ~self.curved[rows] & ~self.is_layer[rows] & (f.role[f.body[rows]] != MIRROR)
            weights = np.where(solid, self.area[rows], 0.0)
            return np.asarray(np.bincount(self.plane[rows], weights, len(self.plane)), float)

        if still is None or not still.shares:
            return found(slice(None))
        out = still.lasting("walls", lambda: found(slice(None))).copy()
        anew = self.plane[still.rows]
        out[anew] = found(still.rows)[anew]
        return out

    @cached
    def shell(self) -> NDArray[np.bool_]:
        """Facets (n,) of pieces that close and let nothing through."""
        opaque = ~self.is_layer
        pieces = (closed_pieces(j, opaque[i : i + len(j.plane)]) for j, i in self.scene_topology.joined)
        return np.concatenate([np.zeros(0, bool), *pieces])

    @cached
    def inner_spheres(self) -> Balls:
        """Centre (k, 3) [m], radius (k,) [m] and body (k,) of balls inside closed opaque bodies."""
        if self._cores is not None:
            return self._cores
        f = self.facets
        solid = self.shell & (f.role[f.body] != MIRROR)
        found = [inner_spheres_of(f.vertices[solid & (f.body == b)]) for b in range(len(f.role))]
        owner = np.repeat(np.arange(len(found), dtype=np.int32), [len(r) for _, r in found])
        return np.concatenate([c for c, _ in found]), np.concatenate([r for _, r in found]), owner

    @property
    def veils(self) -> bool:
        """Whether anything lets a wave through."""
        return self._any_layer

    @cached
    def piece_role(self) -> NDArray[np.int8]:
        """Role (p,) of each piece's body."""
        f = self.facets
        out = np.zeros(int(self.piece.max(initial=-1)) + 1, f.role.dtype)
        out[self.piece] = f.role[f.body]
        return out

    @cached
    def piece_balls(self) -> tuple[Floats, Floats]:
        """Centre (p, 3) [m] and radius (p,) [m] of a ball about each piece."""
        low, high = np.moveaxis(extents(self.facets.vertices, self.piece, len(self.piece_role)), 1, 0)
        return 0.5 * (low + high), 0.5 * np.linalg.norm(high - low, axis=1)

    @cached
    def balls(self) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        """Centre (b, 3) [m] and radius (b,) [m] of a ball about each body, and which bodies (b,) have no facet."""
        low, high = np.moveaxis(self.extents, 1, 0)
        empty = np.asarray(~(low <= high).all(axis=1))
        low, high = np.where(empty[:, None], 0.0, low), np.where(empty[:, None], 0.0, high)
        return 0.5 * (low + high), 0.5 * np.linalg.norm(high - low, axis=1), empty

    def strength(self, facet: Ints, cosine: Floats, wavenumber: float, passing: bool = False) -> Floats:
        """Return the larger of |R_s|, |R_p| (or of |T_s|, |T_p| when `passing`) at facets (n,) for cosines of
        incidence."""
        m = self.facets.materials
        row = self.facets.material[facet]
        c = np.abs(coefficients_array(m.kind[row], m.eps[row], m.thickness[row], m.roughness[row], cosine, wavenumber))
        return c[:, 2:].max(axis=1) if passing else c[:, :2].max(axis=1)


@dataclass(frozen=True, eq=False)
class Clusters:
    """Facets order[first[i] : first[i + 1]] in a ball, centre (k, 3) and radius (k,) [m], their normals in a cone, axis
    (k, 3) and half angle spread (k,) [rad]."""

    order: Ints
    first: NDArray[np.int64]
    centre: Floats
    radius: Floats
    axis: Floats
    spread: Floats


class Stands(Protocol):
    """A scene of bodies (see world.scene.Scene)."""

    @property
    def topology(self) -> Sequence[MeshTopology]: ...
    @property
    def inner_spheres(self) -> Balls: ...
    @property
    def still(self) -> StaticGeometry | None: ...
    @property
    def kept(self) -> dict[Any, Any]: ...
    def facets(self) -> Facets: ...


def surface_at(scene: Stands) -> Geometry:
    """Return the surface of a scene's bodies as they stand at time 0."""
    return Geometry(scene.facets(), scene.topology, scene.inner_spheres, scene.still)


def geometry_of(scene: Stands) -> Geometry:
    """Return the surface of a scene's bodies as they stand at time 0, built once and kept with the scene."""
    if Geometry not in scene.kept:
        scene.kept[Geometry] = surface_at(scene)
    kept: Geometry = scene.kept[Geometry]
    return kept
