"""Finely tessellated smooth surfaces are simplified, so that tracing costs what a body's shape asks for and not what
its tessellation does.

Vertices inside smooth patches go as long as the curved facets (Nagata patches) through the rest stay near the curved
facets of the whole mesh. Every vertex that goes, and the centre of every facet, is checked against them in place and
normal, so that nothing is smoothed more than it was.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from raychan.geometry.collapses import Limits, remove_vertices
from raychan.geometry.flips import flip_edges
from raychan.geometry.half_edges import Net, lock_pinched, mates
from raychan.geometry.patch_offsets import offsets
from raychan.geometry.triangles import edge_curvatures
from raychan.parallel import parallel_for
from raychan.world.mesh import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]

_LONGEST = 0.3  # m: longest edge, that of the longest tubes (tracing.settings); a longer one saves nothing
# Measured on a sphere, a torus and an ellipsoid of 160,000 to 330,000 facets at 0.05 to 0.5 dB (command not noted).
_ROUNDS = 3  # between checks: more miss by more, fewer check more often; 5 leave up to 5 % more or fewer facets
_MANY_ROUNDS = 5  # the same first, and where all points of the last check were nearer than
_FAR = 0.05  # of the limits: edges double in five rounds, and deviations grow by up to 16
_REDOS = 16  # of rounds that failed their check: where one fails once more, they are not taken
_SHRINKS = 10  # of them, that allow shorter edges where a check failed; the others allow no new ones there
_SHRINK = 0.4, 0.85  # least and largest factor on edges where a check failed
_ORDER = 3.0  # power of the edge with which curved facets deviate, at least (Nagata 2005)
_ENOUGH = 0.9  # of the facets left by the rounds: with more, no others are tried
_TOO_MANY = 0.75  # of the facets left by rounds that failed: with more, the surface is not known better than that
_HALF = 0.5  # of the facets left at the end, or by the first rounds: with more it does not pay
_SLABS = 4  # parts of the mesh that threads work on
_FLIPS = 2  # passes of edge flips after them; not measured
# Largest deviation anywhere on a facet over that of the points checked: 1.53 at most on spheres and tori of 20,000 to
# 100,000 facets at 0.05 to 1 dB, against their closed forms (command not noted).
_BETWEEN = 1.6
_BATCH = 8192  # facets whose centres are found at once: bounds memory


@dataclass(frozen=True, eq=False)
class Simplified:
    """A simplified mesh.

    Fields: mesh; corner (f, 3) corners 3 g + k of facets g of the whole mesh that the facets have; merged (f,) which of
    them stand for several; deviation [m] largest distance of the whole mesh's curved surface from that of this one; sag
    [m] by which its flat facets may lie under its curved ones; home (n,) the facet on which the centre of each facet of
    the whole mesh lies.
    """

    mesh: Mesh
    corner: Ints
    merged: Bools
    deviation: float
    sag: float
    home: Ints


def simplify(mesh: Mesh, limits: Limits, fixed: Bools, sag_alone: float = 0.0) -> Simplified | None:
    """Return a mesh simplified within limits; None where it would have more than half of the facets.

    Args: fixed (f,) facets that stay as they are; sag_alone [m] in place of the limits' if the mesh is convex, above 0.
    """
    net, height = _net(mesh, fixed)
    convex = _convex(mesh, height)
    sag = sag_alone if sag_alone > 0.0 and convex else limits.sag
    check, rounds, deviation = _Check(net), _Rounds(mesh, limits._replace(sag=sag)), 0.0
    live = len(mesh.faces)
    while True:
        found = rounds.checked(net, check)
        if found is None:
            break
        left = int(np.count_nonzero(found[0].faces[:, 0] >= 0))
        net, check.facet, deviation = found
        if left > _ENOUGH * live:
            break
        live = left
    if live > _HALF * len(mesh.faces):
        return None
    rows = np.flatnonzero(net.faces[:, 0] >= 0)
    used, faces = np.unique(net.faces[rows], return_inverse=True)
    corner = net.corner[rows]
    coarse = Mesh(
        vertices=mesh.vertices[used],
        faces=faces.reshape(-1, 3).astype(np.int32),
        part=mesh.part[rows],
        part_names=mesh.part_names,
        normals=np.ascontiguousarray(net.n[corner]),
        report=mesh.report,
        part_materials=mesh.part_materials,
    )
    # What is convex stays so, although facets may meet in grooves of micrometres.
    coarse.__dict__["topology"] = replace(coarse.topology, convex=convex)
    merged = (corner != 3 * rows[:, None] + np.arange(3)).any(axis=1)
    number = np.zeros(len(mesh.faces), np.int32)
    number[rows] = np.arange(len(rows))
    return Simplified(coarse, corner, merged, deviation, sag, number[check.home()])


def _convex(mesh: Mesh, height: float) -> bool:
    """Return whether a mesh is closed, of one piece and convex, as in `mesh_topology`, given by how far facets rise
    over their neighbours' planes [m]: of k such pieces the vertices less half the facets are 2 k (Euler)."""
    size = float(np.linalg.norm(np.ptp(mesh.bounds, axis=0)))
    return height < 1e-9 * (1.0 + size) and 2 * len(mesh.vertices) - len(mesh.faces) == 4


def _net(mesh: Mesh, fixed: Bools) -> tuple[Net, float]:
    """Return a mesh ready to be simplified: only vertices inside smooth patches, of facets not fixed, are not locked;
    and how far facets rise over their neighbours' planes [m]."""
    faces, count = np.array(mesh.faces, np.int32), len(mesh.vertices)
    mate, inside, height = mates(mesh.vertices, faces, mesh.normals, mesh.part, fixed)
    n = len(faces)
    net = Net(
        v=mesh.vertices,
        n=mesh.normals.reshape(-1, 3),
        faces=faces,
        corner=np.arange(3 * n, dtype=np.int32).reshape(-1, 3),
        mate=mate,
        half=np.zeros(count, np.int32),
        heir=np.arange(n, dtype=np.int32),
        locked=~inside,
        gone=np.zeros(count, bool),
        reach=np.full(count, _LONGEST),
        touched=np.zeros(count, np.int32),
        tried=np.zeros(count, np.int32),
    )
    lock_pinched(net)
    return net, float(height)


class _Rounds:
    """Rounds of removals, numbered on, each on slabs of the mesh across another axis."""

    def __init__(self, mesh: Mesh, limits: Limits) -> None:
        self.limits, self.stage, self.turn, self.far = limits, 0, 0, True
        self._slabs = []
        for place in mesh.vertices.T:
            ends = np.quantile(place[:: max(1, len(place) // 10_000)], np.arange(1, _SLABS) / _SLABS)
            slab = np.searchsorted(ends, place).astype(np.int8)
            first = np.concatenate([[0], np.cumsum(np.bincount(slab, minlength=_SLABS))])
            self._slabs.append((slab, np.argsort(slab, kind="stable"), first))

    def checked(self, net: Net, check: _Check) -> tuple[Net, Ints, float] | None:
        """Return the net after some rounds, the facet of each point of the check, and the deviation [m]; None where
        points stay off however often the rounds are done again. Edges that may come on the net are shortened."""
        self.stage += 1
        for redo in range(_REDOS):
            now = net.copied()
            # The same slabs in every redo, so that it differs only where edges were shortened.
            for i in range(_MANY_ROUNDS if self.far else _ROUNDS):
                self._remove(now, self.stage + i)
            live = np.flatnonzero(now.faces[:, 0] >= 0)
            for i in range(_FLIPS):
                self._flip(now, live, self.stage + i)
            facet, off, excess = check(now, self.limits)
            most = excess.max(initial=0.0)
            if not most > 1.0:
                self.far = most < _FAR
                return now, facet, float(off.max(initial=0.0))
            if self.far:
                self.far = False
                continue
            if np.count_nonzero(now.faces[:, 0] >= 0) > _TOO_MANY * np.count_nonzero(net.faces[:, 0] >= 0):
                return None
            check.shorten(net, now, facet, excess, redo < _SHRINKS)
        return None

    def _remove(self, net: Net, axis: int) -> None:
        """Remove vertices in one round, by slabs across an axis."""
        self.turn += 1
        slab, rows, first = self._slabs[axis % 3]

        def some(slabs: slice) -> None:
            for i in range(slabs.start, slabs.stop):
                remove_vertices(net, self.limits, self.turn, rows[first[i] : first[i + 1]], slab)

        parallel_for(_SLABS, some, 2)

    def _flip(self, net: Net, rows: NDArray[np.int64], axis: int) -> None:
        """Flip edges of facets (r,) over which they bend against the surface in one pass, by slabs across an axis."""
        slab = self._slabs[axis % 3][0]

        def some(slabs: slice) -> None:
            for i in range(slabs.start, slabs.stop):
                flip_edges(net, self.limits, self.turn, rows, slab, i)

        parallel_for(_SLABS, some, 2)


class _Check:
    """Points of the whole mesh's curved surface, vertices that may go and the centres of facets, with its normals
    there; facet (s,) of the simplified mesh on which each lies."""

    def __init__(self, net: Net) -> None:
        n = net.n.reshape(-1, 3, 3)
        home, normal = np.empty(len(net.v), np.int32), np.empty((len(net.v), 3))
        for k in range(3):
            home[net.faces[:, k]] = np.arange(len(net.faces), dtype=np.int32)
            normal[net.faces[:, k]] = n[:, k]
        self.vertex = np.flatnonzero(~net.locked)
        a, b, c = net.faces.T
        rows = np.flatnonzero(~(net.locked[a] & net.locked[b] & net.locked[c])).astype(np.int32)
        self.facet = np.concatenate([home[self.vertex], rows])
        self._rows, self._count, begin = rows, len(net.faces), len(self.vertex)
        self.place, self.normal = np.empty((len(self.facet), 3)), np.empty((len(self.facet), 3))
        self.place[:begin], self.normal[:begin] = net.v[self.vertex], normal[self.vertex]
        for i in range(0, len(rows), _BATCH):
            some, at = rows[i : i + _BATCH], slice(begin + i, begin + i + _BATCH)
            v, corner_normals = net.v[net.faces[some]], n[some]
            middle, bend = _sum(corner_normals), _sum(edge_curvatures(v, corner_normals)[0])
            self.normal[at] = middle / np.sqrt(np.einsum("ij,ij->i", middle, middle))[:, None]
            self.place[at] = _sum(v) / 3.0 - bend / 9.0

    def __call__(self, net: Net, limits: Limits) -> tuple[Ints, Floats, Floats]:
        """Return the facet of each point, how far points about it may be off [m], and how far off they are in place or
        normal over the limit."""
        live = np.flatnonzero(net.faces[:, 0] >= 0)
        number = np.zeros(len(net.faces), np.int32)
        number[live] = np.arange(len(live))
        v, n = net.v[net.faces[live]], net.n[net.corner[live]]
        patches = v, n, edge_curvatures(v, n)[0]
        facet = _followed(net.heir)[self.facet]
        off, turned = np.empty(len(facet)), np.empty(len(facet))

        def some(r: slice) -> None:
            offsets(self.place[r], self.normal[r], facet[r], patches, net.mate, number, off[r], turned[r])

        parallel_for(len(facet), some)
        off *= _BETWEEN
        return facet, off, np.maximum(off / limits.deviation, turned / limits.normal)

    def home(self) -> Ints:
        """Return the facet (n,) on which the centre of each facet of the whole mesh lies."""
        out = np.arange(self._count, dtype=np.int32)
        out[self._rows] = self.facet[len(self.vertex) :]
        return out

    def shorten(self, net: Net, failed: Net, facet: Ints, excess: Floats, some: bool) -> None:
        """Shorten the edges that may come on a net where facets of what became of it failed.

        Args: facet, excess (s,) as found on the failed net; some: whether any may come at all.
        """
        worst = np.zeros(len(net.faces))
        np.maximum.at(worst, facet, excess)
        rows = np.flatnonzero(worst > 1.0)
        corners = failed.faces[rows]
        reach = np.zeros(len(rows))
        if some:
            v = net.v[corners]
            longest = np.linalg.norm(np.roll(v, -1, axis=1) - v, axis=2).max(axis=1)
            factor = np.clip(_SHRINK[1] * worst[rows] ** (-1.0 / _ORDER), *_SHRINK)
            reach = factor * np.minimum(longest, net.reach[corners].max(axis=1))
        allowed = np.full(len(worst), np.inf)
        allowed[rows] = reach
        for k in range(3):
            np.minimum.at(net.reach, corners[:, k], reach)
        own = facet[: len(self.vertex)]
        net.reach[self.vertex] = np.minimum(net.reach[self.vertex], allowed[own])


def _sum(corners: Floats) -> Floats:
    """Return the sum (f, 3) of what facets (f, 3, 3) have at their corners."""
    return np.asarray(corners[:, 0] + corners[:, 1] + corners[:, 2])


def _followed(heir: Ints) -> Ints:
    """Return for each facet the last of its heirs."""
    while True:
        then = heir[heir]
        if np.array_equal(then, heir):
            return then
        heir = then
