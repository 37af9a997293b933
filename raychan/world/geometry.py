"""The geometry of a scene at one instant: its facets with all that tracing needs to know of them.

Planes, smooth patches, edges, clusters, closed bodies, and the curved surface that corner normals imply. A geometry
does not change once it is built; what tracing finds out about it is kept in `tracing.cache`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from raychan.em.fresnel import coefficients_array
from raychan.geometry.silhouettes import silhouette_edges
from raychan.geometry.triangles import cluster_bounds, edge_curvatures, extents, half_edge_ends
from raychan.parallel import cached
from raychan.records import MIRROR, PEC, Facets
from raychan.world.body import Body
from raychan.world.meshes.inner_spheres import inner_spheres_of
from raychan.world.meshes.scene_topology import SceneTopology, closed_pieces
from raychan.world.meshes.topology import MeshTopology, mesh_topology, point_numbers
from raychan.world.ray_caster import RayCaster
from raychan.world.scene_files.schema import PREVIEW, Model
from raychan.world.simplified import Merged, traced_scene
from raychan.world.static_geometry import StaticGeometry, columns, computed_once

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

Spheres = tuple[Floats, Floats, Ints]

_METAL = 1e3  # relative permittivity from which a surface reflects nearly all: its loss is not weighed


class Geometry(RayCaster):
    """A ray caster that also knows which facets share a plane or a smooth patch, and the curved surface through corner
    normals. Immutable: attributes are set when it is built, and derived ones computed at their first use.

    Args: facets; topology of each body's facets, bodies one after the other; inner_spheres inside bodies, centre (k, 3)
    [m], radius (k,) [m], body (k,); both computed if not given; static what is kept of bodies that do not move;
    finer_of a geometry of the same surface with coarser facets: bodies hide of themselves what they hide there; merged
    what was merged of finer meshes.
    """

    def __init__(
        self,
        facets: Facets,
        topology: Sequence[MeshTopology] = (),
        inner_spheres: Spheres | None = None,
        static: StaticGeometry | None = None,
        finer_of: Geometry | None = None,
        merged: Merged | None = None,
    ) -> None:
        super().__init__(facets, static)
        v, n, m = facets.vertices, facets.normals, facets.materials
        self._static, self._inner_spheres, self.merged = static, inner_spheres, merged
        reflects_in_part = (m.kind != PEC) & (np.abs(m.eps) < _METAL)
        self.lossy = computed_once(static, "lossy", lambda: reflects_in_part[facets.material])
        self.material_columns = facets.material, (m.kind, m.eps, m.thickness, m.roughness)
        self.edge_curvature, self.curved = columns(
            static, "edge curvatures", lambda rows: edge_curvatures(v[rows], n[rows])
        )
        self.scene_topology = computed_once(
            static, "topology", lambda: SceneTopology(facets, topology or ([self._topology()] if len(v) else []))
        )
        self.plane, self.smooth = self.scene_topology.plane, self.scene_topology.smooth
        self.both_sides, self.piece = self.scene_topology.both_sides, self.scene_topology.piece
        alike: Any = self.scene_topology if finer_of is None else finer_of
        self.convex_alone, self.hides_nothing = bool(alike.convex_alone), bool(alike.hides_nothing)
        self._built = True

    def __setattr__(self, name: str, value: Any) -> None:
        if "_built" in self.__dict__:
            raise AttributeError(f"a geometry does not change: '{name}' cannot be set")
        super().__setattr__(name, value)

    def _topology(self) -> MeshTopology:
        """Return the topology of all facets; those of different bodies share no edge."""
        f = self.facets
        vertex = point_numbers((f.vertices - self._centre).reshape(-1, 3), np.repeat(f.body, 3)).reshape(-1, 3)
        kind = f.part * np.int64(len(f.materials.kind)) + f.material
        return mesh_topology(vertex, kind, f.vertices, f.normals, f.body)

    def ends(self, half: Ints) -> Floats:
        """Return both ends (e, 2, 3) [m] of half edges."""
        found: Floats = half_edge_ends(self.facets.vertices, np.ascontiguousarray(half, np.int64))
        return found

    @cached
    def plane_edges(self) -> Floats:
        """Edges (e, 2, 3) [m] around the planes, not those within a plane or a smooth patch: around plane p lie
        `plane_edges[first_edge[p] : first_edge[p + 1]]`."""
        return self.ends(self.scene_topology.plane_edges[0])

    @property
    def first_edge(self) -> NDArray[np.int64]:
        """Where the edges of each plane begin (p + 1,) in `plane_edges`."""
        return self.scene_topology.plane_edges[1]

    @property
    def plane_edge_facet(self) -> Ints:
        """Facets (e,) to which the edges of `plane_edges` belong."""
        return self.scene_topology.plane_edges[0] // 3

    @cached
    def edge_ends(self) -> Floats:
        """Ends (e, 2, 3) [m] of every edge that can be a silhouette edge: convex edges and boundary edges. Where a pane
        meets its frame, the frame ends as at a boundary edge."""
        return self.ends(self.scene_topology.silhouettes[0])

    @property
    def edge_faces(self) -> Ints:
        """Facets (e, 2) on both sides of `edge_ends`, -1 beyond a boundary edge."""
        return self.scene_topology.silhouettes[1]

    def silhouette_edges(self, image: Floats, far: bool) -> tuple[Ints, Ints]:
        """Return the silhouette edges as seen from a point (3,) [m], or from a direction when far, boundary edges among
        them: their half edges (e,) and the facets (e, 2) on both sides, -1 beyond a boundary edge."""
        half, faces = self.scene_topology.silhouettes
        if not len(half):
            return half, faces
        found = silhouette_edges(faces, self.first, self.normal, np.asarray(image, float), far)
        return half[found], faces[found]

    @cached
    def wedge_facet(self) -> Ints:
        """Faces 0 and n (w, 2) of wedges: sharp convex edges, and boundary edges as half planes."""
        rim = self.scene_topology.half_edges("rim") // 3
        return np.concatenate(
            [self.scene_topology.half_edges("pair", "sharp") // 3, np.stack([rim, rim], axis=1)]
        ).astype(np.int32)

    @cached
    def wedge(self) -> Floats:
        """Ends (w, 2, 3) [m] of the edges of `wedge_facet`."""
        return self.ends(
            np.concatenate(
                [self.scene_topology.half_edges("pair", "sharp")[:, 0], self.scene_topology.half_edges("rim")]
            )
        )

    @cached
    def wedge_n(self) -> Floats:
        """Exterior angle (w,) over pi of the edges of `wedge_facet`."""
        turns = [j.turn[j.sharp] for j, _ in self.scene_topology.joined]
        return 1.0 + np.concatenate([*turns, np.ones(len(self.scene_topology.half_edges("rim")))])

    @cached
    def clusters(self) -> Clusters:
        """The facets in clusters of neighbours, each of one body."""
        order, first = self.scene_topology.clusters
        f = self.facets
        shape = f.vertices, self.edge_curvature
        if self._static is None or not self._static.shares:
            return Clusters(order, first, *cluster_bounds(order, first, *shape))
        kept = self._static.computed_once("cluster bounds", lambda: cluster_bounds(order, first, *shape))
        out = tuple(x.copy() for x in kept)
        body = f.body[order[first[:-1]]]
        for b in self._static.moving:
            begin, end = np.searchsorted(body, [b, b + 1])
            for column, part in zip(out, cluster_bounds(order, first[begin : end + 1], *shape), strict=True):
                column[begin:end] = part
        return Clusters(order, first, *out)

    @cached
    def wall_area(self) -> Floats:
        """Area (p,) [m^2] of each plane that is flat and opaque, ground mirrors aside."""
        f, static = self.facets, self._static

        def found(rows: Any) -> Floats:
            solid = ~self.curved[rows] & ~self.is_layer[rows] & (f.role[f.body[rows]] != MIRROR)
            weights = np.where(solid, self.area[rows], 0.0)
            return np.asarray(np.bincount(self.plane[rows], weights, len(self.plane)), float)

        if static is None or not static.shares:
            return found(slice(None))
        out = static.computed_once("wall areas", lambda: found(slice(None))).copy()
        anew = self.plane[static.rows]
        out[anew] = found(static.rows)[anew]
        return out

    @cached
    def any_curved(self) -> bool:
        """Whether any facet is curved."""
        return bool(self.curved.any())

    @cached
    def closed_opaque(self) -> NDArray[np.bool_]:
        """Which facets (n,) are of closed opaque pieces."""
        opaque = ~self.is_layer
        pieces = (closed_pieces(j, opaque[i : i + len(j.plane)]) for j, i in self.scene_topology.joined)
        return np.concatenate([np.zeros(0, bool), *pieces])

    @cached
    def inner_spheres(self) -> Spheres:
        """Centre (k, 3) [m], radius (k,) [m] and body (k,) of spheres inside closed opaque bodies."""
        if self._inner_spheres is not None:
            return self._inner_spheres
        f = self.facets
        solid = self.closed_opaque & (f.role[f.body] != MIRROR)
        found = [inner_spheres_of(f.vertices[solid & (f.body == b)]) for b in range(len(f.role))]
        owner = np.repeat(np.arange(len(found), dtype=np.int32), [len(r) for _, r in found])
        return np.concatenate([c for c, _ in found]), np.concatenate([r for _, r in found]), owner

    @cached
    def piece_role(self) -> NDArray[np.int8]:
        """Role (p,) of each piece's body."""
        f = self.facets
        out = np.zeros(int(self.piece.max(initial=-1)) + 1, f.role.dtype)
        out[self.piece] = f.role[f.body]
        return out

    @cached
    def piece_spheres(self) -> tuple[Floats, Floats]:
        """Centre (p, 3) [m] and radius (p,) [m] of a bounding sphere of each piece."""
        low, high = np.moveaxis(extents(self.facets.vertices, self.piece, len(self.piece_role)), 1, 0)
        return 0.5 * (low + high), 0.5 * np.linalg.norm(high - low, axis=1)

    @cached
    def body_spheres(self) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        """Centre (b, 3) [m] and radius (b,) [m] of a bounding sphere of each body, and which bodies (b,) have no
        facet."""
        low, high = np.moveaxis(self.extents, 1, 0)
        empty = np.asarray(~(low <= high).all(axis=1))
        low, high = np.where(empty[:, None], 0.0, low), np.where(empty[:, None], 0.0, high)
        return 0.5 * (low + high), 0.5 * np.linalg.norm(high - low, axis=1), empty

    def strength(self, facet: Ints, cosine: Floats, wavenumber: float, passing: bool = False) -> Floats:
        """Return the larger of |R_s|, |R_p| (or of |T_s|, |T_p| when `passing`) at facets (n,) for cosines (n,) of
        incidence and a wavenumber [rad/m]."""
        m = self.facets.materials
        row = self.facets.material[facet]
        c = np.abs(coefficients_array(m.kind[row], m.eps[row], m.thickness[row], m.roughness[row], cosine, wavenumber))
        return c[:, 2:].max(axis=1) if passing else c[:, :2].max(axis=1)


@dataclass(frozen=True, eq=False)
class Clusters:
    """Clusters of facets, order[first[i] : first[i + 1]], each with a bounding sphere, centre (k, 3) and radius (k,)
    [m]."""

    order: Ints
    first: NDArray[np.int64]
    centre: Floats
    radius: Floats


class HasBodies(Protocol):
    """A scene of bodies (see world.scene.Scene)."""

    @property
    def topology(self) -> Sequence[MeshTopology]: ...
    @property
    def inner_spheres(self) -> Spheres: ...
    @property
    def static_geometry(self) -> StaticGeometry | None: ...
    @property
    def _derived(self) -> dict[Any, Any]: ...

    bodies: tuple[Body, ...]
    frequency: float
    model: Model
    _static: dict[Any, Any]

    def facets(self) -> Facets: ...


def surface_at(scene: HasBodies, tolerance_db: float | None = None, since: float = 0.0) -> Geometry:
    """Return the geometry of a scene's bodies at time 0, for a tolerance [dB] (None: the scene's): finely tessellated
    smooth surfaces are simplified, unless the scene's model says otherwise; since as for `Facets`."""
    of, merged = traced_scene(scene, tolerance_db)
    return Geometry(of.facets().replace(since=since), of.topology, of.inner_spheres, of.static_geometry, None, merged)


def geometry_of(scene: HasBodies, tolerance_db: float | None = None, since: float = 0.0) -> Geometry:
    """Return the geometry of a scene's bodies at time 0 as `surface_at` does, built once and kept with the scene."""
    merged = traced_scene(scene, tolerance_db)[1]
    key: Any = (Geometry, since) if merged is None else (Geometry, since, tolerance_db)
    # A preview shares what stands, in groups whose float32 coordinates round otherwise: never the geometry of a run.
    key = (PREVIEW, key) if scene.model.mode == PREVIEW else key
    if key not in scene._derived:
        scene._derived[key] = surface_at(scene, tolerance_db, since)
    geometry: Geometry = scene._derived[key]
    return geometry
