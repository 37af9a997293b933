"""Range-Doppler processing: from dechirped samples to a map, by windows and two FFTs."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from raychan.parallel import parallel_for, parallel_tasks, threads
from raychan.radar.waveform import Waveform
from raychan.radar.windows import window
from raychan.records import Cube, RangeDoppler
from raychan.units import C0

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex64]

_BLOCK = 1 << 14  # map cells of which powers are summed at a time: some 0.5 MB


def range_doppler(
    cube: Cube,
    waveform: Waveform,
    range_window: str = "hann",
    rate_window: str = "hann",
    pad: tuple[int, int] = (2, 2),
) -> RangeDoppler:
    """Return the map of a frame, scaled so that the peak of a lone path reads its received power.

    Ranges and rates are those at the middle of the frame (Waveform.centre). A beat frequency is slope * delay plus the
    Doppler shift, which is corrected row by row (folded rates keep the shift of their alias). With real sampling the
    axis ends at half the range, and the spectrum is doubled for its lost image; noise per cell is then 3 dB higher.
    Args: windows by name (radar.windows); pad, factors by which the (range, rate) transforms are zero-padded.
    Raises: ValueError if the cube does not fit the waveform, or on an unknown window or a bad pad.
    """
    _, chirps, samples = cube.samples.shape
    if (chirps, samples) != (waveform.n_chirps, waveform.n_samples):
        wanted = f"{waveform.n_chirps} by {waveform.n_samples}"
        raise ValueError(f"cube of {chirps} chirps by {samples} samples; the waveform has {wanted}")
    if min(pad) < 1 or any(int(p) != p for p in pad):
        raise ValueError(f"pad = {pad}: whole numbers from 1 on wanted")
    taper_r, taper_v = window(range_window, samples), window(rate_window, chirps)
    cells_r = int(pad[0]) * samples
    image = 1.0 if waveform.complex_sampling else 2.0
    doppler, undone = _without_doppler(waveform, range_window, int(pad[1]))
    cells_v, antennas = len(doppler), len(cube.samples)
    weight = (image * taper_v / taper_v.sum()).astype(np.float32)[:, None]
    spectrum = np.empty((antennas, cells_v, cells_r if waveform.complex_sampling else cells_r // 2), np.complex64)
    # By antenna: the arrays between the transforms stay small.
    workers = threads() if antennas == 1 else 1

    def transformed(a: int) -> None:
        given: Any = {"norm": "forward", "workers": workers, "overwrite_x": True}
        rows = scipy.fft.fftshift(scipy.fft.ifft(cube.samples[a] * weight, cells_v, axis=0, **given), axes=0)
        # exp(-j2 pi f_d t) is removed row by row, so that the beat of the delay alone remains.
        rows *= undone
        spectrum[a] = scipy.fft.ifft(rows, cells_r, axis=1, **given)[:, : spectrum.shape[2]]

    parallel_tasks(antennas, transformed)
    gain = float((taper_r**2).sum() / taper_r.sum() ** 2 * (taper_v**2).sum() / taper_v.sum() ** 2)
    metre_per_hertz = 0.5 * C0 / waveform.middle
    return RangeDoppler(
        range=np.arange(spectrum.shape[2]) * waveform.range_resolution / pad[0],
        rate=doppler * metre_per_hertz,
        spectrum=spectrum,
        power=mean_power(spectrum),
        noise=cube.noise_power * gain * (1.0 if waveform.complex_sampling else 2.0),
        range_resolution=waveform.range_resolution,
        rate_resolution=metre_per_hertz / (chirps * waveform.repetition),
        unambiguous_range=waveform.unambiguous_range,
        unambiguous_rate=0.5 * metre_per_hertz / waveform.repetition,
    )


def mean_power(spectrum: Complexes) -> Floats:
    """Return the mean over antennas of the power (v, r) of a spectrum (a, v, r), by blocks that fit a cache."""
    antennas, rates, ranges = spectrum.shape
    power = np.zeros((rates, ranges))
    rows = max(1, _BLOCK // max(ranges, 1))

    def some(blocks: slice) -> None:
        for k in range(blocks.start, blocks.stop):
            own = slice(k * rows, (k + 1) * rows)
            for a in range(antennas):
                real, imag = (x.astype(np.float64) for x in (spectrum[a, own].real, spectrum[a, own].imag))
                power[own] += real * real + imag * imag

    parallel_for(-(-rates // rows), some, 2)
    power /= antennas
    return power


@lru_cache(maxsize=1)
def _without_doppler(waveform: Waveform, range_window: str, pad: int) -> tuple[Floats, Complexes]:
    """Return the Doppler shifts (v,) [Hz] of the rows of a map, and the factors (v, s) that take them out of a ramp's
    samples and weight these by a window; kept for the next frame of a sequence."""
    chirps, samples = waveform.n_chirps, waveform.n_samples
    # One chirp has one rate: padded, all rows would be equal.
    cells = pad * chirps if chirps > 1 else 1
    doppler = (np.arange(cells) - cells // 2) / (cells * waveform.repetition)
    t = (np.arange(samples) - 0.5 * (samples - 1)) * waveform.chirp_duration / samples
    taper = window(range_window, samples)
    undone = np.exp(2j * np.pi * doppler[:, None] * t) * (taper / taper.sum())
    return doppler, undone.astype(np.complex64)
