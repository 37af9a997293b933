"""By how many spans an echo is folded in whose cell side lobes of others show.

A cell's fold is that under which the strongest beam, or a few, explain most of it (see processing.folds). Side lobes of
an echo of another fold may favour a wrong one. Where their waves are known, folds are judged by what one more wave
explains beside them, by least squares.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.processing.slots import Slots
from raychan.processing.spectra import PER_BEAM
from raychan.radar.aperture import Aperture

Complexes = NDArray[np.complexfloating[Any, Any]]

_ALONE = 0.1  # of a wave that known ones must leave: what they explain themselves says nothing (not measured)
_RANK = 1e-3  # of the strongest combination of known waves: weaker ones are none of their own (not measured)


def judged_beside(
    data: Complexes, known: Complexes, aperture: Aperture, slots: Slots, clear: float
) -> tuple[int, bool]:
    """Return how many times more than it is read an echo is folded, and whether another fold explains it as well.

    Args: data (s * a,) of a cell; known waves (k, s * a) of others in it; aperture of the virtual array; clear, power
    [W] in all channels by which a fold must beat that under which the cell is read."""
    _, size, basis = np.linalg.svd(known, full_matrices=False)
    basis = basis[size > _RANK * size[0]]
    rest = data - (data @ basis.conj().T) @ basis
    beams = aperture.steering(aperture.spread(PER_BEAM) if aperture.deep else aperture.grid(PER_BEAM).points)
    many, power = beams.shape[1], []
    for h in slots.folds:
        waves = slots.waves(beams, [h] * len(beams))
        alone = many - (np.abs(waves @ basis.conj().T) ** 2).sum(axis=1)
        seen = np.abs(waves.conj() @ rest) ** 2 / np.maximum(alone, _ALONE * many)
        power.append(float(np.where(alone > _ALONE * many, seen, 0.0).max()))
    best = int(np.argmax(power))
    best = best if power[best] > power[0] + clear else 0
    return best, sum(p >= power[best] - clear for p in power) > 1
