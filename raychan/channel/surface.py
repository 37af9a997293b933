"""What a tube must know of the surfaces: planes, smooth patches, closed bodies, and the true surface behind facets."""

from __future__ import annotations

from functools import cached_property
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from raychan.frames import sizes
from raychan.kernels.fresnel import coefficients_array
from raychan.tables import MIRROR, PEC, Facets
from raychan.world.embree import Tracer

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

_WELD = 1e-6  # m
_MIX = np.array([0x1E3779B97F4A7C15, 0x3F58476D1CE4E5B9, 0x14D049BB133111EB, 0x2545F4914F6CDD1D])
_METAL = 1e3  # relative permittivity from which a surface returns nearly all
_SHARP = 0.95  # cosine of corner normals across an edge above which it is round, not a wedge


class Surface(Tracer):
    """A tracer that also knows which facets share a plane or a smooth patch, and the curved surface through corner
    normals."""

    def __init__(self, facets: Facets) -> None:
        super().__init__(facets)
        n = len(facets.vertices)
        self.plane = np.arange(n, dtype=np.int32)
        self.smooth = np.arange(n, dtype=np.int32)
        self.closed = np.zeros(len(facets.role), bool)
        self.open_facet = np.ones(n, bool)
        self.curved = np.zeros(n, bool)
        self.convex_alone = False
        m = facets.materials
        self.dull = ((m.kind != PEC) & (np.abs(m.eps) < _METAL))[facets.material]
        self.bulge = np.zeros((n, 3, 3))
        self.outline = np.zeros((0, 2, 3))
        self.first_edge = np.zeros(1, np.int64)
        self.edge_ends = np.zeros((0, 2, 3))
        self.edge_faces = np.zeros((0, 2), np.int32)
        self.between: Any = None
        # What was found out about a leg, once.
        self.shadows: WeakKeyDictionary[Any, Any] = WeakKeyDictionary()
        self.reach: WeakKeyDictionary[Any, Any] = WeakKeyDictionary()
        self.wedge = np.zeros((0, 2, 3))
        self.wedge_facet = np.zeros((0, 2), np.int32)
        self.wedge_n = np.zeros(0)
        if n:
            self._join()
            self._bend()

    def _join(self) -> None:
        """Number planes (adjacent coplanar facets of one body, part and material) and smooth patches."""
        f = self.facets
        n = len(f.vertices)
        corner = (f.vertices - self._centre).reshape(-1, 3)
        keyed = np.column_stack([np.round(corner / _WELD), np.repeat(f.body, 3)]).astype(np.int64)
        # One number a place: rows of four sort ten times slower. Two places share one once in 10^7 scenes.
        _, vertex = np.unique(keyed @ _MIX, return_inverse=True)
        vertex = vertex.reshape(n, 3)
        start, end = vertex, np.roll(vertex, -1, axis=1)
        low, high = np.minimum(start, end).ravel(), np.maximum(start, end).ravel()
        edge = low.astype(np.int64) * (3 * n) + high
        order = np.argsort(edge, kind="stable")
        same = np.diff(edge[order]) == 0
        runs = np.concatenate([[0], np.cumsum(~same)])
        use = np.bincount(runs)
        odd = use[runs] != 2
        open_bodies = np.unique(f.body[order[odd] // 3])
        self.closed[:] = True
        self.closed[open_bodies] = False
        self.open_facet = ~self.closed[f.body]
        a, b = order[:-1][same] // 3, order[1:][same] // 3
        kin = (f.part[a] == f.part[b]) & (f.material[a] == f.material[b])
        a, b, ea, eb = a[kin], b[kin], order[:-1][same][kin], order[1:][same][kin]
        flat = np.abs(np.einsum("ij,ij->i", self.normal[a], self.normal[b])) > 1.0 - 1e-10
        self.plane = _components(a[flat], b[flat], n)
        # Smooth where the corner normals agree along the shared edge (which two facets walk in opposite ways).
        own, nxt = np.arange(3), np.roll(np.arange(3), -1)
        na0, na1 = f.normals[a, own[ea % 3]], f.normals[a, nxt[ea % 3]]
        nb0, nb1 = f.normals[b, nxt[eb % 3]], f.normals[b, own[eb % 3]]
        soft = (np.einsum("ij,ij->i", na0, nb0) > 1 - 1e-6) & (np.einsum("ij,ij->i", na1, nb1) > 1 - 1e-6)
        self.smooth = _components(a[soft], b[soft], n)
        one_sheet = bool((self.plane == self.plane[0]).all())
        if one_sheet:
            # Two sheets upon each other share every edge twice, yet have no inside.
            self.closed[:], self.open_facet[:] = False, True
        convex = one_sheet or (bool(self.closed[0]) and self._convex(order[:-1][same], order[1:][same]))
        self.convex_alone = len(f.role) == 1 and convex
        self.hides_nothing = self.convex_alone and bool(self.closed[0])
        every = order[:-1][same], order[1:][same]
        self._wedges(*every, order[odd])
        if not self.convex_alone:
            # No shadow falls on a body that hides nothing of itself.
            self._list_edges(*every, order[odd])
        inner = flat | soft
        self._outline(np.concatenate([ea[inner], eb[inner]]))

    def _convex(self, ea: Ints, eb: Ints) -> bool:
        """Tell whether a closed body of one piece bends outward at every pair of half edges (ea, eb): it hides
        nothing."""
        a, b = ea // 3, eb // 3
        pieces = connected_components(coo_matrix((np.ones(len(a), np.int8), (a, b)), shape=(len(self.plane),) * 2))[0]
        far_corner = self.facets.vertices[b, (eb % 3 + 2) % 3]
        height = np.einsum("ij,ij->i", far_corner - self.facets.vertices[a, ea % 3], self.normal[a])
        return bool(pieces == 1 and (height < 1e-9 * (1.0 + self.extent)).all())

    def _outline(self, inner: Ints) -> None:
        """List the edges around each plane (those not shared within it or a smooth patch): `outline[first_edge[p] :
        first_edge[p + 1]]`."""
        n = len(self.plane)
        outer = np.ones(3 * n, bool)
        outer[inner] = False
        edges = np.flatnonzero(outer)
        plane = self.plane[edges // 3]
        order = np.argsort(plane, kind="stable")
        v = self.facets.vertices
        a, b = v[edges // 3, edges % 3], v[edges // 3, (edges + 1) % 3]
        self.outline = np.stack([a, b], axis=1)[order]
        self.first_edge = np.searchsorted(plane[order], np.arange(n + 1))

    def _list_edges(self, ea: Ints, eb: Ints, rim: Ints) -> None:
        """List every edge that can be a body's outline: `edge_ends` (e, 2, 3) [m] and `edge_faces` (e, 2), -1 beyond a
        rim. Hollow edges hide nothing; between coplanar facets none is seen. Where a pane meets its frame, the frame
        ends as at a rim."""
        a, b = ea // 3, eb // 3
        v = self.facets.vertices
        height = np.einsum("ij,ij->i", v[b, (eb % 3 + 2) % 3] - v[a, ea % 3], self.normal[a])
        bent = height < -1e-9 * np.sqrt(self.area[b])
        # The ground ends where nobody looks, and its far rim would stretch every grid.
        solid = self.facets.role[self.facets.body] != MIRROR
        bent &= solid[a]
        framed = self.is_layer[a] != self.is_layer[b]
        bent &= ~framed
        frame = np.where(self.is_layer[a], eb, ea)[framed & solid[a]]
        rim = np.concatenate([rim[solid[rim // 3]], frame])
        pick = np.concatenate([ea[bent], rim])
        self.edge_ends = np.stack([v[pick // 3, pick % 3], v[pick // 3, (pick % 3 + 1) % 3]], axis=1)
        beyond = np.concatenate([b[bent], np.full(len(rim), -1)])
        self.edge_faces = np.stack([pick // 3, beyond], axis=1).astype(np.int32)

    def _wedges(self, ea: Ints, eb: Ints, rim: Ints) -> None:
        """List convex edges: `wedge` (w, 2, 3) ends [m], `wedge_facet` (w, 2) faces 0 and n, `wedge_n` exterior angle
        over pi; the rims of open sheets are half planes."""
        a, b = ea // 3, eb // 3
        v, corner = self.facets.vertices, np.arange(3)
        cosine = np.einsum("ij,ij->i", self.normal[a], self.normal[b])
        far = v[b, corner[(eb % 3 + 2) % 3]]
        convex = np.einsum("ij,ij->i", far - v[a, ea % 3], self.normal[a]) < -1e-9
        na = self.facets.normals[a, ea % 3]
        nb = self.facets.normals[b, (eb % 3 + 1) % 3]
        sharp = convex & (np.einsum("ij,ij->i", na, nb) < _SHARP)
        pick = np.concatenate([ea[sharp], rim])
        self.wedge = np.stack([v[pick // 3, pick % 3], v[pick // 3, (pick % 3 + 1) % 3]], axis=1)
        self.wedge_facet = np.stack([pick // 3, np.concatenate([b[sharp], rim // 3])], axis=1).astype(np.int32)
        turn = np.arccos(np.clip(cosine[sharp], -1.0, 1.0)) / np.pi
        self.wedge_n = np.concatenate([1.0 + turn, np.full(len(rim), 2.0)])

    def _bend(self) -> None:
        """Quadratic patch through corners and corner normals: x = sum l_i x_i - sum c_ij l_i l_j (Nagata 2005, eq.
        10)."""
        f = self.facets
        for e, (i, j) in enumerate(((0, 1), (1, 2), (2, 0))):
            d = f.vertices[:, j] - f.vertices[:, i]
            ni, nj = f.normals[:, i], f.normals[:, j]
            a = np.einsum("ij,ij->i", ni, nj)
            p, q = np.einsum("ij,ij->i", d, ni), -np.einsum("ij,ij->i", d, nj)
            det = 1.0 - a * a
            ok = det > 1e-12
            safe = np.where(ok, det, 1.0)
            c = ((p - a * q) / safe)[:, None] * ni + ((q - a * p) / safe)[:, None] * nj
            # On a circle |c| is half the chord times the turn; normals that contradict their edge (S-shape) leave it
            # straight.
            turn = np.sqrt(np.maximum(2.0 * (1.0 - a), 0.0))
            small = sizes(c) < turn * sizes(d)
            self.bulge[:, e] = c * (ok & small)[:, None]
        self.curved = np.asarray((np.abs(self.bulge) > 1e-9).any(axis=(1, 2)))

    @cached_property
    def balls(self) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        """Centre (b, 3) [m] and radius (b,) [m] of a ball about each body, and which bodies (b,) have no facet."""
        f = self.facets
        n = len(f.role)
        centre, radius, empty = np.zeros((n, 3)), np.zeros(n), np.ones(n, bool)
        for b in range(n):
            v = f.vertices[f.body == b].reshape(-1, 3)
            if len(v):
                low, high = v.min(axis=0), v.max(axis=0)
                centre[b], radius[b], empty[b] = 0.5 * (low + high), 0.5 * np.linalg.norm(high - low), False
        return centre, radius, empty

    def point(self, facet: Ints, bary: Floats) -> Floats:
        """Return points (n, ..., 3) of the true surface at barycentric coordinates (n, ..., 3)."""
        flat = np.einsum("n...i,nij->n...j", bary, self.facets.vertices[facet])
        pairs = bary * np.roll(bary, -1, axis=-1)
        return flat - np.einsum("n...e,nej->n...j", pairs, self.bulge[facet])

    def normal_at(self, facet: Ints, bary: Floats) -> Floats:
        """Return unit normals (n, ..., 3) of the true surface at barycentric coordinates."""
        v = np.einsum("n...i,nij->n...j", bary, self.facets.normals[facet])
        return v / sizes(v)[..., None]

    def elements(self, facet: Ints, bary: Floats) -> Floats:
        """Return vectors (n, m, 3) [m^2] normal to the true surface at barycentric coordinates (n, m, 3): its area for
        a unit of the last two of these."""
        v, c = self.facets.vertices[facet][:, :, None], self.bulge[facet][:, :, None]
        l0, l1, l2 = (bary[..., i, None] for i in range(3))
        along = v[:, 1] - v[:, 0] - (l0 - l1) * c[:, 0] - l2 * (c[:, 1] - c[:, 2])
        aside = v[:, 2] - v[:, 0] + l1 * (c[:, 0] - c[:, 1]) - (l0 - l2) * c[:, 2]
        return np.cross(along, aside)

    def strength(self, facet: Ints, cosine: Floats, wavenumber: float, passing: bool = False) -> Floats:
        """Return the larger of |R_s|, |R_p| (or of |T_s|, |T_p| when `passing`) at facets (n,) for cosines of
        incidence."""
        m = self.facets.materials
        row = self.facets.material[facet]
        c = np.abs(coefficients_array(m.kind[row], m.eps[row], m.thickness[row], m.roughness[row], cosine, wavenumber))
        return c[:, 2:].max(axis=1) if passing else c[:, :2].max(axis=1)

    def barycentric(self, facet: Ints, point: Floats) -> Floats:
        """Return barycentric coordinates (n, ..., 3) of points in the planes of their facets."""
        v = self.facets.vertices[facet]
        e1, e2 = v[:, 1] - v[:, 0], v[:, 2] - v[:, 0]
        n = np.cross(e1, e2)
        twice = np.einsum("ij,ij->i", n, n)
        r = point - v[:, 0].reshape(len(v), *([1] * (point.ndim - 2)), 3)
        b1 = np.einsum("n...j,nj->n...", r, np.cross(e2, n)) / _column(twice, r)
        b2 = np.einsum("n...j,nj->n...", r, np.cross(n, e1)) / _column(twice, r)
        return np.stack([1.0 - b1 - b2, b1, b2], axis=-1)


def _column(x: Floats, like: Floats) -> Floats:
    return x.reshape(len(x), *([1] * (like.ndim - 2)))


def _components(a: Ints, b: Ints, n: int) -> Ints:
    graph = coo_matrix((np.ones(len(a), np.int8), (a, b)), shape=(n, n))
    return connected_components(graph, directed=False)[1].astype(np.int32)
