"""Two equal echoes a beam width apart in one cell: what a bank of beams resolves, and what MUSIC does.

The pair of the driving paper's section 3.4: 24 GHz, 32 receivers 5 mm apart, targets at +-2 deg. Echoes in one cell are
coherent, so whether beams show two peaks depends on their relative phase, at the array's centre.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.processing.doa import estimate
from raychan.radar.aperture import Aperture, cosines
from raychan.units import C0, undb

Floats = NDArray[np.float64]
Complexes = NDArray[np.complexfloating[Any, Any]]

CARRIER, SPACING, RECEIVERS, AZIMUTH_DEG = 24e9, 5e-3, 32, 2.0
SNR_DB = 60.2
"""6 dB a sample and 54.2 dB gain of both FFTs."""
_FIELD_DEG, _FINE = 15.0, 3001  # beams so near that a fine grid of them shows every peak


@dataclass(frozen=True, eq=False)
class PairSweep:
    """What is found over relative phases (p,) [rad] of two echoes at `azimuth` (2,) [rad]."""

    phase: Floats
    azimuth: Floats
    beams: tuple[Floats, ...]
    """Azimuths [rad] of the beam pattern's peaks, at each phase."""
    music: tuple[Floats, ...]
    """Azimuths [rad] that MUSIC finds for two sources, at each phase."""
    tolerance: float
    """[rad] by which a direction found by MUSIC may be off"""

    @property
    def resolved_by_beams(self) -> float:
        """Share of phases at which the beams show two peaks, wherever: the paper's own measure."""
        return float(np.mean([len(found) == 2 for found in self.beams]))

    @property
    def resolved_by_music(self) -> float:
        """Share of phases at which MUSIC finds both directions to the tolerance."""
        good = [len(f) == 2 and float(np.abs(f - self.azimuth).max()) <= self.tolerance for f in self.music]
        return float(np.mean(good))

    def methods(self) -> list[tuple[str, tuple[Floats, ...], float]]:
        """Return name, directions and share of both methods."""
        beams = f"beams over {2 * _FIELD_DEG:g} deg"
        return [(beams, self.beams, self.resolved_by_beams), ("MUSIC", self.music, self.resolved_by_music)]


def pair_sweep(phases: int = 72, snr_db: float = SNR_DB, tolerance_deg: float = 0.2, seed: int = 0) -> PairSweep:
    """Return what beams and MUSIC make of the paper's pair over relative phases.

    Args: phases, how many, evenly over a turn; snr_db [dB] of each echo in the cell at one receiver; tolerance_deg
    [deg] of MUSIC; seed of the noise.
    MUSIC: one snapshot, sub-arrays of 22 receivers averaged forwards and backwards.
    """
    rng = np.random.default_rng(seed)
    line = np.zeros((RECEIVERS, 3))
    line[:, 1] = (np.arange(RECEIVERS) - 0.5 * (RECEIVERS - 1)) * SPACING
    aperture = Aperture(line, C0 / CARRIER)
    truth = np.radians([-AZIMUTH_DEG, AZIMUTH_DEG])
    steering = aperture.steering(cosines(truth))
    phase = np.arange(phases) * 2.0 * np.pi / phases
    beams, music = [], []
    for turn in phase:
        noise = rng.standard_normal((2, RECEIVERS)) * np.sqrt(0.5 / undb(snr_db))
        snapshot = steering[0] + np.exp(1j * turn) * steering[1] + noise[0] + 1j * noise[1]
        beams.append(_peaks(snapshot, aperture))
        found = estimate(snapshot[None], aperture, "music", 2)
        music.append(np.sort(aperture.angles(found)[0]))
    return PairSweep(phase, truth, tuple(beams), tuple(music), float(np.radians(tolerance_deg)))


def _peaks(snapshot: Complexes, aperture: Aperture) -> Floats:
    """Return the azimuths [rad] of the peaks of the beam pattern over the field of view, to half of the greatest."""
    azimuth = np.radians(np.linspace(-_FIELD_DEG, _FIELD_DEG, _FINE))
    power = np.abs(aperture.steering(cosines(azimuth)).conj() @ snapshot) ** 2
    inner = (power[1:-1] > power[:-2]) & (power[1:-1] >= power[2:]) & (power[1:-1] > 0.5 * power.max())
    return azimuth[1:-1][inner]
