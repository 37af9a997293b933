"""Peaks of a map: local maxima, and which of them are side lobes of others."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.processing.cfar import Grid
from raychan.radar.side_lobes import SideLobeEnvelope, migrating
from raychan.radar.waveform import OwnWaveform, Waveform

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

MARGIN = 2.0
"""Side lobes of two equal echoes add in voltage: twice the sum of their powers."""
SUMMED = 3
"""Side lobes that may all be in phase, the strongest. Windows hamming and taylor(45), echoes of 60 dB within 1 dB in a
range cell: of 240 scenes each of three, four and six 28, 47 and 34 show a sum as a detection with 2, none, 8 and none
with 3, none at all with 4; of 240 echoes 25 to 40 dB below four others 5, 7 and 18 are lost."""
_FLOOR = 1e-12  # of a peak: rounding errors of single precision and of the fast sum are below
_SLACK = 0.25  # resolution cells by which side lobes of other echoes may shift a peak (not measured)
_STEP = 0.5  # range cells of migration between envelopes: fewer of them, against a quarter as much of slack at most
AROUND = [(v, r) for v in (-1, 0, 1) for r in (-1, 0, 1) if v or r]
"""Steps from a cell to the eight around it."""


def stepped(
    cells: Ints, step: tuple[int, int], shape: tuple[int, ...], mirrors: bool
) -> tuple[Ints, NDArray[np.bool_]]:
    """Return the cells (c, 2) a step away from those of a map (c, 2), and which of them are mirror images (c,), whose
    amplitudes are the conjugates of what is there.

    Both axes wrap as the transforms do; with real sampling, `mirrors`, ranges go on as images of the rates of the other
    sign, beyond the last one after a cell that the map lacks."""
    near = cells + step
    beyond = (near[:, 1] < 0) | (near[:, 1] >= shape[1]) if mirrors else np.zeros(len(near), bool)
    rows, columns = near[beyond].T
    near[beyond] = np.stack([2 * (shape[0] // 2) - rows, np.where(columns < 0, -columns, shape[1] - 1)], axis=1)
    return near % shape, beyond


def maxima(power: Floats, least: float, mirrors: bool = False) -> Ints:
    """Return the local maxima (c, 2) of a map; args as for `stepped`."""
    cells = np.argwhere(power > least)
    for step in AROUND:
        near, _ = stepped(cells, step, power.shape, mirrors)
        cells = cells[power[tuple(cells.T)] >= power[tuple(near.T)]]
    return cells


def together(lobes: Floats) -> Any:
    """Return the power that side lobes of powers (k, ...), strongest first, are at most held to show together."""
    loud, rest = np.sqrt(lobes[:SUMMED]).sum(axis=0) ** 2, MARGIN * lobes[SUMMED:].sum(axis=0)
    return np.maximum(MARGIN * lobes.sum(axis=0), loud + rest)


class SideLobes:
    """How much peaks show elsewhere in a map, by the side lobes of its windows, named (rate, range)."""

    def __init__(
        self,
        grid: Grid,
        windows: tuple[str, str],
        chirps: int | None = None,
        mirrors: bool = False,
        skew: float = 0.0,
        migrating: bool = False,
    ) -> None:
        """Args: chirps that the window along rate weighs, where they are not the map's resolution cells but a multiple
        of them: by Doppler division a map has a share of the rates; mirrors, whether echoes have images at minus their
        range and minus their rate, as with real sampling, of which a map has half the ranges; skew, range cells by
        which an echo lies lower in the next rate cell, as rows are freed of their own Doppler shifts; migrating,
        whether echoes that migrate have side lobes of their own, not those of standing ones moved apart."""
        rates, ranges = grid.count
        weighed = chirps if chirps and chirps % rates == 0 else rates
        samples = ranges * (2 if mirrors else 1)
        self.mirrors, self._period, self._skew = mirrors, (rates, samples), skew
        self._standing = (rates * grid.pad[0] // 2) / grid.pad[0]
        self._envelopes = SideLobeEnvelope(windows[0], weighed, weighed // rates), SideLobeEnvelope(windows[1], samples)
        self._of_all_rates = SideLobeEnvelope(windows[0], weighed)
        self._migrating = migrating
        self._sizes = windows, (weighed, samples), weighed // rates

    @classmethod
    def of(cls, grid: Grid, windows: tuple[str, str], waveform: Waveform | None, chirps: int | None) -> SideLobes:
        """Return the side lobes in a map; args as for `detection.detect`."""
        if waveform is None or isinstance(waveform, OwnWaveform):
            return cls(grid, windows, chirps)
        skew = waveform.chirp_duration / waveform.frame_duration
        return cls(grid, windows, chirps, not waveform.complex_sampling, skew, migrating=True)

    def at(self, places: Floats, place: Floats, power: Any, smear: Any) -> Floats:
        """Return what peaks at `place` show at `places`, (n, 2) or (2,) each, all in resolution cells, but for what
        their mirror images show.

        Args: power [W] and smear of the peaks: range cells over which an echo migrates; it spreads over as many rate
        cells."""
        off = places - place
        # Round the end of the rates, too, a row is freed of the shift of its own rate.
        away = np.abs(np.stack([off[..., 0], off[..., 1] + self._skew * off[..., 0]], axis=-1)) % self._period
        away = np.minimum(away, self._period - away)
        smears = np.broadcast_to(smear, away.shape[:-1])
        steps = np.rint(smears / _STEP) * self._migrating
        away -= (0.5 * np.abs(smears - _STEP * steps) + _SLACK)[..., None]
        response = np.zeros(steps.shape)
        for step in np.unique(steps):
            rows = steps == step
            response[rows] = self._envelope(float(step) * _STEP, away[rows])
        return np.maximum(power * response, _FLOOR * power)

    def _envelope(self, moved: float, away: Floats) -> Floats:
        """Return the side lobes (n,) at offsets (n, 2) of an echo that migrates over so many range cells."""
        if not moved:
            standing = [f(np.maximum(x, 0.0)) for f, x in zip(self._envelopes, away.T, strict=True)]
            return np.asarray(standing[0] * standing[1])
        windows, count, slots = self._sizes
        envelope = migrating(windows, count, moved, slots)
        return envelope(*np.maximum(away - envelope.off, 0.0).T)

    def by_fold(self, off: Floats, turns: Ints) -> Floats:
        """Return the shares (h, n) of the amplitude that `at` bounds that fall on an echo's own fold, on the next, and
        so on: by Doppler division its side lobes go on over the rates of all slots, and fall on one cell.

        Args: off (n,) [resolution cells] from the echoes along rate; turns (n,) of the rates that this leaves out."""
        rates, (_, (whole, _), slots) = self._period[0], self._sizes
        far = np.abs(off + rates * (turns + np.arange(slots)[:, None])) % whole
        each = self._of_all_rates(np.maximum(np.minimum(far, whole - far) - _SLACK, 0.0))
        most = self._envelopes[0](np.maximum(np.abs(off + rates * turns) - _SLACK, 0.0))
        return np.sqrt(np.minimum(np.divide(each, most, out=np.ones_like(each), where=each < most), 1.0))

    def of_images(self, places: Floats, place: Floats, power: Any, smear: Any) -> Floats:
        """Return what the mirror images of peaks show; args as for `at`."""
        return self.at(places, np.array([2.0 * self._standing, 0.0]) - place, power, smear)

    def own(
        self,
        place: Floats,
        power: Floats,
        smear: Floats,
        shown: Floats | None = None,
        besides: Callable[[int], bool] = lambda i: True,
    ) -> NDArray[np.bool_]:
        """Return which peaks (n,), strongest first, are not explained by side lobes of stronger ones, or of their
        mirror images.

        Args: place (n, 2) and smear (n,) in resolution cells; power (n,) [W] between the cells of the map; shown (n,)
        [W] in them, if that is another: a side lobe between cells is not stronger by what a main lobe would be;
        besides, what else a peak must meet to count, by its row."""
        # The strongest side lobes, and all others.
        lobes, shown = np.zeros((SUMMED + 1, len(power))), power if shown is None else shown
        kept = np.zeros(len(power), bool)
        for i in range(len(power)):
            kept[i] = shown[i] > together(lobes[:, i]) and besides(i)
            for f in (self.at, self.of_images)[: 1 + self.mirrors] if kept[i] else ():
                more = f(place[i:], place[i], power[i], smear[i])
                for level in lobes[:SUMMED, i:]:
                    less = np.minimum(level, more)
                    np.maximum(level, more, out=level)
                    more = less
                lobes[SUMMED, i:] += more
        return kept

    def shoulders(self, power: Floats, pad: tuple[int, int], peaks: Ints, cells: Ints) -> tuple[Ints, Floats]:
        """Return which of the cells (c, 2) are not side lobes, and lie a resolution cell or more from peaks (p, 2) and
        from stronger ones of them; and the most power (s,) within a resolution cell of each: so much makes it a peak.

        Args: power of a map with `pad` map cells per resolution cell."""
        every = np.concatenate([peaks, cells])
        order = np.argsort(-power[tuple(every.T)], kind="stable")
        own = np.zeros(len(every), bool)
        own[order] = self.own(every[order] / np.array(pad), power[tuple(every[order].T)], np.zeros(len(every)))
        found = list(peaks)
        for i in order[(order >= len(peaks)) & own[order]]:
            away = np.abs(every[i] - np.reshape(found, (-1, 2)))
            if ((np.minimum(away, power.shape - away) / pad).max(axis=1) >= 1.0).all():
                found.append(every[i])
        kept = np.reshape(found, (-1, 2)).astype(np.int64)[len(peaks) :]
        steps = np.stack(np.meshgrid(*(np.arange(-n, n + 1) for n in pad), indexing="ij"), axis=-1).reshape(-1, 2)
        near = (kept[:, None] + steps) % power.shape
        return kept, power[near[..., 0], near[..., 1]].max(axis=1, initial=0.0)


def strongest(power: Floats, grid: Grid) -> Ints:
    """Return the strongest map cell (c, 2) of each resolution cell."""
    pad = np.array(grid.pad)
    size = np.array(power.shape) // pad
    blocks = power[: size[0] * pad[0], : size[1] * pad[1]].reshape(size[0], pad[0], size[1], pad[1])
    best = np.argmax(blocks.transpose(0, 2, 1, 3).reshape(*size, -1), axis=2)
    return np.reshape(np.moveaxis(np.indices(size), 0, -1) * pad + np.stack(np.divmod(best, pad[1]), -1), (-1, 2))
