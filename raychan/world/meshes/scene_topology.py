"""The topology of a whole scene: planes, smooth patches, pieces, edges and clusters of all facets, whatever the poses
of the bodies."""

from __future__ import annotations

import threading
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from raychan.geometry.triangles import half_edge_ends
from raychan.parallel import cached
from raychan.records import LAYER, MIRROR, Facets
from raychan.world.meshes.pieces import pieces as join
from raychan.world.meshes.topology import MeshTopology

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]

_WELD = 2e-6  # m: corners nearer than this are one point


class SceneTopology:
    """Planes, smooth patches, pieces, edges and clusters of all bodies' facets, numbered through the scene.

    Args: facets, of which only what does not change with the poses is read; topology of each body's facets, bodies one
    after the other.
    """

    def __init__(self, facets: Facets, topology: Sequence[MeshTopology]) -> None:
        n = len(facets.body)
        # Held while a property is computed that serves all threads.
        self.making = threading.RLock()
        self.joined = list(zip(topology, np.cumsum([0, *(len(j.plane) for j in topology)]), strict=False))
        self.plane = _numbers([j.plane for j in topology], [j.planes for j in topology])
        self.smooth = _numbers([j.smooth for j in topology], [j.patches for j in topology])
        self._mirror = (facets.role == MIRROR)[facets.body]
        self._layer = (facets.materials.kind == LAYER)[facets.material]
        self.both_sides = self._lit_from_both_sides()
        # Pieces reach over the borders of bodies that touch.
        self.piece = pieces(facets, self.joined, self.half_edges("rim"))
        lone = len(topology) == 1 and topology[0].convex and not self.both_sides.any()
        self.convex_alone = n > 0 and len(facets.role) == 1 and (lone or not self.plane.any())
        self.hides_nothing = self.convex_alone and lone

    def _lit_from_both_sides(self) -> Bools:
        """Return which facets (n,) waves can reach from both sides: those of open pieces, and of pieces with a thin
        layer through which a wave enters."""
        return ~np.concatenate(
            [np.zeros(0, bool), *(closed_pieces(j, ~self._layer[i : i + len(j.plane)]) for j, i in self.joined)]
        )

    def half_edges(self, name: str, rows: str = "") -> Ints:
        """Return the half edges of a column of all meshes' topologies, numbered through the scene.

        Args: name of the column; rows name of a column that tells which of them, all if empty.
        """
        found = [getattr(j, name)[getattr(j, rows)] if rows else getattr(j, name) for j, _ in self.joined]
        at = [x + np.int32(3 * i) for x, (_, i) in zip(found, self.joined, strict=True)]
        return np.concatenate(at) if at else np.zeros((0, 2) if name == "pair" else 0, np.int32)

    @cached
    def beside(self) -> Ints:
        """The facets (n, 3) across the edges of each, -1 for none."""
        found, pair = np.full(3 * len(self.plane), -1, np.int32), self.half_edges("pair")
        found[pair] = pair[:, ::-1] // 3
        return found.reshape(-1, 3)

    @cached
    def borders(self) -> Bools:
        """Which half edges (3 n,) border a plane: 3 f + k runs from corner k of facet f to the next."""
        return np.concatenate([np.zeros(0, bool), *(j.border for j, _ in self.joined)])

    @cached
    def edges_around(self) -> NDArray[np.int64]:
        """How many edges (p,) border each plane."""
        count = self.borders.reshape(-1, 3).sum(axis=1)
        return np.bincount(self.plane, weights=count, minlength=len(self.plane)).astype(np.int64)

    @cached
    def plane_edges(self) -> tuple[Ints, NDArray[np.int64]]:
        """Half edges (e,) around the planes, by plane, and where those of each begin (p + 1,)."""
        outer = self.half_edges("outer")
        count = np.bincount(self.plane[outer // 3], minlength=len(self.plane))
        return outer, np.concatenate([[0], np.cumsum(count)])

    @cached
    def silhouettes(self) -> tuple[Ints, Ints]:
        """Half edges (e,) that can be silhouette edges, and the facets (e, 2) on both sides, -1 beyond a boundary
        edge."""
        if self.convex_alone:
            # No shadow falls on a convex body that is alone.
            return np.zeros(0, np.int32), np.zeros((0, 2), np.int32)
        # The ground hides nothing beyond its boundary, which would stretch every grid.
        solid = ~self._mirror
        every, rim = self.half_edges("pair"), self.half_edges("rim")
        ours, convex = solid[every[:, 0] // 3], np.concatenate([np.zeros(0, bool), *(j.bent for j, _ in self.joined)])
        every = every[ours]
        a, b = every.T // 3
        # Seen from inside, concave edges are silhouette edges.
        turns = convex[ours] | (self.borders[every[:, 0]] & self.both_sides[a])
        # Where a thin layer ends, or bends, the wave that passes it changes.
        outer = np.zeros(len(self.borders), bool)
        outer[self.half_edges("outer")] = True
        framed = (self._layer[a] | self._layer[b]) & outer[every[:, 0]]
        pair, frame = every[turns & ~framed], np.where(self._layer[a], every[:, 1], every[:, 0])[framed]
        rim = np.concatenate([rim[solid[rim // 3]], frame])
        faces = np.concatenate([pair // 3, np.stack([rim // 3, np.full(len(rim), -1)], axis=1)])
        return np.concatenate([pair[:, 0], rim]), faces.astype(np.int32)

    @cached
    def clusters(self) -> tuple[Ints, NDArray[np.int64]]:
        """Facets (n,) in the order of clusters of neighbours, and where each of these begins (k + 1,)."""
        parts = [(j.order + np.int32(i), j.first[:-1] + i) for j, i in self.joined]
        order, first = (np.concatenate(x) for x in zip(*parts, strict=True))
        return order, np.append(first, len(order))

    @cached
    def cluster_piece(self) -> Ints:
        """The piece (k,) to which each cluster belongs, -1 for one of several pieces."""
        order, first = self.clusters
        own = self.piece[order]
        least, most = np.minimum.reduceat(own, first[:-1]), np.maximum.reduceat(own, first[:-1])
        return np.where(least == most, least, -1).astype(np.int32)


def _numbers(labels: list[Ints], counts: list[int]) -> Ints:
    """Return labels of all bodies' facets, those of each body counted on from the last one's."""
    at = np.cumsum([0, *counts])
    return np.concatenate([np.zeros(0, np.int32), *(x + np.int32(i) for x, i in zip(labels, at, strict=False))])


def pieces(facets: Facets, joined: Sequence[tuple[MeshTopology, int]], rim: Ints) -> Ints:
    """Return the number (n,) of the connected piece of each facet, from 0 on.

    Bodies that move as one are connected where their boundary edges coincide: a thing is the same whether drawn as one
    body or as several.

    Args: joined topologies, and the first facet of each; rim boundary half edges (r,) of all bodies.
    """
    begin = np.cumsum([0, *(int(j.piece.max(initial=-1)) + 1 for j, _ in joined)])
    out = np.concatenate([np.zeros(0, np.int32), *(j.piece + b for (j, _), b in zip(joined, begin, strict=False))])
    f = facets
    turning = (f.spin != 0.0).any(axis=1, keepdims=True)
    motion = np.column_stack([f.velocity, f.spin, np.where(turning, f.origin, 0.0), f.role])
    frame = np.unique(motion, axis=0, return_inverse=True)[1].ravel()
    owner = f.body[rim // 3]
    rim = rim[f.role[owner] != MIRROR]
    owner = f.body[rim // 3]
    if len(np.unique(owner)) > 1:
        a, b = _coincident(np.ascontiguousarray(half_edge_ends(f.vertices, rim)), frame[owner])
        apart = owner[a] != owner[b]
        out = _linked(out, out[rim[a[apart]] // 3], out[rim[b[apart]] // 3])
    return out.astype(np.int32)


def _coincident(edges: NDArray[np.float64], frame: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return pairs (k,) of edges (e, 2, 3) [m] of one frame (e,) that coincide; enough of them to link all."""
    points = edges.reshape(-1, 3)
    near = cKDTree(points).query_pairs(_WELD, output_type="ndarray")
    place = _linked(np.arange(len(points)), near[:, 0], near[:, 1]).reshape(-1, 2)
    key = np.column_stack([frame, np.sort(place, axis=1)])
    order = np.lexsort(key.T)
    same = (key[order][1:] == key[order][:-1]).all(axis=1)
    return order[:-1][same], order[1:][same]


def _linked(label: NDArray[np.signedinteger], a: NDArray[np.signedinteger], b: NDArray[np.signedinteger]) -> Ints:
    """Return labels (n,) numbered anew, the labels a (k,) and b (k,) being the same."""
    return join(a, b, int(label.max(initial=-1)) + 1).astype(np.int32)[label]


def closed_pieces(topology: MeshTopology, opaque: Bools) -> Bools:
    """Return which facets (n,) belong to pieces that are closed and opaque (n,) all over."""
    piece = topology.piece
    # Two sheets upon each other share every edge twice, but enclose nothing.
    closed = np.zeros(len(opaque), bool)
    one_plane = np.empty(len(opaque), topology.plane.dtype)
    one_plane[piece] = topology.plane
    closed[piece[topology.plane != one_plane[piece]]] = True
    closed[piece[~opaque]] = False
    closed[piece[topology.rim // 3]] = False
    return np.asarray(closed[piece])
