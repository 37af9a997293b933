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
from raychan.processing.own_waveform import map_by_waveform
from raychan.radar.radar import Radar
from raychan.radar.waveform import OwnWaveform, Waveform
from raychan.records import Cube, Detections, RangeDoppler
from raychan.units import C0

Complexes = NDArray[np.complex64]

_STRONG = 10.0
"""Times the noise, in the beam over all channels: weaker echoes keep the hypothesis "not folded" (not measured)."""
CLEAR = 12.0
"""Times the noise by which a fold must beat a slower one: less gives folds of noise, more asks for a higher SNR."""


@dataclass(frozen=True)
class ResolvedMap(RangeDoppler):
    """A map whose cells know by how many spans of unambiguous rates their echo is folded."""

    fold: NDArray[np.int8] = column("v r", np.int8, doc="true rate = rate + 2 unambiguous_rate fold")


def resolved(map: RangeDoppler, spectrum: Complexes, fold: NDArray[np.int8], noise: float) -> ResolvedMap:
    """Return a map with another spectrum (channels, v, r), its folds (v, r) and its noise [W] a cell."""
    held = {name: getattr(map, name) for name in RangeDoppler.__dataclass_fields__}
    power = (spectrum.real.astype(np.float64) ** 2 + spectrum.imag.astype(np.float64) ** 2).mean(axis=0)
    return ResolvedMap(**(held | {"spectrum": spectrum, "power": power, "noise": noise, "fold": fold}))


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

    A beam sees an echo `channels` times stronger over the noise than one channel does. Without noise its place is taken
    by the median cell.
    """
    return (1.0 + _STRONG / channels) * (map.noise or float(np.median(map.power)))


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
    return resolved(map, sums, fold, map.noise / count)


def least_snr(waveform: Waveform) -> float:
    """Return the SNR of a detection from which the folds of staggered ramps are told apart; inf: never.

    Two folds differ by the power that the wrong one loses: 1 - |mean_k exp(j 2 pi h t_k / P)|^2.
    """
    count = len(waveform.stagger)
    starts = np.array([waveform.start_of(k) for k in range(count)])
    apart = np.arange(1, waveform.fold_count)
    turns = np.exp(2j * np.pi * np.outer(apart, starts) / sum(waveform.stagger))
    lost = 1.0 - np.abs(turns.mean(axis=1)) ** 2
    return float(CLEAR / lost.min()) if len(lost) and lost.min() > 0.0 else math.inf


def unfolded(map: RangeDoppler, found: Detections, radar: Radar) -> Detections:
    """Return detections with the true rates, speeds and ranges that the folds of a ResolvedMap give; of other maps the
    same. A folded rate leaves part of its Doppler shift in the beat frequency, which is taken off the range."""
    if not isinstance(map, ResolvedMap) or not len(found.rate):
        return found
    span, (rows, columns) = 2.0 * map.unambiguous_rate, found.cell.T
    # A peak between two cells may lie beyond the end of the axis that its own cell is on.
    folds = map.fold[rows, columns] + np.rint((map.rate[rows] - found.rate) / span)
    # Folds as many as are tested apart look alike.
    tested = hypotheses(radar)
    folds -= tested * np.rint((found.rate + span * folds) / (span * tested))
    more, waveform = span * folds, radar.waveform
    shift = 0.0 if isinstance(waveform, OwnWaveform) else more * waveform.middle / waveform.slope
    return found.replace(rate=found.rate + more, speed=found.speed + more, range=found.range - shift)
