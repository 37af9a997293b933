"""What a tube must know of the surfaces: planes, smooth patches, closed bodies, and the true surface behind facets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from raychan.kernels.facets import bulges, ends, hulls
from raychan.kernels.fresnel import coefficients_array
from raychan.kernels.rows import once
from raychan.tables import MIRROR, PEC, Facets
from raychan.world.embree import Tracer
from raychan.world.joints import Joints, joined, places

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

_METAL = 1e3  # relative permittivity from which a surface returns nearly all


class Surface(Tracer):
    """A tracer that also knows which facets share a plane or a smooth patch, and the curved surface through corner
    normals.

    Args: facets; joints of each body's facets, bodies one after the other; found anew if not given.
    """

    def __init__(self, facets: Facets, joints: Sequence[Joints] = ()) -> None:
        super().__init__(facets)
        n = len(facets.vertices)
        m = facets.materials
        self.dull = ((m.kind != PEC) & (np.abs(m.eps) < _METAL))[facets.material]
        self.matter = facets.material, (m.kind, m.eps, m.thickness, m.roughness)
        self.bulge, self.curved = bulges(facets.vertices, facets.normals)
        # What others made of all this, once.
        self.between: Any = None
        self.screens: Any = None
        # What was found out about a leg, once.
        self.shadows: dict[Any, Any] = {}
        self.reach: WeakKeyDictionary[Any, Any] = WeakKeyDictionary()
        joints = joints or ([self._joints()] if n else [])
        self._joined = list(zip(joints, np.cumsum([0, *(len(j.plane) for j in joints)]), strict=False))
        self.plane = self._numbers([j.plane for j in joints], [j.planes for j in joints])
        self.smooth = self._numbers([j.smooth for j in joints], [j.patches for j in joints])
        self.closed = np.full(len(facets.role), n > 0)
        self.closed[facets.body[self._halves("rim") // 3]] = False
        one_sheet = n > 0 and not self.plane.any()
        if one_sheet:
            # Two sheets upon each other share every edge twice, yet have no inside.
            self.closed[:] = False
        self.open_facet = ~self.closed[facets.body]
        self.convex_alone = n > 0 and len(facets.role) == 1 and (one_sheet or (len(joints) == 1 and joints[0].convex))
        self.hides_nothing = self.convex_alone and bool(self.closed[0])

    def _joints(self) -> Joints:
        """Return how all facets hang together; those of different bodies never do."""
        f = self.facets
        vertex = places((f.vertices - self._centre).reshape(-1, 3), np.repeat(f.body, 3)).reshape(-1, 3)
        kind = f.part * np.int64(len(f.materials.kind)) + f.material
        return joined(vertex, kind, f.vertices, f.normals, f.body)

    def _numbers(self, labels: list[Ints], counts: list[int]) -> Ints:
        """Return labels of all bodies' facets, each body's counted on from the last one's."""
        at = np.cumsum([0, *counts])
        return np.concatenate([np.zeros(0, np.int32), *(x + np.int32(i) for x, i in zip(labels, at, strict=False))])

    def _halves(self, name: str, rows: str = "") -> Ints:
        """Return half edges of all joints by their numbers in the scene, some rows of them if asked."""
        found = [getattr(j, name)[getattr(j, rows)] if rows else getattr(j, name) for j, _ in self._joined]
        at = [x + np.int32(3 * i) for x, (_, i) in zip(found, self._joined, strict=True)]
        return np.concatenate(at) if at else np.zeros((0, 2) if name == "pair" else 0, np.int32)

    def ends(self, half: Ints) -> Floats:
        """Return both ends (e, 2, 3) [m] of half edges."""
        found: Floats = ends(self.facets.vertices, np.ascontiguousarray(half))
        return found

    @once
    def _outlines(self) -> tuple[Floats, NDArray[np.int64], Ints]:
        outer = self._halves("outer")
        count = np.bincount(self.plane[outer // 3], minlength=len(self.plane))
        return self.ends(outer), np.concatenate([[0], np.cumsum(count)]), outer // 3

    @property
    def borders(self) -> NDArray[np.bool_]:
        """Which half edges (3 n,) are not inside a plane: 3 f + k runs from corner k of facet f to the next."""
        return np.concatenate([np.zeros(0, bool), *(j.border for j, _ in self._joined)])

    @property
    def outline(self) -> Floats:
        """Edges (e, 2, 3) [m] around the planes, not those shared within one or a smooth patch: of plane p those of
        `outline[first_edge[p] : first_edge[p + 1]]`."""
        return self._outlines[0]

    @property
    def first_edge(self) -> NDArray[np.int64]:
        """See `outline`."""
        return self._outlines[1]

    @property
    def outline_facet(self) -> Ints:
        """Facets (e,) to which the edges of `outline` belong."""
        return self._outlines[2]

    @once
    def _silhouettes(self) -> tuple[Floats, Ints]:
        if self.convex_alone:
            # No shadow falls on a body that hides nothing of itself.
            return np.zeros((0, 2, 3)), np.zeros((0, 2), np.int32)
        # The ground ends where nobody looks, and its far rim would stretch every grid.
        solid = self.facets.role[self.facets.body] != MIRROR
        pair, rim = self._halves("pair", "bent"), self._halves("rim")
        pair, frame = pair[solid[pair[:, 0] // 3]], rim[:0]
        if self._any_layer:
            pair = pair[self.is_layer[pair[:, 0] // 3] == self.is_layer[pair[:, 1] // 3]]
            every = self._halves("pair")
            a, b = every.T // 3
            framed = (self.is_layer[a] != self.is_layer[b]) & solid[a]
            frame = np.where(self.is_layer[a], every[:, 1], every[:, 0])[framed]
        rim = np.concatenate([rim[solid[rim // 3]], frame])
        faces = np.concatenate([pair // 3, np.stack([rim // 3, np.full(len(rim), -1)], axis=1)])
        return self.ends(np.concatenate([pair[:, 0], rim])), faces.astype(np.int32)

    @property
    def edge_ends(self) -> Floats:
        """Ends (e, 2, 3) [m] of every edge that can be a body's outline. Hollow edges hide nothing; between coplanar
        facets none is seen. Where a pane meets its frame, the frame ends as at a rim."""
        return self._silhouettes[0]

    @property
    def edge_faces(self) -> Ints:
        """Facets (e, 2) on both sides of `edge_ends`, -1 beyond a rim."""
        return self._silhouettes[1]

    @once
    def wedge_facet(self) -> Ints:
        """Faces 0 and n (w, 2) of convex edges; the rims of open sheets are half planes."""
        rim = self._halves("rim") // 3
        return np.concatenate([self._halves("pair", "sharp") // 3, np.stack([rim, rim], axis=1)]).astype(np.int32)

    @once
    def wedge(self) -> Floats:
        """Ends (w, 2, 3) [m] of the edges of `wedge_facet`."""
        return self.ends(np.concatenate([self._halves("pair", "sharp")[:, 0], self._halves("rim")]))

    @once
    def wedge_n(self) -> Floats:
        """Exterior angle (w,) over pi of the edges of `wedge_facet`."""
        turns = [j.turn[j.sharp] for j, _ in self._joined]
        return 1.0 + np.concatenate([*turns, np.ones(len(self._halves("rim")))])

    @once
    def clusters(self) -> Clusters:
        """The facets in clusters of neighbours, each of one body."""
        parts = [(j.order + np.int32(i), j.first[:-1] + i) for j, i in self._joined]
        order, first = (np.concatenate(x) for x in zip(*parts, strict=True))
        first = np.append(first, len(order))
        f = self.facets
        hull = hulls(order, first, f.vertices, f.normals, self.normal, self.bulge)
        return Clusters(order, first, *hull)

    @once
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
    def joints(self) -> Sequence[Joints]: ...
    @property
    def kept(self) -> dict[Any, Any]: ...
    def facets(self) -> Facets: ...


def surface_of(scene: Stands) -> Surface:
    """Return the surface of a scene's bodies as they stand at time 0, built once and kept with the scene."""
    if Surface not in scene.kept:
        scene.kept[Surface] = Surface(scene.facets(), scene.joints)
    kept: Surface = scene.kept[Surface]
    return kept
