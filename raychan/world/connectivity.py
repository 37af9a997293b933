"""Connected pieces of a scene: facets that share edges, also across bodies that move as one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from raychan.geometry.triangles import half_edge_ends
from raychan.records import MIRROR, Facets
from raychan.world.topology import MeshTopology

Ints = NDArray[np.int32]

_WELD = 2e-6  # m: corners nearer than this are one point


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
    count = int(label.max(initial=-1)) + 1
    graph = coo_matrix((np.ones(len(a), np.int8), (a, b)), shape=(count, count))
    found: Ints = connected_components(graph, directed=False)[1][label]
    return found
