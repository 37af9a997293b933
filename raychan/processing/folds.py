"""By how many spans of unambiguous rates the echo of a cell is folded, of several transmitters, and where that is open.

Per cell the fold is the hypothesis under which the virtual array forms the strongest beam. A wrong one leaves steps of
phase between the transmitters, which take a share L of the power from any beam, or none: where the steps look like
another direction, both beams are equally strong, and rate and direction are ambiguous together. In white noise, with
S the SNR in the beam, the powers under two hypotheses differ by S L on average, with the deviation sqrt(2 S L), in
units of the noise: what they differ by tells them apart from the same number of times the noise on, at any S.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.processing.staggered import CLEAR, fold_range, least_power, noise_of
from raychan.radar.aperture import Aperture
from raychan.radar.radar import Radar
from raychan.records import RangeDoppler
from raychan.units import C0

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Complexes = NDArray[np.complex64]

_SURE = 0.05  # of the strongest beam: no more is asked of a fold to beat the slower ones, in weak cells (not measured)
_ALIKE = 1e-3
"""Of the strongest beam: powers nearer than this are equal, however weak the noise. Rounding, and the Doppler shift
that differs within a row of the map, change less (not measured)."""
_PER_BEAM = 4  # beams tested per aperture's beam width, before the strongest are refined
_LEFT = 0.5  # of a power that at least one beam sees: at the edge of the half space beams of few rows stand far apart
_WEAK = 0.25  # of the strongest beam: where CLEAR asks for more, cells are too weak for detections, and are not refined
_SHRINKS = 3  # rounds of refining, each over half the distance: by parabolas, to 1e-5 of the power
_BATCH = 1 << 22  # cells times beams at once: bounds the memory


def under(channels: Complexes, h: int, radar: Radar) -> Complexes:
    """Return channels (t, a, ...) if the echo is folded h times, from what the cells hold (t or slots, a, ...)."""
    many, slots = len(radar.tx_elements), radar.slots
    if radar.multiplexing == "ddm":
        return np.asarray(channels[(np.arange(many) - h) % slots])
    turn = np.exp(2j * np.pi * (h * np.arange(many) % slots) / slots).astype(np.complex64)
    return np.asarray(channels * turn.reshape(-1, *[1] * (channels.ndim - 1)))


def folds(channels: Complexes, radar: Radar, map: RangeDoppler) -> tuple[NDArray[np.int8], NDArray[np.bool_]]:
    """Return by how many spans the strongest echo of each cell is folded, and whether another fold explains the cell as
    well (v, r): of equal ones the slowest is taken."""
    fold, open_ = np.zeros(map.power.shape, np.int8), np.zeros(map.power.shape, bool)
    level = least_power(map, len(radar.virtual_elements))
    at = np.argwhere((np.abs(channels) ** 2).mean(axis=(0, 1)) > level)
    beams, tried = _Beams.of(radar), fold_range(radar.slots)
    clear = CLEAR * noise_of(map) * len(beams.places)
    for some in np.array_split(at, max(1, len(at) * len(beams.at) // _BATCH)):
        held = channels[:, :, some[:, 0], some[:, 1]]
        power = beams.strongest([under(held, h, radar).reshape(len(beams.places), -1) for h in tried], clear)
        top, chosen = power[0], np.zeros(len(some), np.int64)
        for k in range(1, len(tried)):
            # Folds are tried from the slowest rate on.
            better = power[k] > top + np.clip(clear, _ALIKE * power[k], _SURE * power[k])
            top, chosen = np.where(better, power[k], top), np.where(better, k, chosen)
        alike = power >= top - np.maximum(clear, _ALIKE * top)
        rows, columns = some.T
        fold[rows, columns], open_[rows, columns] = np.array(tried)[chosen], alike.sum(axis=0) > 1
    return fold, open_


@dataclass(frozen=True, eq=False)
class _Beams:
    """Beams of the virtual array over the half space ahead."""

    array: Aperture
    """All virtual elements."""
    places: Floats
    """(t * a, 3) [wavelengths] of the same."""
    at: Floats
    """Cosines (b, 2) of the beams along y and z."""
    step: Floats
    """Distance (2,) of neighbours; 0 along an axis of one."""

    @classmethod
    def of(cls, radar: Radar) -> _Beams:
        """Return the beams of a radar."""
        array = Aperture(radar.virtual_elements, C0 / radar.waveform.middle)
        places = array.elements / array.wavelength
        counts = np.ceil(_PER_BEAM * np.ptp(places[:, 1:], axis=0)).astype(int)
        y, z = (np.linspace(-1.0, 1.0, 2 * n + 1) if n else np.zeros(1) for n in counts)
        at = np.stack([x.ravel() for x in np.meshgrid(y, z)], axis=1)
        return cls(array, places, at[(at**2).sum(axis=1) <= 1.0], np.where(counts, 1.0 / np.maximum(counts, 1), 0.0))

    def weights(self, at: Floats) -> Complexes:
        """Return the weights (..., t * a) of beams towards cosines (..., 2)."""
        ahead = np.sqrt(np.maximum(1.0 - (at**2).sum(axis=-1, keepdims=True), 0.0))
        turns = np.concatenate([ahead, at], axis=-1) @ self.places.T
        return np.exp(-2j * np.pi * turns).astype(np.complex64)

    def strongest(self, held: list[Complexes], clear: float) -> Floats:
        """Return the power (h, c) of the strongest beam under each hypothesis, from what cells hold under it
        (t * a, c). Refined are those that may be the strongest or as strong as it, of cells that are not weak."""
        weights, cells = self.weights(self.at), np.arange(held[0].shape[1])
        best, power = np.zeros((2, len(held), len(cells)))
        beam = best.astype(np.int64)
        for k, values in enumerate(held):
            level = _squared(weights @ values)
            beam[k] = level.argmax(axis=0)
            power[k] = level[beam[k], cells]
        top = power.max(axis=0)
        near = power >= _LEFT * top
        near &= (near.sum(axis=0) > 1) & (clear < _WEAK * top)
        for k, values in enumerate(held):
            some = np.flatnonzero(near[k])
            power[k, some] = self._refined(values[:, some].T, self.at[beam[k, some]], power[k, some])
        return np.asarray(power)

    def _refined(self, values: Complexes, at: Floats, power: Floats) -> Floats:
        """Return the power (c,) of the peaks next to beams towards cosines (c, 2), in cells that hold (c, t * a)."""

        def of(towards: Floats) -> Floats:
            return _squared((self.weights(towards) * values).sum(axis=1))

        step = self.step
        for _ in range(_SHRINKS if len(at) else 0):
            for axis in np.flatnonzero(step):
                aside = step * (np.arange(2) == axis)
                below, above = of(at - aside), of(at + aside)
                bend = below - 2.0 * power + above
                shift = np.divide(0.5 * (below - above), bend, out=np.sign(above - below), where=bend < 0.0)
                tried = self.array.visible(at + np.clip(shift, -1.0, 1.0)[:, None] * aside)
                value = of(tried)
                better = value > power
                at, power = np.where(better[:, None], tried, at), np.where(better, value, power)
            step = 0.5 * step
        return power


def _squared(wave: Any) -> Floats:
    return np.asarray(wave.real.astype(np.float64) ** 2 + wave.imag.astype(np.float64) ** 2)
