"""Staggered repetition: the folds of a rate are told apart by the phases between interleaved sequences of ramps.

Of K times between ramps in turn, each K-th ramp makes one sequence of equal distances P, their sum. An echo of Doppler
shift f meets sequence k turned by f t_k, t_k its start. In a cell of the map f is known but for h / P: the sequences
add in phase under the true h only (a joint fit in place of the Chinese remainder theorem, which takes one rate from
each sequence and fails where a cell holds two echoes or noise moves a peak by a cell).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.columns import column
from raychan.processing.found import BEFORE
from raychan.processing.own_waveform import map_by_waveform
from raychan.processing.slots import Slots
from raychan.radar.radar import Radar
from raychan.radar.waveform import OwnWaveform
from raychan.radar.windows import window
from raychan.records import Cube, Detections, RangeDoppler
from raychan.units import C0

Complexes = NDArray[np.complex64]

_STRONG = 10.0
"""Times the noise, in the beam over all channels: weaker echoes keep the hypothesis "not folded" (not measured)."""
CLEAR = 12.0
"""Times the noise by which a fold must beat a slower one: less gives folds of noise, more asks for a higher SNR."""
WRONG = 0.01
"""Share of wrong folds above the SNR that `least_snr` tells."""


@dataclass(frozen=True)
class ResolvedMap(RangeDoppler):
    """A map whose cells know by how many spans of unambiguous rates their echo is folded."""

    fold: NDArray[np.int8] = column("v r", np.int8, doc="true rate = rate + 2 unambiguous_rate fold")
    open: NDArray[np.bool_] = column(
        "v r", np.bool_, doc="several transmitters: whether another fold explains the cell as well; staggered: False"
    )
    spare: Complexes = column(
        "s v r", np.complex64, unit="sqrt(W)", doc="Doppler division: what slots hold that are empty under this fold"
    )
    slots: Slots
    resolved_rate: float
    """Range rates between plus and minus this are told apart by the folds [m/s]."""

    def read(self, rows: Any, columns: Any, folds: Any) -> Complexes:
        """Return what the slots of cells (...) hold, (s * a, ...), if their echoes are folded so many times (...), by
        parts of a span more than a whole number at rates beside those of the cells."""
        held = np.concatenate([self.spectrum[:, rows, columns], self.spare[:, rows, columns]])
        more = (np.asarray(folds) - self.fold[rows, columns]) % self.slots.count
        by_slot = held.reshape(self.slots.count, -1, *more.shape)
        for h in np.unique(more[more > 0]):
            by_slot[:, :, more == h] = self.slots.under(by_slot[:, :, more == h], float(h))
        return by_slot.reshape(held.shape)


def resolved(
    map: RangeDoppler,
    spectrum: Complexes,
    fold: NDArray[np.int8],
    noise: float,
    slots: Slots,
    alike: NDArray[np.bool_] | None = None,
    spare: Complexes | None = None,
) -> ResolvedMap:
    """Return a map with another spectrum (channels, v, r), its folds (v, r), its noise [W] a cell, where another fold
    is alike (v, r), nowhere if None, and what spare slots hold (channels, v, r), none if None."""
    held = {name: getattr(map, name) for name in RangeDoppler.__dataclass_fields__}
    power = (spectrum.real.astype(np.float64) ** 2 + spectrum.imag.astype(np.float64) ** 2).mean(axis=0)
    held |= {"spectrum": spectrum, "power": power, "noise": noise}
    alike = np.zeros(fold.shape, bool) if alike is None else alike
    spare = np.zeros((0, *fold.shape), np.complex64) if spare is None else spare
    limit = slots.tested * map.unambiguous_rate
    return ResolvedMap(**held, fold=fold, open=alike, spare=spare, slots=slots, resolved_rate=limit)


def fold_range(count: int) -> list[int]:
    """Return `count` folds about 0, nearest first."""
    return sorted(range(-((count - 1) // 2), count // 2 + 1), key=lambda h: (abs(h), h))


def hypotheses(radar: Radar) -> int:
    """Return how many folds are tested in a cell: 1 where none are, or where one receiver cannot tell them apart."""
    if radar.waveform.stagger:
        return radar.waveform.fold_count
    return radar.slots if len(radar.elements) > 1 else 1


def least_power(map: RangeDoppler, channels: int) -> float:
    """Return the mean power [W] over the channels of a cell from which its folds are tested.

    A beam sees an echo `channels` times stronger over the noise than one channel does.
    """
    return (1.0 + _STRONG / channels) * noise_of(map)


def noise_of(map: RangeDoppler) -> float:
    """Return the noise of a cell [W]; where it is unknown that of the median cell."""
    return map.noise or float(np.median(map.power))


def doppler(map: RangeDoppler, radar: Radar) -> NDArray[np.float64]:
    """Return the Doppler shifts (v,) [Hz] of the rows of a map."""
    return map.rate * (2.0 * radar.waveform.middle / C0)


def staggered_map(cube: Cube, radar: Radar, given: Any, resolve: bool = True) -> RangeDoppler:
    """Return the map (a, v, r) of a frame of staggered ramps, a ResolvedMap with `resolve`.

    Args: given windows and pad of `range_doppler`; resolve: find the folds of strong cells; without it the map holds
    all sequences (k * a, v, r), whose mean power is right for any rate.
    """
    wave, count = radar.channel_waveform, radar.slots
    receivers, _, samples = cube.samples.shape
    parts = cube.samples.reshape(receivers, wave.n_chirps, count, samples).transpose(2, 0, 1, 3)
    split: Complexes = parts.reshape(count * receivers, wave.n_chirps, samples)
    map = map_by_waveform(Cube(samples=split, noise_power=cube.noise_power), wave, *given)
    if not resolve:
        return map
    starts = np.array([radar.waveform.start_of(k) for k in range(count)])
    channels = map.spectrum.reshape(count, receivers, *map.spectrum.shape[1:])
    undone = np.exp(2j * np.pi * np.outer(starts, doppler(map, radar))).astype(np.complex64)
    channels = channels * undone[:, None, :, None]
    sums, fold = channels.mean(axis=0), np.zeros(map.power.shape, np.int8)
    rows, columns = np.nonzero(map.power > least_power(map, len(map.spectrum)))
    held, best = channels[:, :, rows, columns], np.zeros(len(rows))
    clear = CLEAR * map.noise / count
    for h in fold_range(radar.waveform.fold_count):
        turn = np.exp(2j * np.pi * h * starts / wave.repetition).astype(np.complex64) / count
        total = np.tensordot(turn, held, 1)
        power = (np.abs(total) ** 2).sum(axis=0)
        # Folds are tried from the slowest rate on: a faster one must explain clearly more.
        better = np.flatnonzero(power > best + (clear if h else 0.0))
        best[better], fold[rows[better], columns[better]] = power[better], h
        sums[:, rows[better], columns[better]] = total[:, better]
    return resolved(map, sums, fold, map.noise / count, Slots.of(radar, hypotheses(radar), given[1]))


def wrong_fold(snr: float, radar: Radar) -> float:
    """Return a bound on the probability that a detection of some SNR (in the beam, over all channels) has a wrong fold.

    Under a fold h the sequences add up to P_h = |u_h^H z|^2, z = s + n the values of a cell and u_h unit vectors. In
    white Gaussian noise of unit power the quadratic form P_0 - P_h has the mean |s|^2 d and, over c channels, the
    variance L (2 |s|^2 + 2 c): d the share of power that the wrong fold loses, L = 1 - |u_0^H u_h|^2, +-sqrt(L) the
    form's eigenvalues. A slower wrong fold is taken where the form is below CLEAR. The form counts as Gaussian, and the
    probabilities of all wrong folds are added. An echo half a cell off its own along both axes of the map is meant: the
    least power, and the turns between sequences half a row off.

    Source: Proakis, Digital Communications, appendix B (quadratic forms of complex Gaussian variables).
    """
    wave, settings, count = radar.channel_waveform, radar.processing, len(radar.waveform.stagger)
    starts = np.array([radar.waveform.start_of(k) for k in range(count)]) / wave.repetition
    half = 0.5 / (wave.n_chirps * settings.pad[1])
    rate, span = window(settings.rate_window, wave.n_chirps), window(settings.range_window, wave.n_samples)
    inside = snr * _straddled(rate, settings.pad[1]) * _straddled(span, settings.pad[0])
    folds = np.arange(1.0, radar.waveform.fold_count)

    def passed(turns: Any) -> NDArray[np.float64]:
        return np.asarray(np.abs(np.exp(2j * np.pi * np.multiply.outer(turns, starts)).mean(axis=-1)) ** 2)

    # The wrong fold may lie to either side of the true one, as may the row of the cell.
    lost = passed(half) - np.maximum(passed(folds + half), passed(folds - half))
    apart = np.maximum(1.0 - passed(folds), np.finfo(float).tiny)
    spread = np.sqrt(apart * (2.0 * inside + 2.0 * len(radar.elements)))
    above = (inside * lost - CLEAR) / spread
    return float(sum(0.5 * math.erfc(x / math.sqrt(2.0)) for x in above))


def least_snr(radar: Radar) -> float:
    """Return the SNR of a detection from which its fold by staggered ramps is wrong in less than WRONG of all cases, to
    a hundredth of a dB; inf: from none below 200 dB."""
    low, high = 0.0, 200.0
    if wrong_fold(10.0 ** (0.1 * high), radar) > WRONG:
        return math.inf
    while high - low > 0.01:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if wrong_fold(10.0 ** (0.1 * middle), radar) > WRONG else (low, middle)
    return float(10.0 ** (0.1 * high))


def _straddled(taper: NDArray[np.float64], pad: int) -> float:
    """Return the share of an echo's power that a cell holds whose middle is half a cell off."""
    turns = np.exp(1j * np.pi * np.arange(len(taper)) / (len(taper) * pad))
    return float(np.abs((taper * turns).sum() / taper.sum()) ** 2)


def unfolded(map: RangeDoppler, found: Detections, radar: Radar) -> Detections:
    """Return detections with the true ranges that their rates give, ambiguous where another fold explains their cell as
    well. A folded rate leaves part of its Doppler shift in the beat frequency, which is taken off the range; of any map
    that is so of a peak beyond the last row, whose cell is the first."""
    if not len(found.rate):
        return found
    span, (rows, columns), waveform = 2.0 * map.unambiguous_rate, found.cell.T, radar.waveform
    # The shift of the row that a cell is in is undone.
    left = span * np.rint((found.rate - map.rate[rows]) / span)
    shift = 0.0 if isinstance(waveform, OwnWaveform) else left * waveform.middle / waveform.slope
    ambiguous = found.ambiguous | (map.open[rows, columns] if isinstance(map, ResolvedMap) else False)
    far = found.range - shift
    before = far < -BEFORE * float(np.diff(map.range[:2]).sum())
    if waveform.complex_sampling:
        # Ranges wrap: what the shift takes beyond one end comes from the other.
        beyond = before | (far >= waveform.unambiguous_range)
        far = np.where(beyond, far % waveform.unambiguous_range, far)
    else:
        # With real sampling that is the mirror image of an echo, which explanations find where it stands.
        ambiguous = ambiguous | before
    return found.replace(range=np.where(before, far, np.maximum(far, 0.0)), ambiguous=ambiguous)
