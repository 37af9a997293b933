"""By how many spans of unambiguous rates the echo of a cell is folded, of several transmitters, and where that is open.

Per cell the fold is the hypothesis under which the virtual array forms the strongest beam. A wrong one leaves steps of
phase between the transmitters, which take a share L of the power from any beam, or none: where the steps look like
another direction, both beams are equally strong, and rate and direction are ambiguous together. In white noise, with
S the SNR in the beam, the powers under two hypotheses differ by S L on average, with the deviation sqrt(2 S L), in
units of the noise: what they differ by tells them apart from the same number of times the noise on, at any S.

Of two like echoes in a cell the strongest beam says little: under the wrong fold the lobes of both may add to more than
either has under the true one. Where one beam leaves more than noise, hypotheses are judged by what a few explain. Cells
on the slope of an echo have its fold wherever that is as likely as any other.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.processing.fold_beams import WEAK, Beams, squared
from raychan.processing.peaks import AROUND
from raychan.processing.slots import Slots
from raychan.processing.staggered import CLEAR, fold_range, least_power, noise_of
from raychan.radar.radar import Radar
from raychan.records import RangeDoppler

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Complexes = NDArray[np.complex64]

_SURE = 0.05  # of the strongest beam: no more is asked of a fold to beat the slower ones, in weak cells (not measured)
_ALIKE = 1e-3
"""Of the strongest beam: powers nearer than this are equal, however weak the noise. Rounding, and the Doppler shift
that differs within a row of the map, change less (not measured)."""
_MOST = 3
"""Beams that explain a cell: more are rarely needed, and explain anything of few receivers (not measured)."""
_SPREAD = 4.0  # deviations of the noise in all channels by which a cell is more than noise (not measured)
_UPHILL = 12  # map cells along a slope: main lobes padded four times are hardly wider (not measured)
_BATCH = 1 << 14  # cells times elements at once: takes 0.2 to 0.7 of the time of 1 << 22 (12 and 96 elements)


def folds(
    channels: Complexes, radar: Radar, slots: Slots, map: RangeDoppler
) -> tuple[NDArray[np.int8], NDArray[np.bool_]]:
    """Return by how many spans the strongest echo of each cell is folded, and whether another fold explains the cell as
    well (v, r), by the channels of slots (s, a, v, r): of equal ones that of the echo on whose slope the cell is, or
    the slowest."""
    level, power = least_power(map, len(radar.virtual_elements)), squared(channels).mean(axis=(0, 1))
    at = np.argwhere(power > level)
    beams, tried = Beams.of(radar), np.array(fold_range(radar.slots))
    chosen, alike = np.zeros(len(at), np.int64), np.zeros((len(tried), len(at)), bool)
    noise = noise_of(map) * len(beams.places)
    for some in np.array_split(np.arange(len(at)), max(1, len(at) * len(beams.places) // _BATCH)):
        cells = channels[:, :, *at[some].T]
        held = [slots.under(cells, h)[: slots.senders].reshape(len(beams.places), -1) for h in tried]
        total = len(beams.places) * squared(cells).sum(axis=(0, 1))
        explained, clear = _explained(beams, held, total, noise, channels.shape[0] * channels.shape[1])
        chosen[some], alike[:, some] = _judged(explained, clear)
    fold, open_ = np.zeros(map.power.shape, np.int8), np.zeros(map.power.shape, bool)
    rows, columns = at.T
    fold[rows, columns] = tried[_uphill(power, at, chosen, alike)]
    open_[rows, columns] = alike.sum(axis=0) > 1
    return fold, open_


def _uphill(power: Floats, at: Ints, chosen: Ints, alike: NDArray[np.bool_]) -> Ints:
    """Return the hypotheses (c,) of cells (c, 2) of a map of power (v, r) after those on a slope take that of the
    strongest cell next to them, where it is as likely (h, c) as the one chosen for them: the slopes of an echo are its
    own, and do not peak under another fold. Over the end of the rates nothing is taken."""
    index = np.full((power.shape[0] + 2, power.shape[1]), -1)
    index[at[:, 0] + 1, at[:, 1]] = np.arange(len(at))
    top, above = power[tuple(at.T)], np.arange(len(at))
    for down, along in AROUND:
        near = index[at[:, 0] + 1 + down, (at[:, 1] + along) % power.shape[1]]
        level = np.where(near >= 0, power[tuple(at[near].T)], 0.0)
        above, top = np.where(level > top, near, above), np.maximum(level, top)
    several = alike.sum(axis=0) > 1
    for _ in range(_UPHILL):
        taken = several & alike[chosen[above], np.arange(len(at))]
        chosen = np.where(taken, chosen[above], chosen)
    return chosen


def _judged(power: Floats, clear: Floats) -> tuple[Ints, NDArray[np.bool_]]:
    """Return which hypothesis (c,) is taken, and which (h, c) are as likely, by the powers (h, c) that they explain.

    Args: clear (c,) [same unit], powers nearer than this are alike. Hypotheses are in order of the rate."""
    top, chosen = power[0], np.zeros(power.shape[1], np.int64)
    for k in range(1, len(power)):
        # Folds are tried from the slowest rate on.
        better = power[k] > top + np.clip(clear, _ALIKE * power[k], _SURE * power[k])
        top, chosen = np.where(better, power[k], top), np.where(better, k, chosen)
    return chosen, power >= top - np.maximum(clear, _ALIKE * top)


def _explained(beams: Beams, held: list[Complexes], total: Floats, noise: float, many: int) -> tuple[Floats, Floats]:
    """Return the power (h, c) that beams explain under each hypothesis, and what powers differ by that are alike (c,).

    One beam, or in cells where it leaves more than noise, up to _MOST. Where these do under all hypotheses, echoes are
    folded differently: the strongest beam decides, and where several together favour another fold, both are alike.
    Args: held, values (t * a, c) under each; total (c,), power of so many channels, on the scale of a beam; noise of a
    beam."""
    clear, cells = CLEAR * noise, np.arange(len(total))
    power, at = beams.strongest(held, clear)
    one, places = power.copy(), at[:, :, None]
    usual = np.maximum(noise * (many + _SPREAD * np.sqrt(many)), _ALIKE * total)
    for _ in range(1, min(_MOST, len(beams.places) // 2)):
        top = power.max(axis=0)
        more = np.flatnonzero((total - top > usual) & (clear < WEAK * top))
        if not len(more):
            break
        before, places = places[:, more], np.concatenate([places, places[:, :, -1:]], axis=2)
        values = np.concatenate([x[:, more].T for x in held])
        both, at = beams.fitted_together(values, before.reshape(-1, *before.shape[2:]))
        places[:, more] = at.reshape(len(held), -1, *at.shape[1:])
        power[:, more] = np.maximum(power[:, more], both.reshape(len(held), -1))
    unlike = total - power.max(axis=0) > usual
    doubt = one.max(axis=0) - one[power.argmax(axis=0), cells]
    return np.where(unlike, one, power), np.where(unlike, np.maximum(doubt, clear), clear)
