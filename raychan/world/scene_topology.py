"""Fabric: how the facets of a scene hang together, wherever its bodies stand."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.geometry.silhouettes import by_cluster
from raychan.parallel import cached
from raychan.records import LAYER, MIRROR, Facets
from raychan.world.connectivity import pieces
from raychan.world.inner_spheres import closed_pieces
from raychan.world.topology import MeshTopology

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]


class SceneTopology:
    """Planes, smooth patches, edges and clusters of all bodies' facets, numbered through the scene.

    Args: facets, of which only what does not change with the poses is read; joints of each body's facets, bodies one
    after the other.
    """

    def __init__(self, facets: Facets, topology: Sequence[MeshTopology]) -> None:
        n = len(facets.body)
        # Held while something is made that serves all threads.
        self.making = threading.RLock()
        self.joined = list(zip(topology, np.cumsum([0, *(len(j.plane) for j in topology)]), strict=False))
        self.plane = _numbers([j.plane for j in topology], [j.planes for j in topology])
        self.smooth = _numbers([j.smooth for j in topology], [j.patches for j in topology])
        self._mirror = (facets.role == MIRROR)[facets.body]
        self._layer = (facets.materials.kind == LAYER)[facets.material]
        self.both_sides = self._entered()
        # Over the borders of bodies too.
        self.piece = pieces(facets, self.joined, self.halves("rim"))
        lone = len(topology) == 1 and topology[0].convex and not self.both_sides.any()
        self.convex_alone = n > 0 and len(facets.role) == 1 and (lone or not self.plane.any())
        self.hides_nothing = self.convex_alone and lone

    def _entered(self) -> Bools:
        """Tell which facets (n,) can be met from either side: those of open pieces, and of pieces that let a wave in
        somewhere."""
        return ~np.concatenate(
            [np.zeros(0, bool), *(closed_pieces(j, ~self._layer[i : i + len(j.plane)]) for j, i in self.joined)]
        )

    def halves(self, name: str, rows: str = "") -> Ints:
        """Return half edges of all joints by their numbers in the scene, some rows of them if asked."""
        found = [getattr(j, name)[getattr(j, rows)] if rows else getattr(j, name) for j, _ in self.joined]
        at = [x + np.int32(3 * i) for x, (_, i) in zip(found, self.joined, strict=True)]
        return np.concatenate(at) if at else np.zeros((0, 2) if name == "pair" else 0, np.int32)

    @cached
    def borders(self) -> Bools:
        """Which half edges (3 n,) are not inside a plane: 3 f + k runs from corner k of facet f to the next."""
        return np.concatenate([np.zeros(0, bool), *(j.border for j, _ in self.joined)])

    @cached
    def around(self) -> NDArray[np.int64]:
        """How many edges (p,) run around each plane."""
        count = self.borders.reshape(-1, 3).sum(axis=1)
        return np.bincount(self.plane, weights=count, minlength=len(self.plane)).astype(np.int64)

    @cached
    def outlines(self) -> tuple[Ints, NDArray[np.int64]]:
        """Half edges (e,) around the planes, and where those of each plane begin (p + 1,)."""
        outer = self.halves("outer")
        count = np.bincount(self.plane[outer // 3], minlength=len(self.plane))
        return outer, np.concatenate([[0], np.cumsum(count)])

    @cached
    def silhouettes(self) -> tuple[Ints, Ints]:
        """Half edges (e,) that can be a body's outline, and the facets (e, 2) on both sides, -1 beyond a rim."""
        if self.convex_alone:
            # No shadow falls on a body that hides nothing of itself.
            return np.zeros(0, np.int32), np.zeros((0, 2), np.int32)
        # The ground ends where nobody looks, and its far rim would stretch every grid.
        solid = ~self._mirror
        every, rim = self.halves("pair"), self.halves("rim")
        ours, bent = solid[every[:, 0] // 3], np.concatenate([np.zeros(0, bool), *(j.bent for j, _ in self.joined)])
        every = every[ours]
        a, b = every.T // 3
        # From inside, hollow edges stand out.
        turns = bent[ours] | (self.borders[every[:, 0]] & self.both_sides[a])
        # Where a pane ends, or bends, what passes it is another wave.
        hard = np.zeros(len(self.borders), bool)
        hard[self.halves("outer")] = True
        framed = (self._layer[a] | self._layer[b]) & hard[every[:, 0]]
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
        """The piece (k,) that each cluster is of, -1 for one of several."""
        order, first = self.clusters
        own = self.piece[order]
        least, most = np.minimum.reduceat(own, first[:-1]), np.maximum.reduceat(own, first[:-1])
        return np.where(least == most, least, -1).astype(np.int32)

    @cached
    def cluster_sides(self) -> Bools:
        """Which clusters (k,) hold a facet that can be met from either side."""
        order, first = self.clusters
        return np.logical_or.reduceat(self.both_sides[order], first[:-1])

    @cached
    def outlining(self) -> tuple[NDArray[Any], ...]:
        """Facets (e, 2) of `silhouettes` with its edges by cluster (see geometry.silhouettes.by_cluster)."""
        faces = self.silhouettes[1]
        return faces, *by_cluster(faces, *self.clusters)


def _numbers(labels: list[Ints], counts: list[int]) -> Ints:
    """Return labels of all bodies' facets, each body's counted on from the last one's."""
    at = np.cumsum([0, *counts])
    return np.concatenate([np.zeros(0, np.int32), *(x + np.int32(i) for x, i in zip(labels, at, strict=False))])
