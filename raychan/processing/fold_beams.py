"""How much of a cell's power beams of the virtual array explain: the strongest alone, or a few together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.radar.aperture import Aperture
from raychan.radar.radar import Radar
from raychan.units import C0

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Complexes = NDArray[np.complexfloating[Any, Any]]

_PER_BEAM = 4  # beams tested per aperture's beam width, before the strongest are refined
_LEFT = 0.5  # of a power that at least one beam sees: at the edge of the half space beams of few rows stand far apart
WEAK = 0.25  # of the strongest beam: where CLEAR asks for more, cells are too weak for detections, and are not refined
_SHRINKS = 3  # rounds of refining, each over half the distance: by parabolas, to 1e-5 of the power
_TURNS = 4  # rounds in which several beams are refined, each on what the others leave (not measured)
_RIDGE = 1e-6  # of a beam's weight: beams that come to lie on each other have amplitudes nevertheless (not measured)


@dataclass(frozen=True, eq=False)
class Beams:
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
    def of(cls, radar: Radar) -> Beams:
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
        # Sines of single precision, of less than a turn: weights take a third of the time of exp of complex numbers.
        phase = (-2.0 * np.pi * (turns - np.rint(turns))).astype(np.float32)
        out = np.empty(phase.shape, np.complex64)
        np.cos(phase, out=out.real)
        np.sin(phase, out=out.imag)
        return out

    def strongest(self, held: list[Complexes], clear: float) -> tuple[Floats, Floats]:
        """Return the power (h, c) of the strongest beam under each hypothesis, from what cells hold under it
        (t * a, c), and its cosines (h, c, 2). Refined are those that may be the strongest or as strong as it, of cells
        that are not weak."""
        weights, cells = self.weights(self.at), np.arange(held[0].shape[1])
        power, at = np.zeros((len(held), len(cells))), np.zeros((len(held), len(cells), 2))
        for k, values in enumerate(held):
            level = squared(weights @ values)
            beam = level.argmax(axis=0)
            power[k], at[k] = level[beam, cells], self.at[beam]
        top = power.max(axis=0)
        near = power >= _LEFT * top
        near &= (near.sum(axis=0) > 1) & (clear < WEAK * top)
        for k, values in enumerate(held):
            some = np.flatnonzero(near[k])
            power[k, some], at[k, some] = self._refined(values[:, some].T, at[k, some], power[k, some])
        return power, at

    def fitted_together(self, values: Complexes, at: Floats) -> tuple[Floats, Floats]:
        """Return the power (c,) that beams towards cosines (c, k, 2) and one more explain together, by the scale of
        one beam, and the cosines (c, k + 1, 2): each is by turns refined on what the others leave.

        Args: values (c, t * a) of cells. Source: Li and Stoica 1996 (RELAX)."""
        level = squared(self.weights(self.at) @ self._rest(values, at).T)
        more = self.at[level.argmax(axis=0)]
        at = np.concatenate([at, more[:, None]], axis=1)
        for _ in range(_TURNS):
            for k in range(at.shape[1]):
                rest = self._rest(values, at, k)
                start = squared((self.weights(at[:, k]) * rest).sum(axis=1))
                at[:, k] = self._refined(rest, at[:, k], start)[1]
        left = squared(self._rest(values, at)).sum(axis=1)
        return (squared(values).sum(axis=1) - left) * len(self.places), at

    def _rest(self, values: Complexes, at: Floats, own: int | None = None) -> Complexes:
        """Return what plane waves from cosines (c, k, 2), fitted by least squares, leave of values (c, t * a), or all
        but one of them."""
        weights = self.weights(at).astype(np.complex128)
        gram = weights @ weights.conj().transpose(0, 2, 1)
        gram += _RIDGE * len(self.places) * np.eye(at.shape[1])
        waves = np.linalg.solve(gram, weights @ values[:, :, None])
        if own is not None:
            waves[:, own] = 0.0
        return np.asarray(values - (weights.conj() * waves).sum(axis=1))

    def _refined(self, values: Complexes, at: Floats, power: Floats) -> tuple[Floats, Floats]:
        """Return the power (c,) and the cosines (c, 2) of the peaks next to beams towards cosines (c, 2), in cells that
        hold (c, t * a)."""

        def of(towards: Floats) -> Floats:
            return squared((self.weights(towards) * values).sum(axis=1))

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
        return power, at


def squared(wave: Any) -> Floats:
    """Return the power of complex values."""
    return np.asarray(wave.real.astype(np.float64) ** 2 + wave.imag.astype(np.float64) ** 2)
