"""What the receiver's processing loses of an echo and no error states: the wave is spherical where a beam takes it for
plane, and the echo moves over range cells while the frame lasts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.radar.aperture import cosines
from raychan.radar.radar import Radar
from raychan.radar.waveform import OwnWaveform
from raychan.radar.windows import window
from raychan.records import Detections
from raychan.run.receiver import aperture_of
from raychan.units import C0, db

Floats = NDArray[np.float64]


def near_field_losses(found: Detections, radar: Radar) -> Floats:
    """Return what a beam of plane waves loses of the spherical wave of each detection (n,) [dB], and zeros where there
    is no beam."""
    aperture = aperture_of(radar)
    if not any(aperture.scans) or radar.rx_position is not None:
        return np.zeros(len(found.range))
    u, w = cosines(np.nan_to_num(found.azimuth), np.nan_to_num(found.elevation)).T
    look = np.stack([np.sqrt(np.maximum(1.0 - u**2 - w**2, 0.0)), u, w], axis=1)
    held = np.ones(len(look))
    for elements in (radar.tx_elements, radar.elements):
        # An array beside the phase centre sees another direction, which its beam finds.
        places = elements - elements.mean(axis=0)
        source = found.range[:, None] * look - elements.mean(axis=0)
        away = np.linalg.norm(source, axis=1)
        along = source @ places.T / np.maximum(away, 1e-9)[:, None]
        longer = np.linalg.norm(source[:, None] - places, axis=2) - away[:, None] + along
        held *= np.abs(np.exp(2j * np.pi / aperture.wavelength * longer).mean(axis=1)) ** 2
    return -db(np.maximum(held, 1e-30))


def far_field_distance(radar: Radar) -> float:
    """Return 2 D^2 / wavelength [m] of the radar's widest array, of transmitters or receivers."""
    spans = (np.linalg.norm(np.ptp(x, axis=0)) for x in (radar.tx_elements, radar.elements))
    return float(2.0 * max(spans) ** 2 * radar.waveform.middle / C0)


def migration(rate: Floats, radar: Radar) -> tuple[Floats, Floats]:
    """Return over how many range cells echoes of true rates (n,) [m/s] move during a frame, and what their peaks lose
    by it (n,) [dB]: the mean response of the range window over the frame, weighted by the rate window."""
    wave, settings = radar.channel_waveform, radar.processing
    if isinstance(wave, OwnWaveform):
        return np.zeros(len(rate)), np.zeros(len(rate))
    taper, weight = (
        window(name, n) for name, n in ((settings.range_window, wave.n_samples), (settings.rate_window, wave.n_chirps))
    )
    moved = np.abs(np.nan_to_num(rate)) * wave.frame_duration / wave.range_resolution
    turn = 2.0 * np.pi * (np.arange(wave.n_samples) - 0.5 * (wave.n_samples - 1)) / wave.n_samples
    mid = (np.arange(wave.n_chirps) - 0.5 * (wave.n_chirps - 1)) / wave.n_chirps
    held = np.ones(len(rate))
    for i in np.flatnonzero(moved > 0.0):
        # What each sample keeps of the sum over the ramps, of which each turns it by as many cells as the echo moved.
        over_ramps = np.cos(np.multiply.outer(turn, moved[i] * mid)) @ weight / weight.sum()
        held[i] = (over_ramps @ taper / taper.sum()) ** 2
    return moved, -db(np.maximum(held, 1e-30))
