"""How much of a cell's power beams of the virtual array explain: the strongest alone, or a few together."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.parallel import parallel_for
from raychan.processing.fold_kernels import climb_all, fit_beams, left_by
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
_BATCH = 1 << 18  # beams times cells, or elements, at once, 2 MB: weights of a beam are made once for all cells
_CELLS = 200  # at least, for a thread to help: some milliseconds (not measured)


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
        counts = np.ceil(_PER_BEAM * np.ptp(array.places, axis=0) / array.wavelength).astype(int)
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
        power, at = (x.reshape(len(held), -1, *x.shape[1:]) for x in self._tested(np.concatenate(held, axis=1)))
        top = power.max(axis=0)
        near = power >= _LEFT * top
        near &= (near.sum(axis=0) > 1) & (clear < WEAK * top)
        for k, values in enumerate(held):
            some = np.flatnonzero(near[k])
            level, towards = power[k, some], at[k, some]
            climb_all(level, towards, np.ascontiguousarray(values[:, some].T), *self._search, _SHRINKS)
            power[k, some], at[k, some] = level, towards
        return power, at

    def fitted_together(self, values: Complexes, at: Floats) -> tuple[Floats, Floats]:
        """Return the power (c,) that beams towards cosines (c, k, 2) and one more explain together, by the scale of
        one beam, and the cosines (c, k + 1, 2): each is by turns refined on what the others leave.

        Args: values (c, t * a) of cells. Source: Li and Stoica 1996 (RELAX)."""
        values, rest = np.ascontiguousarray(values, np.complex64), np.empty(values.shape, np.complex64)
        left_by(rest, np.ascontiguousarray(at), values, self.places)
        at, power = np.concatenate([at, self._tested(rest.T)[1][:, None]], axis=1), np.empty(len(values))

        def fit(some: slice) -> None:
            fit_beams(power[some], at[some], values[some], *self._search, _TURNS, _SHRINKS)

        parallel_for(len(values), fit, _CELLS)
        return power, at

    def _tested(self, values: Complexes) -> tuple[Floats, Floats]:
        """Return the power (c,) that the strongest of the beams sees of values (t * a, c), and its cosines (c, 2)."""
        cells = np.arange(values.shape[1])
        power, at = np.full(len(cells), -1.0), np.zeros((len(cells), 2))
        some = max(1, _BATCH // max(values.shape))
        for beams in (self.at[i : i + some] for i in range(0, len(self.at), some)):
            wave = self.weights(beams) @ values
            level = wave.real**2 + wave.imag**2
            beam = level.argmax(axis=0)
            found = level[beam, cells]
            better = found > power
            power[better], at[better] = found[better], beams[beam[better]]
        return power, at

    @cached_property
    def _search(self) -> tuple[Floats, ...]:
        """Places, distances of beams alike, and the first step, as kernels take them."""
        return self.places, self.array.repeats, np.ascontiguousarray(self.array.skewed, np.float64), self.step


def squared(wave: Any) -> Floats:
    """Return the power of complex values."""
    return np.asarray(wave.real.astype(np.float64) ** 2 + wave.imag.astype(np.float64) ** 2)
