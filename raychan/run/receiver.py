"""What the receiver makes of samples, and its noise where tracing asks for it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.poses import direction
from raychan.processing.aperture import Aperture
from raychan.processing.beams import BeamBank
from raychan.processing.cfar import Grid, fitting_guard
from raychan.processing.detection import Array, detect
from raychan.processing.range_doppler import range_doppler
from raychan.radar.radar import Radar
from raychan.radar.windows import processing_gain, window
from raychan.records import Cube, Detections, MapError, RangeDoppler

Floats = NDArray[np.float64]


def map_of(cube: Cube, radar: Radar, settings: Any) -> RangeDoppler:
    """Return the range-Doppler map of samples; settings: windows and padding of a scene file's [processing]."""
    return range_doppler(cube, radar.waveform, settings.range_window, settings.rate_window, settings.pad)


def detections_in(rdmap: RangeDoppler, radar: Radar, settings: Any) -> Detections:
    """Return what the receiver detects in its map; it sees nothing else of the scene."""
    # The scene file names range before rate; a map's axes are rate, then range.
    sizes = {name: cells[::-1] for name in ("guard", "train") if (cells := getattr(settings, name)) is not None}
    guard = fitting_guard(Grid.of(rdmap).count, sizes.get("guard"), sizes.get("train"))
    if guard is not None:
        sizes["guard"] = guard
    return detect(
        rdmap,
        pfa=settings.pfa,
        min_snr_db=settings.min_snr_db,
        method=settings.cfar,
        ego_speed=radar.ego_speed,
        windows=(settings.rate_window, settings.range_window),
        waveform=radar.waveform,
        elements=receivers(radar),
        array=Array(settings.beams, settings.doa, settings.beam_window),
        **sizes,
    )


def receivers(radar: Radar) -> Floats:
    """Return the phase centres (a, 3) [m] of the map's antennas, in the antenna's frame."""
    return np.asarray(radar.elements)


def beam_gain(radar: Radar, settings: Any) -> float:
    """Return by how much the detector's beams raise an echo above the noise: 1 for one receiver or their mean."""
    aperture = Aperture(receivers(radar), radar.waveform.wavelength)
    if settings.beams != "coherent" or not any(aperture.scans):
        return 1.0
    return 1.0 / BeamBank(aperture, settings.beam_window).noise_gain


def noise_equivalent_amplitude(radar: Radar, settings: Any) -> float:
    """Return the scattered amplitude [1/m, unit field at 1 m] of a return as strong as the noise in one cell of the
    map, or of a beam over it."""
    if not radar.noise:
        return 0.0
    # The strongest direction of both antennas, on a grid finer than any beam of use.
    azimuth, elevation = np.meshgrid(np.radians(np.arange(-90.0, 90.1, 1.0)), np.radians(np.arange(-60.0, 60.1, 1.0)))
    look = direction(azimuth.ravel(), elevation.ravel()) @ radar.axes.T
    ends = (np.linalg.norm(f(look), axis=1).max() for f in (radar.tx_field, radar.rx_field))
    amplitude = np.sqrt(noise_of_cell(radar, settings) / beam_gain(radar, settings) / radar.power)
    return float(amplitude * 4.0 * np.pi / radar.waveform.wavelength / np.prod(list(ends)))


def noise_of_cell(radar: Radar, settings: Any) -> float:
    """Return the thermal noise [W] of one cell of the map; 0 when noise is off."""
    if not radar.noise:
        return 0.0
    wave = radar.waveform
    gain = processing_gain(window(settings.range_window, wave.n_samples))
    return float(radar.noise_power / gain / processing_gain(window(settings.rate_window, wave.n_chirps)))


def map_error(quiet: Cube, others: Cube, radar: Radar, settings: Any) -> MapError:
    """Return the map of what two launches differ by: the samples of one less those of the other, without noise."""
    return MapError(quiet_map(quiet.samples - others.samples, radar, settings))


def quiet_map(samples: Any, radar: Radar, settings: Any) -> Any:
    """Return the powers (v, r) [W] of the map of samples (antenna, chirp, sample) without noise."""
    cube = Cube(samples=np.asarray(samples, np.complex64), noise_power=0.0)
    windows = (settings.range_window, settings.rate_window, settings.pad)
    return range_doppler(cube, radar.waveform, *windows).power
