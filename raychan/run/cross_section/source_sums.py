"""The amplitudes of a body by source over several launches: how far off they may be, and which sources to refine."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from raychan.channel.error import COVER
from raychan.run.cross_section.scattering import BySource
from raychan.tracing.sources import Sources, depth_of, facet_of

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Ints = NDArray[np.int64]
_Kind = TypeVar("_Kind", bound=np.generic)

_SHRINKS = COVER / (1.0 + COVER)
"""Of two changes in a row, the later over the earlier: COVER times the last change covers all that a series of changes
that shrink by this still brings."""
# Times the change before. Of changes that scatter, taken as unrelated, one in ten grows by as much (the ratio of two
# exponential powers exceeds 9); where launches miss the same part, the first that finds some of it grows by more.
_GROWN = 3.0
_WEIGHT = 1.5  # of a launch in a mean over one of the rule before: changes that do not die out shrink by about 0.8 a
# rule (bodies of primitives, a person and a traffic light, 3 views each; command not noted)
# Rays of the next rule over those of this: median of rules 1 to 6 of 19 sources, 1.3 to 2.2 in eight of ten (see
# `_WEAKER` in rcs_refinement).
_GROWTH = 1.5
_LEAST = 4.0  # rays of a source, those of one tube: one that was hidden in the newest launch may be seen in the next
# Of what the best source brings for a ray, below which others wait: trades launches for rays. At 0.3 as many views
# reach 0.5 dB, by two thirds more launches (a person, a traffic light, random bodies c1 and c4, seed 7703, 6 views
# each, as in `python -m bench.cross_section` without what the mesh leaves open)
_WORTH = 0.1
_LEVEL = 0.995  # one-sided share of Student's t: 99 % of both sides, as COVER is meant to cover
_SIGMAS = 2.576  # the same of a normal variable, in standard deviations


@dataclass(frozen=True)
class SourceSums:
    """The amplitudes of each source over the launches so far.

    Tubes whose phase or outline is not yet resolved scatter from lattice to lattice: changes turn round and hardly
    shrink. Their mean over launches falls faster than a finer launch brings; where changes shrink, or go on in one
    sense (a bias of size), the newest launch counts alone.

    Fields: sums by source; `last` (s,) [m] what the newest launch gave, `change` (s,) from the one before; `doubt_of`
    (s,) [m] how far off the sums may be: the last changes, of means the standard error of one component; `rule` (s,) of
    the newest launch, `launches` (s,) so far; `mean` (4, s) of sums of weights, their squares, weighted powers [m^2],
    and launches; `scatters` (s,) which are means.
    """

    sums: BySource
    element: tuple[int, int]
    last: Complexes
    change: Complexes
    doubt_of: Complexes
    rule: Ints
    launches: Ints
    mean: Floats
    scatters: NDArray[np.bool_]

    @staticmethod
    def of(before: BySource, after: BySource, element: tuple[int, int], rule: int) -> SourceSums:
        """Return the sums of two whole launches; element the row and column of the polarisation."""
        new, old = (
            BySource.join([a, replace(b, amplitude=0.0 * b.amplitude, rays=0.0 * b.rays)])
            for a, b in ((after, before), (before, after))
        )
        last = new.amplitude[:, element[0], element[1]]
        change, n = last - old.amplitude[:, element[0], element[1]], len(last)
        rules, launched = np.full(n, rule), np.full(n, rule + 1)
        return SourceSums(new, element, last, change, change, rules, launched, np.zeros((4, n)), np.zeros(n, bool))

    @property
    def value(self) -> complex:
        """The amplitude [m] of the polarisation asked for."""
        row, col = self.element
        return complex(self.sums.amplitude[:, row, col].sum())

    def off(self, cover: float) -> float:
        """Return how far off [m] the sum may be, by `cover` times the last changes, in phase as they are or of
        unrelated phases, and by what covers 99 % of the means, more standard deviations where few launches tell these.

        Means err in amplitude and phase alike, and only the component along the sum changes its level.
        Source: Welch, Biometrika 34, 1947: degrees of freedom of a sum of variances.
        """
        changes, means = self.doubt_of[~self.scatters], np.abs(self.doubt_of[self.scatters]) ** 2
        off = cover * max(abs(changes.sum()), np.linalg.norm(changes))
        if not means.any():
            return float(off)
        # A complex amplitude of n launches has 2 (n - 1).
        freedom = means.sum() ** 2 / (means**2 / (2.0 * (self.mean[3, self.scatters] - 1.0))).sum()
        return float(np.hypot(off, stdtrit(freedom, _LEVEL) * np.sqrt(means.sum())))

    @property
    def next_rule(self) -> Ints:
        """The rule (s,) by which to trace each source again: a mean takes two launches of each."""
        return np.asarray(self.rule + (~self.scatters | (self.launches % 2 == 0)))

    @property
    def next_rays(self) -> Floats:
        """How many rays (s,) that takes, about."""
        return np.asarray(np.maximum(self.sums.rays, _LEAST) * np.where(self.next_rule > self.rule, _GROWTH, 1.0))

    @property
    def _pair(self) -> Ints:
        """The number (s,) of each source's facet and bounces: both directions are refined together, so that an exchange
        of both ends changes nothing."""
        source = self.sums.source
        return np.asarray(np.unique(depth_of(source) << 32 | facet_of(source), return_inverse=True)[1])

    def to_refine(self, cover: float, leave: float, most: float, rules: int) -> Ints:
        """Return the sources, as row numbers, that are most off for the rays that they take, of those that count.

        Args: cover as for `off`; leave [m] by which all others may be off, in phase as they are and as if of unrelated
        phases; most rays that the next launch may take; rules that there are: none goes on beyond the last.
        """
        pair = self._pair
        off = self.doubt_of * np.where(self.scatters, _SIGMAS, cover)
        power, rays, real, imaginary, ended = (
            np.bincount(pair, x)
            for x in (np.abs(off) ** 2, self.next_rays, off.real, off.imag, self.next_rule >= rules)
        )
        # Those first that are most off for what they cost.
        gain = power / rays
        order = np.argsort(gain, kind="stable")
        first = _first(order, (real, imaginary, power), leave)
        # Where no source stands out all are refined.
        best = order[first if first < len(order) else 0 :][::-1]
        best = best[(rays[best] <= most) & (ended[best] == 0.0)]
        best = best[gain[best] >= _WORTH * gain[best[:1]]]
        return np.flatnonzero(np.isin(pair, best[np.cumsum(rays[best]) <= most]))

    def to_confirm(self, leave: float, most: float) -> Ints:
        """Return the sources, as row numbers, of which two launches alone tell, but for the weakest: two may miss the
        same hidden part. Args: as for `to_refine`."""
        row, col = self.element
        pair, brings = self._pair, self.sums.amplitude[:, row, col]
        power, rays, real, imaginary, launched = (
            np.bincount(pair, x)
            for x in (np.abs(brings) ** 2, self.next_rays, brings.real, brings.imag, self.launches > 2)
        )
        order = np.argsort(power, kind="stable")
        best = order[_first(order, (real, imaginary, power), leave) :][::-1]
        best = best[launched[best] == 0.0]
        return np.flatnonzero(np.isin(pair, best[np.cumsum(rays[best]) <= most]))

    def groups(self, rows: Ints) -> Iterator[tuple[int, int, Sources]]:
        """Give the sources of some rows by the rule and the number of their next launch."""
        key = np.stack([self.next_rule[rows], self.launches[rows]])
        for rule, launch in np.unique(key, axis=1).T:
            yield int(rule), int(launch), self.sums.source[rows[(key == [[rule], [launch]]).all(axis=0)]]

    def joined(self, rows: Ints, parts: list[BySource]) -> SourceSums:
        """Return the sums with a further launch of the sources of some rows."""
        again, (row, col), k = BySource.join(parts), self.element, len(rows)
        place = np.full(len(self.last), -1)
        place[rows] = np.arange(k)
        at = place[np.searchsorted(self.sums.source, again.source)]
        new, rays = np.zeros((k, 2, 2), complex), np.zeros(k)
        new[at], rays[at] = again.amplitude, again.rays
        rule, old = self.next_rule[rows], self.sums.amplitude[rows]
        change, before = new[:, row, col] - self.last[rows], self.change[rows]
        slow = np.abs(change) > _SHRINKS * np.abs(before)
        turned = (change * before.conj()).real < 0.0
        grown = np.abs(change) > _GROWN * np.abs(before)
        scatters = self.scatters[rows] | (slow & turned & ~grown)
        mean, off = _mean(self, rows, new, rule)
        doubt = np.where(slow & ~turned, change + before, change)
        doubt[scatters] = off[scatters]
        weight = _weights(rule) / mean[0]
        amplitude = np.where(scatters[:, None, None], old + weight[:, None, None] * (new - old), new)
        own = self.sums
        return SourceSums(
            BySource(own.source, _with(own.amplitude, rows, amplitude), _with(own.rays, rows, rays)),
            self.element,
            last=_with(self.last, rows, new[:, row, col]),
            change=_with(self.change, rows, change),
            doubt_of=_with(self.doubt_of, rows, doubt),
            rule=_with(self.rule, rows, rule),
            launches=_with(self.launches, rows, self.launches[rows] + 1),
            mean=_with(self.mean.T, rows, mean.T).T,
            scatters=_with(self.scatters, rows, scatters),
        )


def _first(order: NDArray[np.intp], sums: tuple[NDArray[Any], NDArray[Any], NDArray[Any]], leave: float) -> int:
    """Return how many of some amplitudes, in an order, may be left out: they add up to no more than leave [m], in phase
    as they are and as if of unrelated phases. Args: sums (p,) real and imaginary parts [m], and powers [m^2]."""
    real, imaginary, power = (np.cumsum(x[order]) for x in sums)
    rest = np.maximum(np.hypot(real, imaginary), np.sqrt(power))
    return int(np.flatnonzero(rest <= leave).max(initial=-1)) + 1


def _mean(sums: SourceSums, rows: Ints, new: Complexes, rule: Ints) -> tuple[Floats, Complexes]:
    """Return the sums (4, k) of the means of some rows with a new launch (k, 2, 2), and the standard error (k,) [m] of
    one component of each, in the direction of the last change."""
    row, col = sums.element
    w, first = _weights(sums.rule[rows]), ~sums.scatters[rows]
    last, value = sums.last[rows], new[:, row, col]
    before = np.where(first, [w, w**2, w * np.abs(last) ** 2, np.ones(len(w))], sums.mean[:, rows])
    w = _weights(rule)
    mean = before + np.array([w, w**2, w * np.abs(value) ** 2, np.ones(len(w))])
    old = np.where(first, last, sums.sums.amplitude[rows, row, col])
    middle = old + w / mean[0] * (value - old)
    spread = np.maximum(mean[2] / mean[0] - np.abs(middle) ** 2, 0.0)
    error = np.sqrt(0.5 * spread / (mean[0] ** 2 / mean[1] - 1.0))
    return mean, error * np.exp(1j * np.angle(value - old))


def _weights(rule: Ints) -> Floats:
    """Return the weights (n,) in a mean of launches by some rules (n,)."""
    return np.asarray(_WEIGHT ** rule.astype(float))


def _with(values: NDArray[_Kind], rows: Ints, new: NDArray[_Kind]) -> NDArray[_Kind]:
    """Return a copy of values with new ones in some rows."""
    changed = values.copy()
    changed[rows] = new
    return changed
