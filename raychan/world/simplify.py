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
from raychan.geometry.half_edges import Net, by_first_use, followed, leaving, lock, pair_up
from raychan.parallel import parallel_for
from raychan.world.mesh import Mesh
from raychan.world.surface_check import Check

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
_ENOUGH = 0.9  # of the facets left by the rounds: with more, no others are tried
_TOO_MANY = 0.75  # of the facets left by rounds that failed: with more, the surface is not known better than that
_HALF = 0.5  # of the facets left at the end, or by the first rounds: with more it does not pay
_SLABS = 4  # parts of the mesh that threads work on
_FLIPS = 2  # passes of edge flips after them; not measured
# Of the points, 1 in so many is checked while all are nearer than far, and all at the end. It takes 0.8 times the CPU
# (spheres of 328,000 and 1.3e6 facets at 0.5 dB, one thread, load 6 of others: 0.59 and 0.69 s, 2.3 and 2.9 s); 4 takes
# 0.67 and 2.2 s, 64 0.51 and 2.2 s.
_FEW = 16


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
    whole, height = _net(mesh, fixed)
    convex = _convex(mesh, height)
    sag = sag_alone if sag_alone > 0.0 and convex else limits.sag
    for few in (_FEW, 1):
        rounds = _Rounds(whole, limits._replace(sag=sag), few)
        live = len(mesh.faces)
        while rounds.checked():
            left = len(rounds.net.faces)
            if left > _ENOUGH * live:
                break
            live = left
        if len(rounds.net.faces) > _HALF * len(mesh.faces):
            return None
        if rounds.all_checked():
            break
    net, corner = rounds.net, rounds.corner[rounds.net.corner]
    used, faces = np.unique(net.faces, return_inverse=True)
    coarse = Mesh(
        vertices=net.v[used],
        faces=faces.reshape(-1, 3).astype(np.int32),
        part=mesh.part[rounds.facet],
        part_names=mesh.part_names,
        normals=np.ascontiguousarray(net.n[net.corner]),
        report=mesh.report,
        part_materials=mesh.part_materials,
    )
    # What is convex stays so, although facets may meet in grooves of micrometres.
    coarse.__dict__["topology"] = replace(coarse.topology, convex=convex)
    merged = (corner != 3 * rounds.facet[:, None] + np.arange(3)).any(axis=1)
    return Simplified(coarse, corner, merged, rounds.deviation, sag, rounds.home)


def _convex(mesh: Mesh, height: float) -> bool:
    """Return whether a mesh is closed, of one piece and convex, as in `mesh_topology`, given by how far facets rise
    over their neighbours' planes [m]: of k such pieces the vertices less half the facets are 2 k (Euler)."""
    size = float(np.linalg.norm(np.ptp(mesh.bounds, axis=0)))
    return height < 1e-9 * (1.0 + size) and 2 * len(mesh.vertices) - len(mesh.faces) == 4


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

    Fields: net what is left of the whole mesh, all within the limits; vertex (k,), facet (m,), corner (3 m,) its
    numbers in the whole mesh; home (n,) the facet on which the centre of each facet of the whole mesh lies; deviation
    [m] of the points checked.
    """

    def __init__(self, whole: Net, limits: Limits, few: int) -> None:
        """Begin with a whole mesh; few: the check of every so manieth point serves where all are near."""
        n, self.net, self.deviation = len(whole.faces), whole, 0.0
        self.vertex, self.facet, self.corner = np.arange(len(whole.v)), np.arange(n), np.arange(3 * n, dtype=np.int32)
        self.home = np.arange(n, dtype=np.int32)
        self._limits, self._stage, self._turn, self._far = limits, 0, 0, True
        self._whole, self._few, self._checks, self._checked = whole, few, dict[int, Check](), True
        some = whole.v[:: max(1, len(whole.v) // 10_000)]
        self._ends = np.quantile(some, np.arange(1, _SLABS) / _SLABS, axis=0)

    def checked(self) -> bool:
        """Do some rounds, and tell whether the net is within the limits after them; else points stay off however often
        the rounds are done again, and it is as it was."""
        self._stage += 1
        slabs = [self._slabs(axis) for axis in range(3)]
        for redo in range(_REDOS):
            now = self.net.copied()
            # The same slabs in every redo, so that it differs only where edges were shortened.
            for i in range(_MANY_ROUNDS if self._far else _ROUNDS):
                self._remove(now, slabs[(self._stage + i) % 3])
            live, heir = np.flatnonzero(now.faces[:, 0] >= 0), followed(now.heir)
            for i in range(_FLIPS):
                self._flip(now, live, slabs[(self._stage + i) % 3][0])
            for every in (self._few, 1) if self._far else (1,):
                off, most = self._check(every)(now, heir, self._limits)
                if most < _FAR or most > 1.0:
                    break
            if not most > 1.0:
                self._far, self.deviation = most < _FAR, off
                self._take(now, heir, every)
                return True
            if self._far:
                self._far = False
                continue
            if len(live) > _TOO_MANY * len(self.net.faces):
                return False
            self._check(1).shorten(self.net, now, self.vertex, redo < _SHRINKS)
        return False

    def all_checked(self) -> bool:
        """Tell whether all points are within the limits; find the deviation and the home of each facet."""
        check = self._check(1)
        if not self._checked:
            self.deviation, most = check(self.net, self.net.heir, self._limits)
            if most > 1.0:
                return False
            check.taken(self.net.heir, self.net.heir)
        self.home[check.rows] = check.home
        return True

    def _check(self, every: int) -> Check:
        """Return the check of all points or of every so manieth, made when it is first used."""
        if every not in self._checks:
            self._checks[every] = Check(self._whole, self.home, every)
        return self._checks[every]

    def _take(self, now: Net, heir: Ints, every: int) -> None:
        """Go on with a net of which the last heirs (m,) are given, after a check of every so manieth point."""
        self.net, live, stays = now.packed()
        number = np.zeros(len(now.faces), np.int32)
        number[live] = np.arange(len(live))
        then = number[heir]
        for kept, check in self._checks.items():
            check.taken(then, number if kept == every else None)
        self._checked = every == 1
        self.home = then[self.home]
        self.vertex, self.facet = self.vertex[stays], self.facet[live]
        self.corner = self.corner[now.corner[live].ravel()]

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
