"""The paths of several launches over one scene, by the sources of their tubes: a finer launch replaces what it traces
again, and what it replaced stays known, for the difference tells the error."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.channel.paths import join, of_trajectories
from raychan.parallel import parallel_map
from raychan.radar.dual_paths import columns_of, scaled
from raychan.records import Paths
from raychan.run.explanation.point_spread import PointSpread
from raychan.run.refinement.probes import Probe
from raychan.tracing.shooting import Wanted
from raychan.tracing.sources import Sources, covered, depth_of

Floats = NDArray[np.float64]
Complexes = NDArray[np.complexfloating]

DEEP = 2
"""From this bounce on a tube is deep: the first launch cuts it only where it alone may make a detection."""
_LACK = 0.01  # of what doubtful paths must bring at least: by so much they may miss it (paths added; not measured)
_SUMS = 1 << 21  # sums by cell and source held at once: bounds the memory
_GONE, _BEFORE, _NOW = 0, 1, 2


@dataclass
class _Part:
    """What one launch brought: paths, the source (w,) and the state (w,) of each trajectory; whether it is the
    first launch, which cuts few deep tubes."""

    paths: Paths
    source: Sources
    state: NDArray[np.int8]
    first: bool

    @cached_property
    def deep(self) -> NDArray[np.bool_]:
        """Which trajectories (w,) are of deep tubes."""
        return np.asarray(depth_of(self.source) >= DEEP)


class SourcedPaths:
    """The paths of a first launch, with the source (w,) of each trajectory, and of further ones that replace some.

    Args: probes elements besides the phase centres at which sums in map cells are followed too.
    """

    def __init__(self, paths: Paths, source: Sources, probes: tuple[Probe, ...] = ()) -> None:
        self._probes = probes
        self._parts = [_Part(paths, source, np.full(len(source), _NOW, np.int8), True)]
        self._doubted = np.zeros(0, np.int64), np.zeros(0), np.zeros(0)
        self._moved = np.zeros(2)

    def replace(self, paths: Paths, source: Sources, launches: list[tuple[int, Wanted]]) -> tuple[Paths, Sources]:
        """Replace what some launches traced again; return what this changes: the new paths and the old ones with their
        sign turned, and the source (w,) of each trajectory."""

        def taken(part: _Part) -> list[tuple[Paths, Sources]]:
            hit = covered(part.source, launches)
            old = hit & (part.state == _NOW)
            part.state[hit] = np.where(old[hit], _BEFORE, _GONE)
            if not old.any():
                return []
            shallow = old & ~part.deep
            if part.first and shallow.any():
                self._moved += _powers(part, shallow, paths, source)
            return [(_negative(of_trajectories(self._needed(part.paths), old)), part.source[old])]

        changed = [(self._needed(paths), source), *chain(*parallel_map(taken, self._parts))]
        self._parts.append(_Part(paths, source, np.full(len(source), _NOW, np.int8), False))
        return join([x for x, _ in changed]), np.concatenate([x for _, x in changed])

    def doubt(self, source: Sources, factor: Floats, share: Floats) -> None:
        """Count the last changes of sources (n,) times factors (n,), those of the cell that they matter most to, of
        whose tolerance they are such a share (n,)."""
        own, factors, shares = (np.concatenate(x) for x in zip(self._doubted, (source, factor, share), strict=True))
        order = np.lexsort((shares, own))
        last = order[np.append(own[order][1:] != own[order][:-1], True)[: len(order)]]
        self._doubted = own[last], factors[last], shares[last]

    def _factor(self, source: Sources) -> Floats:
        own, factors, _ = self._doubted
        if not len(own):
            return np.ones(len(source))
        at = np.minimum(np.searchsorted(own, source), len(own) - 1)
        return np.where(own[at] == source, factors[at], 1.0)

    def __len__(self) -> int:
        return sum(len(p.paths.length) for p in self._parts)

    @property
    def counts(self) -> list[NDArray[np.bool_]]:
        """Which trajectories (w,) of each launch count, in the order of the launches."""
        return [p.state == _NOW for p in self._parts]

    @property
    def now(self) -> Paths:
        """All paths, of the newest launch of each source."""
        return join([p.paths for p in self._parts], self.counts)

    def _needed(self, paths: Paths) -> Paths:
        """Return paths without the way that they go, which only sums at other elements depend on."""
        return paths if self._probes else _bare(paths)

    @property
    def doubtful(self) -> Paths:
        """What the newest launches changed, times the factors of `doubt`; the paths of deep tubes never traced again;
        and of other tubes never traced again the share that those traced again changed by, in unrelated phases."""
        held = [self._needed(p.paths) for p in self._parts]
        parts, keep = [held[0]], [self._untouched]
        factor: list[NDArray[Any]] = [self._share(keep[0])]
        for p, paths in zip(self._parts, held, strict=True):
            new = (p.state == _NOW) & (p.deep if p.first else True)
            for rows, sign in ((new, 1.0), (p.state == _BEFORE, -1.0)):
                parts.append(paths)
                keep.append(rows)
                factor.append(sign * self._factor(p.source[rows]))
        every = join(parts, keep)
        return scaled(every, np.concatenate(factor).take(every.trajectory))

    @property
    def _untouched(self) -> NDArray[np.bool_]:
        """Which trajectories (w,) of the first launch are of tubes that it cut, and that were not traced again."""
        first = self._parts[0]
        return np.asarray((first.state == _NOW) & (depth_of(first.source) == 1) & (self._moved[1] > 0.0))

    def _share(self, rows: NDArray[np.bool_]) -> Complexes:
        """Return the share (m,) by which those traced again changed, in unrelated phases, for some (w,) of them."""
        turn = np.random.default_rng(0).uniform(0.0, 2.0 * np.pi, len(rows))[rows]
        share = np.sqrt(self._moved[1] / self._moved[0]) if self._moved[0] > 0.0 else 0.0
        return np.asarray(share * np.exp(1j * turn))

    def by_source(self, response: PointSpread, cells: Floats) -> tuple[Sources, Iterator[Complexes]]:
        """Return the sources (s,) of the first launch, and the sums of its paths as `sums_of` gives them."""
        return self.sums_of(self._parts[0].paths, self._parts[0].source, response, cells)

    def sums_of(
        self, paths: Paths, source: Sources, response: PointSpread, cells: Floats
    ) -> tuple[Sources, Iterator[Complexes]]:
        """Return the sources (s,), in order, of the trajectories (w,) of paths, and the sums of its paths, (some, s) at
        a time: in each of the cells (c, 3) at the phase centres, then in each at the first probe, and so on."""
        # Neighbours are mostly alike: one of each run is sorted.
        heads = np.flatnonzero(np.diff(source, prepend=source[:1] - 1))
        own, group = np.unique(source[heads], return_inverse=True)
        group = np.repeat(group, np.diff(heads, append=len(source)))
        most = max(1, _SUMS // max(len(own), 1))
        seen = chain([paths], (p.seen(paths) for p in self._probes))
        return own, (
            _sums(response, x, group, len(own), cells[i : i + most]) for x in seen for i in range(0, len(cells), most)
        )


def _powers(first: _Part, rows: NDArray[np.bool_], paths: Paths, source: Sources) -> Floats:
    """Return the power of the sources of some trajectories (w,) of a launch, and that by which new paths change it."""
    held = first.paths
    old = np.flatnonzero(rows[held.trajectory])
    waves = (first.source[held.trajectory[old]], held.amplitude[old]), (source[paths.trajectory], paths.amplitude)
    own = np.unique(waves[0][0])
    sums = [_by(own, *x) for x in waves]
    return np.array([(np.abs(sums[0]) ** 2).sum(), (np.abs(sums[1] - sums[0]) ** 2).sum()])


def _by(own: Sources, source: Sources, amplitude: Complexes) -> Complexes:
    """Return the sums (s,) of amplitudes (n,) by sources `own` (s,)."""
    at = np.minimum(np.searchsorted(own, source), len(own) - 1)
    hit = own[at] == source
    return np.bincount(at[hit], amplitude.real[hit], len(own)) + 1j * np.bincount(
        at[hit], amplitude.imag[hit], len(own)
    )


def changes(response: PointSpread, paths: Paths, source: Sources, cells: Floats) -> Complexes:
    """Return the sums (c, 2) in cells (c, 3) of paths, by the source (w,) of their trajectories: shallow, deep."""
    return _sums(response, paths, (depth_of(source) >= DEEP).astype(np.int64), 2, cells)


def raised(response: PointSpread, doubtful: Paths, cells: Floats, least: Floats) -> Paths:
    """Return doubtful paths with echoes that bring their sums in cells (c, 3) to so much (c,) at least: unrelated
    changes that cancel in one launch need not do so in the next.

    An echo comes from where the strongest path of its cell comes from.
    """
    every = np.zeros(len(doubtful.length), np.int64)
    if not (len(every) and len(cells)):
        return doubtful
    sums, _, strongest = response.in_cells(every, 1, doubtful.amplitude, doubtful.delay, doubtful.range_rate, cells)
    found, parts = sums[:, 0], [doubtful]
    for i in np.argsort(-least, kind="stable"):
        lack = least[i] - abs(found[i])
        if lack <= _LACK * least[i]:
            continue
        # Where no path reaches the cell, the strongest of all.
        row = int(strongest[i, 0]) if strongest[i, 0] >= 0 else int(np.argmax(np.abs(doubtful.amplitude)))
        if not doubtful.amplitude[row]:
            continue
        # As strong as the cell: sums leave out what is weak beside it, and what lacks may be.
        echo = scaled(_echo(response, doubtful, row, cells[i]), np.array([cells[i, 2] / doubtful.amplitude[row]]))
        waves = _sums(response, echo, np.zeros(1, np.int64), 1, cells)[:, 0]
        if waves[i]:
            factor = lack * np.exp(1j * np.angle(found[i])) / waves[i]
            parts.append(scaled(echo, np.array([factor])))
            found = found + factor * waves
    return join(parts)


def _echo(response: PointSpread, paths: Paths, row: int, cell: Floats) -> Paths:
    """Return one of the paths, moved to the range and rate of a cell (3,)."""
    way, at = paths.trajectories, paths.trajectory[row]
    length = 2.0 * (cell[0] - cell[1] * response.waveform.centre)
    moved = {name: getattr(paths, name)[row : row + 1] for name in columns_of(paths)}
    moved |= {"length": np.array([length]), "length_rate": np.array([2.0 * cell[1]])}
    its = way.rebuilt(**{f.name: getattr(way, f.name)[at : at + 1] for f in fields(way)})
    return paths.rebuilt(**moved, trajectory=np.zeros(1, np.int32), trajectories=its)


def _sums(response: PointSpread, paths: Paths, group: NDArray[np.int64], count: int, cells: Floats) -> Complexes:
    rows = group[paths.trajectory]
    return response.in_cells(rows, count, paths.amplitude, paths.delay, paths.range_rate, cells)[0]


def _bare(paths: Paths) -> Paths:
    """Return paths without the way that they go."""
    way = paths.trajectories
    none = {name: getattr(way, name)[:, :0] for name in ("body", "part", "kind", "vertices")}
    return paths.rebuilt(trajectories=way.rebuilt(**none))


def _negative(paths: Paths) -> Paths:
    return scaled(paths, -1.0)
