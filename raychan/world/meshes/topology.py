"""The topology of a mesh: neighbours, planes, smooth patches, pieces and clusters of its facets, found once for all
poses of its body."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.geometry.triangles import edge_folds, planes_of
from raychan.world.meshes.convexity import convex
from raychan.world.meshes.pieces import edges, pieces

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]

_WELD = 1e-6  # m: corners that round to the same multiple are one point
_MIX = np.array([0x1E3779B97F4A7C15, 0x3F58476D1CE4E5B9, 0x14D049BB133111EB, 0x2545F4914F6CDD1D])
_CLUSTER = 64  # facets: trades clusters to test for facets culled with each; not measured


@dataclass(frozen=True, eq=False)
class MeshTopology:
    """How n facets are connected. Half edge 3 f + k runs from corner k of facet f to the next.

    Fields: plane, smooth (n,) number of the plane (adjacent coplanar facets of one kind) and of the smooth patch of
    each facet; pair (e, 2) half edges of both sides of each edge; rim (r,) boundary half edges, with no other side or
    several; bent, sharp (e,) convex edges, and those sharp enough for a wedge; turn (e,) exterior angle of these over
    pi, less 1; outer half edges, by plane, that are not within a plane or a smooth patch; border (3 n,) half edges that
    are not within a plane; convex: closed, of one piece, all edges convex or flat; order (n,), first (k + 1,) the
    facets by clusters of neighbours: order[first[i] : first[i + 1]].
    """

    plane: Ints
    smooth: Ints
    pair: Ints
    rim: Ints
    bent: Bools
    sharp: Bools
    turn: Floats
    outer: Ints
    border: Bools
    convex: bool
    order: Ints
    first: NDArray[np.int64]

    @cached_property
    def piece(self) -> Ints:
        """Number (n,) of the connected piece of each facet."""
        return _components(self.pair, len(self.plane))

    @property
    def planes(self) -> int:
        """Number of planes."""
        return int(self.plane.max(initial=-1)) + 1

    @property
    def patches(self) -> int:
        """Number of smooth patches."""
        return int(self.smooth.max(initial=-1)) + 1


def point_numbers(points: Floats, group: NDArray[np.signedinteger[Any]] | None = None) -> NDArray[np.int64]:
    """Return a number (n,) for each point (n, 3) [m], the same for points of a group (n,) that round to the same
    micrometre."""
    keyed = np.round(points / _WELD).astype(np.int64) @ _MIX[:3]
    if group is not None:
        keyed += group * _MIX[3]
    # One hash a point: rows of four numbers sort ten times slower. Two points share one in about 1 of 10^7 scenes.
    return np.unique(keyed, return_inverse=True)[1].astype(np.int64)


def mesh_topology(
    vertex: NDArray[np.int64],
    kind: NDArray[np.signedinteger[Any]],
    v: Floats,
    normals: Floats,
    body: NDArray[np.signedinteger[Any]] | None = None,
) -> MeshTopology:
    """Return the topology of facets.

    Args: vertex (n, 3) number of each corner's point; kind (n,): only facets of one kind share planes and patches;
    v, normals (n, 3, 3) corners [m] and normals there; body (n,) if they are of several.
    """
    n = len(v)
    normal, area = planes_of(v)
    order, run = edges(vertex)
    same = run[1:] == run[:-1]
    use = np.bincount(run)
    rim = order[np.repeat(use != 2, use)]
    pair = np.stack([order[:-1][same], order[1:][same]], axis=1).astype(np.int32)
    flat, soft, bent, sharp, height = edge_folds(pair, v, normals, normal, area)
    a, b = pair.T // 3
    same_kind = kind[a] == kind[b]
    flat, soft = flat & same_kind, soft & same_kind
    plane = _components(pair[flat], n)
    cosine = np.einsum("ij,ij->i", normal[a[sharp]], normal[b[sharp]])
    turn = np.zeros(len(pair))
    turn[sharp] = np.arccos(np.clip(cosine, -1.0, 1.0)) / np.pi
    border = _unpaired(pair[flat], n)
    outer = np.flatnonzero(_unpaired(pair[flat | soft], n))
    outer = outer[np.argsort(plane[outer // 3], kind="stable")]
    whole = not len(rim) and int(_components(pair, n).max()) == 0
    bounds = np.array([v.min(axis=(0, 1)), v.max(axis=(0, 1))])
    along = _along_curve(v.mean(axis=1))
    if body is not None:
        along = along[np.argsort(body[along], kind="stable")]
    return MeshTopology(
        plane=plane,
        smooth=_components(pair[soft], n),
        pair=pair,
        rim=rim.astype(np.int32),
        bent=bent,
        sharp=sharp,
        turn=turn,
        outer=outer.astype(np.int32),
        border=border,
        convex=whole and convex(float(height.max()), bounds, lambda: _points(vertex, v)),
        order=along,
        first=_starts(None if body is None else body[along], n),
    )


def _points(vertex: NDArray[np.int64], v: Floats) -> tuple[Floats, NDArray[np.int64]]:
    """Return the points (k, 3) [m] of facets by the numbers of their corners v (n, 3, 3), and those numbers from 0."""
    _, first, number = np.unique(vertex.ravel(), return_index=True, return_inverse=True)
    return v.reshape(-1, 3)[first], number.reshape(-1, 3)


def _starts(body: NDArray[np.signedinteger[Any]] | None, n: int) -> NDArray[np.int64]:
    """Return where clusters of n facets begin, and n; no cluster holds facets of two bodies."""
    every = np.arange(0, n, _CLUSTER)
    change = np.zeros(0, int) if body is None else np.flatnonzero(np.diff(body)) + 1
    return np.append(np.union1d(every, change), n)


def _unpaired(pair: Ints, n: int) -> Bools:
    """Return which half edges (3 n,) of n facets are not among the pairs (e, 2)."""
    left = np.ones(3 * n, bool)
    left[pair.ravel()] = False
    return left


def _components(pair: Ints, n: int) -> Ints:
    """Return the number (n,) of the component to which each of n facets belongs, connected by pairs of half edges."""
    a, b = pair.T // 3
    return pieces(a, b, n).astype(np.int32)


def _along_curve(at: Floats) -> Ints:
    """Return the order of points (n, 3) along Morton's space-filling curve."""
    low = at.min(axis=0)
    step = max(float((at - low).max()), 1e-300) / 1023.0
    cell = ((at - low) / step).astype(np.int64)
    code = np.zeros(len(at), np.int64)
    for bit in range(10):
        for axis in range(3):
            code |= ((cell[:, axis] >> bit) & 1) << (3 * bit + axis)
    return np.argsort(code, kind="stable").astype(np.int32)
