"""Contributions: upper bounds of tubes are weighed against the field that a launch has found at the same length."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.em.phase_integral import quadratic_means
from raychan.parallel import parallel_for
from raychan.tracing.radiation import Phases
from raychan.tracing.tubes import Refinement
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]

_MANY = 4096  # tubes from which on pruning pays; not measured
_THREADS = 1000  # tubes from which on a second thread pays; not measured
_NOTHING = 1e-100  # 1/m
_DEPTH = 1e-2  # of the strongest cell: without noise weaker cells are refined as if they held this; not measured
SHARE = 0.3  # of the prune threshold: what all pruned tubes may add up to in phase; not measured
# Of the floor: what tubes on one body that leave no route may add up to in a stretch `rule.cell`. It trades routes for
# noise: with 0.03 of the noise 43 % of urban's first routes at 3 dB go, and no cell of its map changes by more than
# 0.15 of its noise; with 0.1, 59 % and 0.39; with 0.3, 75 % and 1.3 (command not kept).
_SILENT = 0.05
# Of what one tube may change: edges of facets divide what is reflected about a specular point. With 1 an echo of 43 dB
# over a sphere and a box is lost from 1 dB on (tests/run/test_echoes_over_two_spheres.py); it costs 3 % of the CPU of
# an urban frame.
_PART = 0.3
# Of the size of parts that cancel: what is left of them counts as at least so much, lest tubes be cut without end in a
# null; not measured.
_LEFT = 0.03
_SOME = 256  # tubes from which on leaving out those pays; not measured


CUTS, RAYS, BEGUN, BEFORE = 0, 1, 2, 3
"""Of the account of a budget, for kernels: cuts made; rays cast by this thread, when the budget was first asked (-1: it
was not), and when the account was made."""


def added(a: NDArray[np.int64], b: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the sum of counts (n,) and (m,), the shorter ones filled up with zeros."""
    if not len(b):
        return a
    n = max(len(a), len(b))
    return np.pad(a, (0, n - len(a))) + np.pad(b, (0, n - len(b)))


class Budget:
    """How often a launch may still cut tubes, and the tubes that were left coarser than asked for."""

    def __init__(self, rule: Refinement) -> None:
        self.rule = rule
        self._tubes, self._cuts, self._rays = 0, 0.0, -1
        self.uncut = np.zeros(0, np.int64)
        """Tubes (bodies,) that budgets kept from being subdivided."""

    def affords_phase(self, geometry: Geometry, facet: Ints, wanted: Bools) -> Bools:
        """Return which tubes (n,) on facets (n,) may be bisected for their phase: none once there are
        `rule.max_tubes`."""
        self._tubes += len(wanted)
        return self._within(geometry, facet, wanted, self._tubes > self.rule.max_tubes)

    def affords(self, geometry: Geometry, facet: Ints, wanted: Bools, weight: float = 1.0) -> Bools:
        """Return which tubes (n,) may be subdivided for visibility: none once `rule.max_cuts` are made, each counted by
        its weight, or `rule.max_rays` cast by this launch; `wanted` itself where all may."""
        rest = 0.0 if self.spent(geometry) else (self.rule.max_cuts - self._cuts) / weight
        count = np.count_nonzero(wanted)
        self._cuts += weight * count
        if count <= rest:
            return wanted
        within = wanted & (np.cumsum(wanted) <= rest)
        return within | self._within(geometry, facet, wanted & ~within, True)

    def spent(self, geometry: Geometry) -> bool:
        """Tell whether the budgets for visibility are spent."""
        if self._rays < 0:
            self._rays = geometry.rays
        return self._cuts > self.rule.max_cuts or geometry.rays - self._rays > self.rule.max_rays

    def part(self, geometry: Geometry, share: float) -> Budget:
        """Return a budget of its own with a share of what is left, for tubes that are traced beside others."""
        cast = geometry.rays - self._rays if self._rays >= 0 else 0
        left = replace(
            self.rule,
            max_tubes=int(max(share * (self.rule.max_tubes - self._tubes), 0)),
            max_cuts=max(share * (self.rule.max_cuts - self._cuts), 0.0),
            max_rays=max(share * (self.rule.max_rays - cast), 0.0),
        )
        return Budget(left)

    def take_back(self, part: Budget) -> None:
        """Count what a part was spent for."""
        self._tubes, self._cuts = self._tubes + part._tubes, self._cuts + part._cuts
        self.uncut = added(self.uncut, part.uncut)

    def account(self, geometry: Geometry) -> Floats:
        """Return what is spent (4,), for kernels."""
        return np.array([self._cuts, geometry.rays, self._rays, geometry.rays], float)

    def settle(self, geometry: Geometry, account: Floats, uncut: NDArray[np.int64]) -> None:
        """Take over what kernels spent, and the tubes (b,) of bodies that they left uncut."""
        self._cuts, self._rays = float(account[CUTS]), int(account[BEGUN])
        geometry.count_rays(int(account[RAYS] - account[BEFORE]))
        if uncut.any():
            self._left_uncut(geometry, uncut)

    def _left_uncut(self, geometry: Geometry, count: NDArray[np.int64]) -> None:
        self.uncut = added(self.uncut, count)
        geometry.count_uncut(int(count.sum()))

    def _within(self, geometry: Geometry, facet: Ints, wanted: Bools, spent: bool) -> Bools:
        if not spent or not wanted.any():
            return wanted
        bodies = geometry.facets.body[facet[wanted]]
        self._left_uncut(geometry, np.bincount(bodies, minlength=len(geometry.facets.role)))
        return np.zeros_like(wanted)


def amplitudes(ph: Phases) -> Complexes:
    """Return what tubes scatter (n,) [1/m], by the phase integral over a quadratic phase."""
    each = np.empty(len(ph.six), complex)

    def some(rows: slice) -> None:
        each[rows] = ph.in_phase[rows] * quadratic_means(ph.six[rows], 0.5)

    parallel_for(len(each), some, _THREADS)
    return each


class Contributions:
    """The scattered field [1/m] of a launch so far, in each stretch `rule.cell` [m] of two-way length.

    A tube whose upper bound is small against it is not cut further, or pruned. Where an earlier launch found how much
    it is as a whole [1/m], parts that cancel count as no more.
    """

    def __init__(self, rule: Refinement, budget: Budget | None = None, whole: float = np.inf) -> None:
        self.rule = rule
        self.budget = budget or Budget(rule)
        self._level = np.zeros(1)
        self._whole = whole

    def forked(self, geometry: Geometry, share: float) -> Contributions:
        """Return a copy that starts from the field found so far and goes on by itself, with a share of the budget."""
        other = Contributions(self.rule, self.budget.part(geometry, share), self._whole)
        other._level = self._level.copy()
        return other

    def joined(self, others: Iterable[Contributions]) -> None:
        """Add what copies found, and take their budgets back."""
        for other in others:
            own, its = self._level, other._level
            self._level = np.zeros(max(len(own), len(its)))
            self._level[: len(own)] = own
            np.maximum(self._level[: len(its)], its, out=self._level[: len(its)])
            self.budget.take_back(other.budget)

    def frozen(self, budget: Budget) -> Contributions:
        """Return the field found so far as what another launch, by the rule of its budget, starts from."""
        other = Contributions(budget.rule, budget, self._whole)
        other._level = self._level.copy()
        return other

    def _cell(self, length: Floats) -> NDArray[np.int64]:
        return np.asarray(np.maximum(length / self.rule.cell, 0.0), np.int64)

    def prune_threshold(self, length: Floats) -> Floats:
        """Return the contribution [1/m] below which tubes of two-way lengths (n,) [m] are not cut further; about a
        hundred such tubes add up to `rule.relative` of the field found there."""
        return self._in_cells(self.rule.floor, 0.1 * self.rule.relative)[self._cell_held(length)]

    def deep_threshold(self, length: Floats) -> Floats:
        """Return the contribution [1/m] (n,) below which tubes that bounced are not cut: where the rule is coarse, what
        alone would not make a detection nor change what was found by more than a good part of the tolerance: what is
        not cut is missed where its centre is hidden."""
        return self.deep_thresholds[self._cell_held(length)]

    @property
    def deep_thresholds(self) -> Floats:
        """The `deep_threshold` of each cell; the last one holds for all longer paths, too."""
        coarse, relative = self.rule.coarse, self.rule.relative
        if coarse == 1.0:
            return self._in_cells(self.rule.floor, 0.1 * relative)
        return self._in_cells(coarse * self.rule.floor, relative)

    def specular_threshold(self, length: Floats) -> Floats:
        """Return the `specular_thresholds` (n,) of two-way lengths (n,) [m]."""
        return self.specular_thresholds[self._cell_held(length)]

    @property
    def specular_thresholds(self) -> Floats:
        """The contribution [1/m] in each cell from which on counts what a curved surface reflects at a specular point,
        or a part of it."""
        return self._in_cells(self.rule.specular, _PART * self.rule.relative)

    def _in_cells(self, least: float, relative: float) -> Floats:
        """Return for each cell a share of what was found there, or the least contribution that counts."""
        level = np.maximum(self._level, _DEPTH * self._level.max())
        level = np.minimum(level, np.maximum(self._whole, _LEFT * level))
        return np.maximum(max(least, _NOTHING), relative * level)

    def _cell_held(self, length: Floats) -> NDArray[np.int64]:
        return np.minimum(self._cell(length), len(self._level) - 1)

    def add(self, ph: Phases, each: Complexes | None = None) -> None:
        """Add tubes that are seen: in each cell the sum of their amplitudes, or their rms sum where that cancels.

        Args: each (n,) amplitude, where `amplitudes` gave them already.
        """
        if not len(ph.six):
            return
        each = amplitudes(ph) if each is None else each
        cell = self._cell(ph.length)
        # One more cell at the end, which stays empty, for all longer paths.
        n = max(len(self._level), int(cell.max()) + 3)
        whole = np.hypot(np.bincount(cell, each.real, n), np.bincount(cell, each.imag, n))
        size = np.maximum(whole, np.sqrt(np.bincount(cell, np.abs(each) ** 2, n)))
        if np.isfinite(self.rule.cell):
            # A window spreads each return over its neighbours.
            beside = np.maximum(np.append(size[1:], 0.0), np.append(0.0, size[:-1]))
            size = np.maximum(size, self.rule.beside * beside)
        self._level = np.maximum(size, np.pad(self._level, (0, n - len(self._level))))
        if not np.isfinite(self.rule.cell):
            self._level = self._level[:1]

    def that_count(self, bound: Floats, length: Floats, many: int = _MANY) -> NDArray[np.intp]:
        """Return the tubes to keep: of `many` or more, the weakest of each cell are pruned while their sum in phase
        stays under 0.3 of the prune threshold."""
        if len(bound) < many:
            return np.arange(len(bound))
        share = bound / self.prune_threshold(length)
        # The weakest few are enough: none that alone exceeds the sum is looked at.
        weak = np.flatnonzero(share < SHARE)
        share, cell = share.take(weak), self._cell(length.take(weak))
        # Numbers of two bytes or less are sorted in linear time.
        order = np.lexsort((share, cell.astype(np.min_scalar_type(cell.max(initial=0)))))
        running, count = np.cumsum(share.take(order)), np.bincount(cell)
        running -= np.repeat(np.append(0.0, running).take(np.cumsum(count) - count), count)
        keep = np.ones(len(bound), bool)
        keep[weak.take(order[running <= SHARE])] = False
        return np.flatnonzero(keep)

    def leaves_out(self, count: int) -> bool:
        """Tell whether any of so many tubes may leave no route (see `that_return`)."""
        return count >= _SOME and _SILENT * self.rule.floor > 0.0

    def that_return(self, each: Complexes, length: Floats, body: NDArray[np.int16]) -> NDArray[np.intp]:
        """Return the tubes (n,) whose routes are kept: on each body (n,) and in each cell without the weakest, as long
        as neither the sum of what these scatter nor its rms sum exceeds a small part of the floor.

        Args: each (n,) [1/m] what a tube scatters; length (n,) [m] of the two-way paths.
        """
        if not self.leaves_out(len(body)):
            return np.arange(len(body))
        limit = _SILENT * self.rule.floor
        size = np.abs(each)
        weak = np.flatnonzero(size <= limit)
        cell = self._cell(length.take(weak)) * (int(body.max()) + 1) + body.take(weak)
        order = np.lexsort((size.take(weak), cell))
        weak, first = weak.take(order), np.flatnonzero(np.diff(cell.take(order), prepend=-1))
        return np.delete(np.arange(len(body)), weak[_first_within(each.take(weak), first, limit)])


def _first_within(each: Complexes, first: NDArray[np.intp], limit: float) -> Bools:
    """Return of amplitudes (n,), groups of which begin at `first` (g,), those of each group from its first one on, as
    many as neither their sum nor its rms sum exceeds the limit of."""
    size = np.diff(np.append(first, len(each)))

    def running(x: NDArray[Any]) -> NDArray[Any]:
        whole = np.cumsum(x)
        return whole - np.repeat(whole.take(first) - x.take(first), size)

    sums = np.maximum(np.abs(running(each)), np.sqrt(np.maximum(running(np.abs(each) ** 2), 0.0)))
    row = np.arange(len(each))
    last = np.maximum.reduceat(np.where(sums <= limit, row, -1), first) if len(first) else first
    return row <= np.repeat(last, size)
