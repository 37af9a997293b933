"""Finely tessellated smooth surfaces are simplified, so that tracing costs what a body's shape asks for and not what
its tessellation does.

Vertices inside smooth patches go as long as the curved facets (Nagata patches) through the rest stay near the curved
facets of the whole mesh. Every vertex that goes is checked against them in place and normal, and the centre of every
facet where few vertices lie, so that nothing is smoothed more than it was.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from raychan.geometry.collapses import Limits, remove_vertices
from raychan.geometry.contractions import contract
from raychan.geometry.flips import flip_edges
from raychan.geometry.half_edges import Net, by_first_use, followed, leaving, lock, pair_up
from raychan.parallel import parallel_for
from raychan.world.meshes.convexity import convex
from raychan.world.meshes.mesh import Mesh
from raychan.world.meshes.surface_check import Check

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]

_LONGEST = 0.3  # m: longest edge, that of the longest tubes (tracing.settings); a longer one saves nothing
# Measured on a sphere, a torus and an ellipsoid of 160,000 to 330,000 facets at 0.05 to 0.5 dB (command not noted).
_ROUNDS = 3  # between checks: more miss by more, fewer check more often; 5 leave up to 5 % more or fewer facets
# Of the deviation, what edges of contracted cells may be off, which are not chosen one by one, and its root of the sag.
# With all of the sag a sphere of 1.3e6 facets in a scene keeps 26,700 in place of 22,800.
_TIGHT = 0.25
_CELL = 2  # edges from the middle of a cell that is contracted to its rim, at most; not measured
_CONTRACTIONS = 3  # tries of them, each with shorter edges where points were off; not measured
_SOME = 0.02  # of the points, that may be off for another try; not measured
_REDOS = 16  # of rounds that failed their check: where one fails once more, they are not taken
_SHRINKS = 10  # of them, that allow shorter edges where a check failed; the others allow no new ones there
_ENOUGH = 0.9  # of the facets: rounds that leave more are not taken, and no others tried
_HALF = 0.5  # of the facets left at the end, or by the first rounds: with more it does not pay
_SLABS = 4  # parts of the mesh that threads work on
_FLIPS = 2  # passes of edge flips after them; not measured
# Of the points, 1 in so many is checked where as many facets of the whole mesh lie on each facet, and
# all at the end; not measured.
_FEW = 8
# Of the limits, until all are checked: the others were off by up to 5 % more (a sphere of 1.3e6 facets).
_CLOSER = 0.95
# Vertices on a facet, from which on the centres of facets of the whole mesh there are not checked; not measured.
_MANY = 8


@dataclass(frozen=True, eq=False)
class Simplified:
    """A simplified mesh.

    Fields: mesh; corner (f, 3) corners 3 g + k of facets g of the whole mesh that the facets have; merged (f,) which of
    them stand for several; deviation [m] largest distance of the whole mesh's curved surface from that of this one; sag
    [m] by which its flat facets may lie under its curved ones.
    """

    mesh: Mesh
    corner: Ints
    merged: Bools
    deviation: float
    sag: float


def simplify(
    mesh: Mesh, limits: Limits, fixed: Bools, sag_alone: float = 0.0
) -> tuple[Simplified, Callable[[], Ints]] | None:
    """Return a mesh simplified within limits, and what gives the facet (n,) on which the centre of each facet of the
    whole mesh lies; None where it would have more than half of the facets.

    Args: fixed (f,) facets that stay as they are; sag_alone [m] in place of the limits' if the mesh is convex, above 0.
    """
    whole, height = _net(mesh, fixed)
    alone = _convex(mesh, height)
    sag = sag_alone if sag_alone > 0.0 and alone else limits.sag
    for few in (_FEW, 1):
        rounds = _Rounds(whole, limits._replace(sag=sag), few)
        rounds.contract()
        while rounds.checked():
            pass
        if len(rounds.net.faces) > _HALF * len(mesh.faces):
            return None
        if rounds.all_checked():
            break
    net, corner = rounds.net, rounds.net.corner
    used, faces = np.unique(net.faces, return_inverse=True)
    coarse = Mesh(
        vertices=net.v[used],
        faces=faces.reshape(-1, 3).astype(np.int32),
        part=mesh.part[rounds.facet],
        part_names=mesh.part_names,
        normals=np.ascontiguousarray(net.n[corner]),
        report=mesh.report,
        part_materials=mesh.part_materials,
    )
    # What is convex stays so, although facets may meet in grooves of micrometres.
    coarse.__dict__["topology"] = replace(coarse.topology, convex=alone)
    merged = (corner != 3 * rounds.facet[:, None] + np.arange(3)).any(axis=1)
    return Simplified(coarse, corner, merged, rounds.deviation, sag), rounds.home


def _convex(mesh: Mesh, height: float) -> bool:
    """Return whether a mesh is closed, of one piece and convex, as in `mesh_topology`, given by how far facets rise
    over their neighbours' planes [m]: of k such pieces the vertices less half the facets are 2 k (Euler)."""
    closed = 2 * len(mesh.vertices) - len(mesh.faces) == 4
    return closed and convex(height, mesh.bounds, lambda: (mesh.vertices, mesh.faces))


def _net(mesh: Mesh, fixed: Bools) -> tuple[Net, float]:
    """Return a mesh ready to be simplified: only vertices inside smooth patches, of facets not fixed, are not locked;
    and how far facets rise over their neighbours' planes [m]."""
    faces, count, n = np.ascontiguousarray(mesh.faces, np.int32), len(mesh.vertices), len(mesh.faces)
    normals, mate, heights = mesh.normals.reshape(-1, 3), np.full(3 * n, -1, np.int32), list[float]()
    number, v, own = by_first_use(mesh.vertices, faces)
    left = leaving(own, count)
    half, locked = left[0][left[1][1:] - 1], np.empty(count, bool)

    def paired(r: slice) -> None:
        heights.append(pair_up(v, own, normals, mesh.part, fixed, left, r.start, r.stop, mate))

    parallel_for(n, paired)
    parallel_for(count, lambda r: lock(own, mate, half, left[1], r.start, r.stop, locked))
    net = Net(
        v=mesh.vertices,
        n=normals,
        faces=faces,
        corner=np.arange(3 * n, dtype=np.int32).reshape(-1, 3),
        mate=mate,
        half=half[number],
        heir=np.arange(n, dtype=np.int32),
        locked=locked[number],
        gone=np.zeros(count, bool),
        reach=np.full(count, _LONGEST),
        touched=np.zeros(count, np.int32),
        tried=np.zeros(count, np.int32),
    )
    return net, max(heights)


class _Rounds:
    """Rounds of removals, numbered on, each on slabs of the mesh across another axis.

    Fields: net what is left of the whole mesh, all within the limits; vertex (k,), facet (m,) its numbers in the whole
    mesh; heir (n,) the facet in whose place each facet of the whole mesh is looked for; deviation [m] of the points
    checked.
    """

    def __init__(self, whole: Net, limits: Limits, few: int) -> None:
        """Begin with a whole mesh; few: the check of every so manieth point serves where all are near."""
        n, self.net, self.deviation = len(whole.faces), whole, 0.0
        self.vertex, self.facet, self.heir = np.arange(len(whole.v)), np.arange(n), np.arange(n, dtype=np.int32)
        closer = 1.0 if few == 1 else _CLOSER
        self._limits = limits._replace(deviation=closer * limits.deviation, normal=closer * limits.normal)
        self._last, self._stage, self._turn = limits, 0, 0
        self._whole, self._few, self._checks, self._checked = whole, few, dict[int, Check](), True
        self._inside = ~whole.locked[whole.faces].all(axis=1) if whole.locked.any() else np.ones(n, bool)
        some = whole.v[:: max(1, len(whole.v) // 10_000)]
        self._ends = np.quantile(some, np.arange(1, _SLABS) / _SLABS, axis=0)

    def contract(self) -> None:
        """Contract cells as long as most vertices go; the net stays as it was where few do, or where it is off the
        limits after it however often that is done again."""
        slabs, reach = self._slabs(0), self.net.reach.copy()
        tight = self._limits._replace(deviation=_TIGHT * self._limits.deviation, sag=_TIGHT**0.5 * self._limits.sag)
        for _ in range(_CONTRACTIONS):
            now, left = self.net.copied(), len(self.net.v)
            while True:
                self._turn += 1
                went = contract(now, tight, _CELL, self._turn, slabs)
                left -= went
                if went < left:
                    break
            if left > _HALF * len(self.net.v):
                break
            heir = followed(now.heir)
            for _ in range(_FLIPS):
                self._flip(now, np.flatnonzero(now.faces[:, 0] >= 0), slabs[0])
            check = self._taken(now, heir)
            if check is None:
                return
            if check.failed > _SOME:
                break
            check.shorten(self.net, now, self.vertex, True)
        self.net.reach[:] = reach

    def checked(self) -> bool:
        """Do some rounds, and tell whether the net is within the limits after them; else points stay off however often
        the rounds are done again, and it is as it was."""
        self._stage += 1
        slabs = [self._slabs(axis) for axis in range(3)]
        for redo in range(_REDOS):
            now = self.net.copied()
            # The same slabs in every redo, so that it differs only where edges were shortened.
            for i in range(_ROUNDS):
                self._remove(now, slabs[(self._stage + i) % 3])
            live, heir = np.flatnonzero(now.faces[:, 0] >= 0), followed(now.heir)
            if len(live) > _ENOUGH * len(self.net.faces):
                return False
            for i in range(_FLIPS):
                self._flip(now, live, slabs[(self._stage + i) % 3][0])
            check = self._taken(now, heir)
            if check is None:
                return True
            check.shorten(self.net, now, self.vertex, redo < _SHRINKS)
        return False

    def all_checked(self) -> bool:
        """Tell whether all points are within the limits; find the deviation."""
        if self._checked:
            return True
        vertices = Check(self._whole, self.heir, np.flatnonzero(~self._whole.locked), np.zeros(0, np.intp))
        off, most = vertices(self.net, self.net.heir, self._last)
        sparse = np.bincount(vertices.found, minlength=len(self.net.faces)) < _MANY
        centres = Check(self._whole, self.heir, np.zeros(0, np.intp), np.flatnonzero(self._inside & sparse[self.heir]))
        far, worst = centres(self.net, self.net.heir, self._last)
        self.deviation = max(off, far)
        return max(most, worst) <= 1.0

    def home(self) -> Ints:
        """Return the facet (n,) on which the centre of each facet of the whole mesh lies."""
        inside, out = np.flatnonzero(self._inside), self.heir.copy()
        centres = Check(self._whole, self.heir, np.zeros(0, np.intp), inside)
        centres(self.net, self.net.heir, self._limits)
        out[inside] = centres.found
        return out

    def _check(self, every: int) -> Check:
        """Return the check of all points or of every so manieth, made when it is first used."""
        if every not in self._checks:
            vertex, rows = np.flatnonzero(~self._whole.locked)[::every], np.flatnonzero(self._inside)[::every]
            self._checks[every] = Check(self._whole, self.heir, vertex, rows)
        return self._checks[every]

    def _taken(self, now: Net, heir: Ints) -> Check | None:
        """Go on with a net of which the last heirs (m,) are given, if it is within limits that are a little closer;
        else return the check that it failed."""
        # From step to step fewer facets are left: once some points serve, they serve all along.
        every = self._few if len(self.heir) > self._few * int((now.faces[:, 0] >= 0).sum()) else 1
        check = self._check(every)
        off, most = check(now, heir, self._limits)
        if most > 1.0:
            return check
        self.deviation = off
        self.net, live, stays = now.packed()
        number = np.zeros(len(now.faces), np.int32)
        number[live] = np.arange(len(live))
        then = number[heir]
        for kept, check in self._checks.items():
            check.taken(then, number if kept == every else None)
        self._checked = every == 1
        self.heir = then[self.heir]
        self.vertex, self.facet = self.vertex[stays], self.facet[live]
        return None

    def _slabs(self, axis: int) -> tuple[NDArray[np.int8], NDArray[np.intp], NDArray[np.intp]]:
        """Return the slab (k,) across an axis of each vertex, and the vertices that may go by slab, and where each of
        these begins."""
        slab = np.searchsorted(self._ends[:, axis], self.net.v[:, axis]).astype(np.int8)
        order = np.argsort(slab, kind="stable")
        rows = order[~self.net.locked[order]]
        return slab, rows, np.searchsorted(slab[rows], np.arange(_SLABS + 1))

    def _remove(self, net: Net, slabs: tuple[NDArray[np.int8], NDArray[np.intp], NDArray[np.intp]]) -> None:
        """Remove vertices in one round, by slabs."""
        self._turn += 1
        slab, rows, first = slabs

        def some(r: slice) -> None:
            for i in range(r.start, r.stop):
                remove_vertices(net, self._limits, self._turn, rows[first[i] : first[i + 1]], slab)

        parallel_for(_SLABS, some, 2)

    def _flip(self, net: Net, rows: NDArray[np.intp], slab: NDArray[np.int8]) -> None:
        """Flip edges of facets (r,) over which they bend against the surface in one pass, by slabs."""
        mine = slab[net.faces[rows, 0]]

        def some(r: slice) -> None:
            for i in range(r.start, r.stop):
                flip_edges(net, self._limits, self._turn, rows[mine == i], slab, i)

        parallel_for(_SLABS, some, 2)
