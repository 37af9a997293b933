"""From peaks of a map to echoes: those that an array tells apart within a cell, each with its own place and power."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.processing.angles import echoes_in
from raychan.processing.cell_echoes import CellEchoes
from raychan.processing.cfar import Grid
from raychan.processing.fold_beside import judged_beside
from raychan.processing.found import Echoes, Peaks, Row
from raychan.processing.line_lobes import LineLobes
from raychan.processing.peak_shape import PeakShape
from raychan.processing.peaks import MARGIN, SideLobes, together
from raychan.processing.scan import Scan, through
from raychan.processing.slots import LONE, Slots
from raychan.processing.staggered import CLEAR, ResolvedMap, noise_of
from raychan.records import RangeDoppler

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Complexes = NDArray[np.complexfloating[Any, Any]]

_LITTLE = 1e-3  # of a peak's power: what an echo may show there without its direction being looked at (not measured)
_HIDDEN = (
    10.0  # on what echoes leave in their cell: the fit takes some of an echo that was not told apart (not measured)
)
_MIXED = 0.1
"""Of a peak's power: side lobes beside which its fold is judged anew. Of 5,588 cubes of a strong and a weak echo the
weak one has a wrong fold in 6 with 0.1, 0.03 and 0.01 alike, and the right one, but `ambiguous`, in 53, 70 and 88."""
_SAME_BEAM = 0.5  # beam widths: nearer directions of neighbouring peaks are one echo (not measured)


@dataclass(frozen=True, eq=False)
class Splitter:
    """What splitting needs to know of the map and of how directions are sought."""

    map: RangeDoppler
    grid: Grid
    lobes: SideLobes
    lines: LineLobes
    shape: PeakShape
    scan: Scan
    receiver_noise: float
    """Noise that SNR counts in a beam of weights w, over the noise of a peak: this times |w|^2."""
    coherent: bool
    """Whether the peaks are those of beams, which let little through of echoes from elsewhere."""

    def split(self, peaks: Peaks) -> Echoes:
        """Return the echoes in the cells of peaks, strongest first.

        A peak is dropped that the side lobes of the echoes found before, in stronger peaks, explain, or those of what
        is stronger in its row or column. An echo that peaks beside its cell may have a peak of its own there, or none,
        as a stronger one has it: it counts where no other peak gives it. In the end echoes are dropped that
        side lobes of stronger ones explain, whenever these were found."""
        kept: list[Row] = []
        beside: list[Row] = []
        for i in range(len(peaks.cells)):
            beams = partial(self._beams_at, peaks.direction[i]) if self.coherent else None
            place = peaks.cells[i], peaks.shift[i], self._fold(peaks.cells[i])
            if not (self._clear(float(peaks.shown[i]), *place, kept, peaks, beams) and self.lines.own(peaks.cells[i])):
                continue
            v, r = peaks.cells[i]
            fold, open_ = self._fold_beside(peaks, i, kept)
            snapshot, distance = self._read(v, r, self._spans(peaks, i, fold, v)), self._distance(peaks.place[i])
            noise = float(peaks.noise[i]) * self.receiver_noise
            held = echoes_in(snapshot, self.scan, float(peaks.least[i]), distance, self.slots, noise)
            rows = [row for k in range(len(held.power)) if (row := self._placed(peaks, i, held, k, fold))]
            rows = [replace(row, unsure=row.unsure or open_ or self._bent(held)) for row in rows]
            beside += [row for row in rows if row.beside]
            found = [rows[0], *(row for row in rows[1:] if not row.beside and self._own(row, kept, peaks))]
            # The strongest in a cell may be the foot of one that has its own peak, beside which another one peaks here.
            sure = [k == 0 and (row.crest or len(rows) == 1) for k, row in enumerate(found)]
            kept += [
                row
                for row, own in zip(found, sure, strict=True)
                if own or not any(self._same(row, other) for other in kept)
            ]
        for row in sorted(beside, key=lambda row: -row.power):
            if not any(self._same(row, other) for other in kept) and self._own(row, kept, peaks):
                kept.append(row)
        kept = self._without_lobes(kept, peaks)
        names = ("cell", "shift", "power", "noise", "direction", "unsure", "weights", "fold")
        if not kept:
            none, pairs, weights = np.zeros(0), np.zeros((0, 2)), np.zeros((0, len(self.map.spectrum)), complex)
            whole = pairs.astype(np.int64)
            return Echoes(whole, pairs, none, none, pairs, none.astype(bool), weights, whole[:, 0])
        return Echoes(*(np.array([getattr(row, name) for row in kept]) for name in names))

    @property
    def slots(self) -> Slots:
        """How transmitters are told apart."""
        return self.map.slots if isinstance(self.map, ResolvedMap) else LONE

    def _distance(self, place: Floats) -> float:
        """Return the distance [m] of a place (2,) in map cells."""
        return float(self.map.range[0] + place[1] * self.map.range_resolution / self.grid.pad[1])

    def _bent(self, held: CellEchoes) -> bool:
        """Return whether echoes of a cell may be parts of one wave that is no plane one at all."""
        return len(held.power) > 1 and bool((held.misfit >= 1.0).any())

    def _fold(self, cell: Ints) -> int:
        """Return by how many spans a map cell (2,) is held to be folded."""
        return int(self.map.fold[tuple(cell)]) if isinstance(self.map, ResolvedMap) else 0

    def _fold_beside(self, peaks: Peaks, i: int, kept: list[Row]) -> tuple[int, bool]:
        """Return by how many spans a peak is folded, beside what side lobes of echoes show in its cell, and whether
        that is open."""
        fold, place = self._fold(peaks.cells[i]), peaks.place[i] / np.array(self.grid.pad)
        if not kept or len(self.slots.folds) < 2:
            return fold, False
        at, shown = self._shown(place, kept, peaks)
        much = shown > _MIXED * peaks.shown[i]
        some = [row for row, own in zip(kept, much, strict=True) if own]
        waves, _ = self._lobes(place, fold, some, at[much])
        known = waves.reshape(-1, waves.shape[-1])
        if not 0 < len(known) <= len(self.scan.aperture.elements) // 2:
            return fold, False
        v, r = peaks.cells[i]
        data = self._read(v, r, self._spans(peaks, i, fold, v)).astype(np.complex128)
        more, open_ = judged_beside(data, known, self.scan.aperture, self.slots, CLEAR * noise_of(self.map))
        return fold + more, open_

    def _spans(self, peaks: Peaks, i: int, fold: int, rows: Any) -> Any:
        """Return by how many spans and parts of one the rate of a peak is folded in rows (...) of the map, that is
        folded so many times in its cell."""
        return fold + (peaks.place[i, 0] - rows) / len(self.map.rate)

    def _read(self, rows: Any, columns: Any, folds: Any) -> Complexes:
        """Return what the slots of map cells (...) hold, (s * a, ...), read under folds (...)."""
        if isinstance(self.map, ResolvedMap):
            return self.map.read(rows, columns, folds)
        return np.asarray(self.map.spectrum[:, rows, columns])

    def _fold_at(self, row: Row, cell: Ints) -> int:
        """Return by how many spans an echo is folded in a map cell (2,): over the end of the rates by one more or less,
        as true rates go on there."""
        return row.fold + round(float(row.cell[0] - cell[0]) / len(self.map.rate))

    def _beams_at(self, direction: Floats) -> Complexes:
        """Return the weights (b, s * a) of beams towards cosines (2,) and beside it, of what slots hold."""
        beams = self.scan.conventional(direction)
        return self.slots.waves(beams, [0] * len(beams))

    def _clear(
        self, power: float, cell: Ints, shift: Floats, fold: int, kept: list[Row], peaks: Peaks, beams: Any
    ) -> bool:
        """Return whether a power in a cell (2,) that peaks beside it exceeds what the side lobes of echoes may show.

        Args: shift (2,) [map cells] of the peak; fold of what is seen; beams, None or a function that gives the weights
        (b, s * a) of those in which the place is seen."""
        if not kept:
            return True
        place = (cell + np.clip(shift, -0.5, 0.5)) / np.array(self.grid.pad)  # the power is that of the cell
        at, shown = self._shown(place, kept, peaks)
        rest = 0.0
        if self.lobes.mirrors:
            # A mirror image is no plane wave to several transmitters: it counts as if all beams let it through.
            smear, powers = peaks.smear[[row.peak for row in kept]], np.array([row.power for row in kept])
            rest = MARGIN * float(self.lobes.of_images(place, at, powers, smear).sum())
        most = rest + float(together(np.sort(shown)[::-1]))
        if beams is None or power > most:
            return bool(power > most)
        # Echoes that all beams let through would matter little: they count as if they did.
        much = shown > _LITTLE * power
        some, rest = [kept[k] for k in np.flatnonzero(much)], rest + MARGIN * float(shown[~much].sum())
        waves, shares = self._lobes(place, fold, some, at[much])
        let = through(beams(), shares[:, :, None] * waves)
        let = np.maximum(let, [max(row.misfit, row.bent) for row in some])
        return bool(power > rest + float(together(np.sort(shown[much] * let)[::-1])))

    def _shown(self, place: Floats, kept: list[Row], peaks: Peaks) -> tuple[Floats, Floats]:
        """Return the places (n, 2) of echoes, and what their side lobes show (n,) [W] at one (2,) at most, places in
        resolution cells."""
        at = np.array([row.cell + row.shift for row in kept]) / np.array(self.grid.pad)
        smear = peaks.smear[[row.peak for row in kept]]
        return at, self.lobes.at(place, at, np.array([row.power for row in kept]), smear)

    def _lobes(self, place: Floats, fold: int, some: list[Row], at: Floats) -> tuple[Complexes, Floats]:
        """Return what slots hold (h, n, s * a) of the side lobes of echoes (n,) at a place (2,) that is folded `fold`
        times, in h parts, and the shares (h, n) of these in their amplitude.

        Args: at (n, 2) of the echoes, places in resolution cells."""
        waves = np.array([row.wave for row in some], complex).reshape(-1, len(self.scan.aperture.elements))
        spans = (at[:, 0] - place[0]) / self.grid.count[0]
        # By time division side lobes are turned as their echo is; by Doppler division they fall on several slots.
        own = np.array([row.fold for row in some]) - fold + (np.rint(spans) if self.slots.shifted else spans)
        shares = self.lobes.by_fold(place[0] - at[:, 0], np.rint(spans))
        return np.array([self.slots.waves(waves, own + h) for h in range(len(shares))]), shares

    def _own(self, row: Row, kept: list[Row], peaks: Peaks) -> bool:
        """Return whether an echo is above what the side lobes of others show where it peaks."""
        return self._clear(row.shown, row.cell, row.shift, row.fold, kept, peaks, lambda: row.weights[None])

    def _without_lobes(self, found: list[Row], peaks: Peaks) -> list[Row]:
        """Return echoes, strongest first, without side lobes of stronger ones that may have been found after them."""
        kept: list[Row] = []
        for row in sorted(found, key=lambda row: -row.power):
            # Those of one peak were told apart from each other. What stronger ones hide in their cells may be this very
            # echo: it counts where they were found before.
            others = [replace(other, misfit=0.0) for other in kept if other.peak != row.peak]
            if self._own(row, others, peaks):
                kept.append(row)
        return kept

    def _placed(self, peaks: Peaks, i: int, held: CellEchoes, k: int, fold: int) -> Row | None:
        """Return echo k in the cell of peak i, folded so many times, where its own beam peaks; None for what is none.

        An echo beside the strongest must peak within two resolution cells: else it is the foot of an echo farther off.
        """
        pad, shape = np.array(self.grid.pad), self.map.power.shape
        reach = 2 * pad if k else pad
        near = np.meshgrid(
            *(c + np.arange(-n, n + 1) for c, n in zip(peaks.cells[i], reach, strict=True)), indexing="ij"
        )
        v, r = self.shape.cells_at(near[0], near[1], shape)
        level = np.abs(np.tensordot(held.weights[k], self._read(v, r, self._spans(peaks, i, fold, v)), 1)) ** 2
        # Along an axis of two cells there is nothing to compare with.
        fixed = np.array(shape) <= 2
        at = _top(level, reach, np.where(fixed | (k == 0), 0, pad), np.where(fixed, 0, reach))
        if not (np.abs(at - reach) < reach).all():
            if k:
                return None
            at = reach
        cell = np.array([v[tuple(at)], r[tuple(at)]])
        beside = np.array([[level[at[0] + s, at[1]] for s in (-1, 1)], [level[at[0], at[1] + s] for s in (-1, 1)]])
        lone = self.shape.between(level[at[0], at[1]][None], beside[:, :, None], cell[None], shape)

        def beam(v: Ints, r: Ints) -> Complexes:
            spans = self._spans(peaks, i, fold, v)
            # What undoes the turns of one echo by Doppler division is no band-limited function of rates.
            spans = np.rint(spans) if self.slots.shifted else spans
            return np.tensordot(held.weights[k], self._read(v, r, spans), 1)[None]

        # One slot holds each cell under its own fold; of several each is read under the echo's.
        alike = not isinstance(self.map, ResolvedMap) or self.slots.count > 1
        shift, power = self.shape.among(beam, 1, cell[None], lone, shape, alike)
        noise = float(peaks.noise[i] * self.receiver_noise * held.noise_gain[k])
        misfit = min(1.0, _HIDDEN * held.rest / float(held.power[k]))
        unsure, shown = bool(held.unsure(self.scan.aperture)[k]), float(level[at[0], at[1]])
        aside = not bool((np.abs(at - reach) < pad).all())
        crest = bool(level[reach[0] - 1 : reach[0] + 2, reach[1] - 1 : reach[1] + 2].max() <= shown)
        row, more = int(near[0][tuple(at)]), int(held.fold[k])
        # Over the end of the rates an echo is folded once more.
        own = fold + more + row // shape[0]
        # The beam of what slots hold under the echo's own fold, at its own rate.
        away = (row + shift[0, 0] - peaks.place[i, 0]) / shape[0]
        weights = self.slots.read_under(held.weights[k].conj(), more + away).conj()
        fit = misfit, float(held.misfit[k]), held.waves[k], unsure, weights, own, shown
        return Row(i, cell, shift[0], float(power[0]), noise, held.direction[k], *fit, aside, crest)

    def _same(self, one: Row, other: Row) -> bool:
        """Return whether echoes of neighbouring peaks are one."""
        apart = np.abs(one.cell - other.cell)
        apart = np.minimum(apart, np.array(self.map.power.shape) - apart)
        turn = self.scan.aperture.apart(one.direction, other.direction)
        folds = (self._fold_at(one, other.cell) - other.fold) % self.slots.tested
        return bool((apart <= np.array(self.grid.pad)).all() and turn < _SAME_BEAM and not folds)


def _top(level: Floats, middle: Ints, pad: Ints, reach: Ints) -> Ints:
    """Return where (2,) a level peaks: the greatest up to `pad` (2,) from the middle (2,), and upwards from there to
    the first maximum, or to an end of `reach` (2,)."""
    inner = tuple(slice(m - p, m + p + 1) for m, p in zip(middle, pad, strict=True))
    at = middle - pad + np.array(np.unravel_index(int(level[inner].argmax()), level[inner].shape))
    while True:
        low = np.maximum(at - (reach > 0), middle - reach)
        around = level[
            tuple(slice(a, b + 1) for a, b in zip(low, np.minimum(at + (reach > 0), middle + reach), strict=True))
        ]
        higher = low + np.array(np.unravel_index(int(around.argmax()), around.shape))
        if level[tuple(higher)] <= level[tuple(at)]:
            return np.asarray(at)
        at = higher
