"""What the receiver makes of samples, and its noise where tracing asks for it."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.parallel import parallel_for
from raychan.poses import direction
from raychan.processing.beams import BeamBank
from raychan.processing.cfar import Grid, fitting_guard
from raychan.processing.detection import Array, detect, least_power, seen_in
from raychan.processing.detector_map import DetectorMap
from raychan.processing.mimo import virtual_range_doppler
from raychan.processing.peaks import SideLobes, strongest
from raychan.processing.staggered import hypotheses, unfolded
from raychan.radar.aperture import Aperture
from raychan.radar.declared import check_type
from raychan.radar.radar import Radar
from raychan.radar.windows import processing_gain, window
from raychan.records import Cube, Detections, MapError, RangeDoppler
from raychan.reprs import counted
from raychan.units import C0, undb

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex64]

_ROWS = 64  # of a map's errors from which on a second thread pays; not measured
FAINT = 1e-8  # of the strongest cell: the weakest detection or shoulder possible where there is no noise; not measured


def map_of(cube: Cube, radar: Radar, settings: Any, cross: bool = False) -> RangeDoppler:
    """Return the range-Doppler map of samples; settings: windows and padding of a scene file's [processing]; cross: of
    the cross-polarised receivers, else of the co-polarised."""
    cube = channel(cube, radar, cross)
    return virtual_range_doppler(cube, radar, settings.range_window, settings.rate_window, settings.pad)


def channel(cube: Cube, radar: Radar, cross: bool = False) -> Cube:
    """Return the samples of the co-polarised receivers, or of the cross-polarised. Raises: ValueError if there are
    none."""
    if radar.rx_polarization != "both":
        if cross:
            raise ValueError('a radar without cross-polarised receivers: rx_polarization = "both" is wanted')
        return cube
    many = len(radar.elements)
    return cube.replace(samples=cube.samples[many:] if cross else cube.samples[:many])


def check_cube(cube: Cube, radar: Radar) -> None:
    """Raise ValueError unless samples are a cube, and as many as a radar records."""
    check_type("cube", cube, Cube)
    check_type("radar", radar, Radar)
    wave = radar.waveform
    own = radar.receivers, wave.n_chirps, wave.n_samples
    if cube.samples.shape != own:
        raise ValueError(f"cube of shape {cube.samples.shape} (receiver, chirp, sample); the radar has {own}")


def check_map(rdmap: RangeDoppler, radar: Radar) -> None:
    """Raise ValueError unless a map is one, and has a radar's antennas and cells."""
    check_type("rdmap", rdmap, RangeDoppler)
    check_type("radar", radar, Radar)
    wave = radar.waveform
    own = len(receivers(radar)), wave.range_resolution, 0.5 * C0 / wave.middle / wave.frame_duration
    given = len(rdmap.spectrum), rdmap.range_resolution, rdmap.rate_resolution
    if not np.allclose(given, own, rtol=1e-6, atol=0.0):
        found, wanted = (f"{counted(n, 'antenna')} and cells of {r:.4g} m by {v:.4g} m/s" for n, r, v in (given, own))
        raise ValueError(f"rdmap of {found}; the radar has {wanted}")


def seen_in_map(rdmap: RangeDoppler, radar: Radar, settings: Any) -> DetectorMap:
    """Return a map as the detector sees it, for the functions below: an array's beams take long."""
    return seen_in(rdmap, radar.waveform, receivers(radar), _array(settings))


def detections_in(rdmap: RangeDoppler, radar: Radar, settings: Any, seen: DetectorMap | None = None) -> Detections:
    """Return what the receiver detects in its map; it sees nothing else of the scene."""
    given = _detector(rdmap, radar, settings)
    found = detect(rdmap, ego_speed=radar.ego_speed, seen=seen, senders=radar.tx_elements, **given)
    return unfolded(rdmap, found, radar)


def least_in(
    rdmap: RangeDoppler, cells: NDArray[np.int64], radar: Radar, settings: Any, seen: DetectorMap | None = None
) -> Floats:
    """Return the power (c,) [W] that map cells (c, 2) need to become detections."""
    return least_power(rdmap, cells, seen=seen, **_detector(rdmap, radar, settings))


def shoulders_in(
    rdmap: RangeDoppler,
    peaks: NDArray[np.int64],
    radar: Radar,
    settings: Any,
    seen: DetectorMap | None = None,
) -> tuple[NDArray[np.int64], Floats]:
    """Return map cells (c, 2) beside peaks (p, 2) that have the power of detections, but are neither local maxima nor
    side lobes, and the power (c,) [W] that makes each a local maximum."""
    power, grid = rdmap.power, Grid.of(rdmap)
    cells = strongest(power, grid)
    least = max(float(undb(settings.min_snr_db)) * rdmap.noise, FAINT * float(power.max(initial=0.0)))
    cells = cells[power[tuple(cells.T)] >= least]
    cells = cells[power[tuple(cells.T)] >= least_in(rdmap, cells, radar, settings, seen)]
    windows = settings.rate_window, settings.range_window
    lobes = SideLobes.of(grid, windows, radar.channel_waveform, _weighed(radar))
    return lobes.shoulders(power, grid.pad, peaks, cells)


def _detector(rdmap: RangeDoppler, radar: Radar, settings: Any) -> dict[str, Any]:
    """Return the arguments of `detect` by the settings of a scene file's [processing]."""
    # The scene file names range before rate; a map's axes are rate, then range.
    sizes = {name: cells[::-1] for name in ("guard", "train") if (cells := getattr(settings, name)) is not None}
    guard = fitting_guard(Grid.of(rdmap).count, sizes.get("guard"), sizes.get("train"))
    if guard is not None:
        sizes["guard"] = guard
    return {
        # Each fold that is tested in a cell is one more chance of a false alarm.
        "pfa": settings.pfa / hypotheses(radar),
        "min_snr_db": settings.min_snr_db,
        "method": settings.cfar,
        "windows": (settings.rate_window, settings.range_window),
        "chirps": _weighed(radar),
        "waveform": radar.waveform,
        "elements": receivers(radar),
        "array": _array(settings),
        **sizes,
    }


def _weighed(radar: Radar) -> int:
    """Return the chirps that the window along rate weighs: by Doppler division all of them, though the map of a channel
    has a share of the rates."""
    divided = radar.multiplexing == "ddm" and not radar.waveform.stagger
    return (radar.waveform if divided else radar.channel_waveform).n_chirps


def _array(settings: Any) -> Array:
    return Array(settings.beams, settings.doa, settings.beam_window)


def receivers(radar: Radar) -> Floats:
    """Return the phase centres (t * a, 3) [m] of the map's antennas, in the antenna's frame: the virtual elements.

    Cross-polarised receivers stand at the places of the co-polarised; a map is of one or the other (see `map_of`).
    """
    return radar.virtual_elements


def aperture_of(radar: Radar) -> Aperture:
    """Return the aperture of the map's antennas, at the middle of the ramp as their phases in a map are."""
    return Aperture(receivers(radar), C0 / radar.waveform.middle)


def bank_of(radar: Radar, settings: Any) -> BeamBank | None:
    """Return the bank of beams in which the detector looks; None for one receiver, or for the mean of several."""
    aperture = aperture_of(radar)
    if settings.beams != "coherent" or not any(aperture.scans):
        return None
    return BeamBank(aperture, settings.beam_window)


def looks_of(radar: Radar, settings: Any) -> tuple[int, float]:
    """Return how many powers the detector adds in a cell, and the false alarm probability that it keeps for each beam
    so that a cell keeps that of the settings."""
    bank, pfa = bank_of(radar, settings), settings.pfa / hypotheses(radar)
    return (len(receivers(radar)), pfa) if bank is None else (1, bank.single(pfa))


def beam_gain(radar: Radar, settings: Any) -> float:
    """Return by how much the detector's beams raise an echo above the noise: 1 for one receiver or their mean."""
    bank = bank_of(radar, settings)
    return 1.0 if bank is None else 1.0 / bank.noise_gain


def noise_equivalent_amplitude(radar: Radar, settings: Any) -> float:
    """Return the scattered amplitude [1/m, unit field at 1 m] of a return as strong as the noise in one cell of the
    map, or of a beam over it."""
    if not radar.noise:
        return 0.0
    gain = radar.kept.get(noise_equivalent_amplitude)
    if gain is None:
        # The strongest direction of both antennas, on a grid finer than any beam of use.
        angles = (np.radians(np.arange(-most, most + 0.1, 1.0)) for most in (90.0, 60.0))
        azimuth, elevation = np.meshgrid(*angles)
        look = direction(azimuth.ravel(), elevation.ravel()) @ radar.axes.T
        ends = (np.linalg.norm(f(look), axis=1).max() for f in (radar.tx_field, radar.rx_field))
        gain = radar.kept[noise_equivalent_amplitude] = float(np.prod(list(ends)))
    return float(noise_amplitude(radar, settings) * 4.0 * np.pi * radar.waveform.middle / C0 / gain)


def noise_of_cell(radar: Radar, settings: Any) -> float:
    """Return the thermal noise [W] of one cell of the map; 0 when noise is off."""
    if not radar.noise:
        return 0.0
    gain = processing_gain(window(settings.range_window, radar.waveform.n_samples))
    # By time division a channel has a share of the chirps, by Doppler division or stagger all of them.
    chirps = (radar.channel_waveform if radar.multiplexing == "tdm" else radar.waveform).n_chirps
    return float(radar.noise_power / gain / processing_gain(window(settings.rate_window, chirps)))


def noise_of_beam(radar: Radar, settings: Any) -> float:
    """Return the thermal noise [W] of what the detector looks at: a beam in a cell, or the cell; 0 without noise."""
    return noise_of_cell(radar, settings) / beam_gain(radar, settings)


def noise_amplitude(radar: Radar, settings: Any) -> float:
    """Return the amplitude of a path as strong as the noise that the detector looks at."""
    return float(np.sqrt(noise_of_beam(radar, settings) / radar.power))


def map_error(quiet: Cube, others: Cube, radar: Radar, settings: Any) -> MapError:
    """Return the map of what two launches differ by: the samples of one less those of the other, without noise.

    Of an array whose beams the detector sees it is what they differ by in the beam towards a cell's echo, or the mean
    over beams in all directions where that is more: errors from elsewhere are outside of that beam.
    """
    change = quiet.samples - others.samples
    if bank_of(radar, settings) is None or not change.any():
        return MapError(quiet_map(change, radar, settings))
    # By receiver: the spectra of all take much memory, and longer to write than to compute.
    own, off = (channel(Cube(samples=x, noise_power=0.0), radar).samples for x in (quiet.samples, change))
    towards, mean, count = np.zeros(0, np.complex64), np.zeros(0), 0
    for k in range(len(own)):
        echo, wrong = (quiet_spectrum(x[k : k + 1], radar, settings) for x in (own, off))
        if not count:
            towards, mean = np.zeros(echo.shape[1:], np.complex64), np.zeros(echo.shape[1:])
        count += len(echo)
        parallel_for(len(mean), partial(_add_towards, echo, wrong, towards, mean), _ROWS)
    # Over as many orthogonal beams as receivers the powers add up to that of all receivers.
    return MapError(np.maximum(np.abs(towards).astype(np.float64) ** 2, mean) / count**2)


def _add_towards(echo: Complexes, wrong: Complexes, towards: Complexes, mean: Floats, rows: slice) -> None:
    """Add some rows of a spectrum (a, v, r) `wrong`, turned by the phases of another, and its power."""
    for k in range(len(echo)):
        own, off = echo[k, rows], wrong[k, rows]
        size = np.abs(own)
        turned = own.conj() / np.maximum(size, np.finfo(np.float32).tiny)
        turned *= off
        towards[rows] += np.where(size > 0.0, turned, off)
        mean[rows] += off.real**2 + off.imag**2


def quiet_map(samples: Any, radar: Radar, settings: Any) -> Any:
    """Return the powers (v, r) [W] of the map of samples (antenna, chirp, sample) without noise."""
    cube = channel(Cube(samples=np.asarray(samples, np.complex64), noise_power=0.0), radar)
    return _quiet(cube, radar, settings).power


def quiet_spectrum(samples: Complexes, radar: Radar, settings: Any) -> Complexes:
    """Return the spectrum (a, v, r) [sqrt(W)] of the map of samples without noise, of channels as they do not fold."""
    return _quiet(Cube(samples=samples, noise_power=0.0), radar, settings).spectrum


def _quiet(cube: Cube, radar: Radar, settings: Any) -> RangeDoppler:
    windows = (settings.range_window, settings.rate_window, settings.pad)
    return virtual_range_doppler(cube, radar, *windows, resolve=False)
