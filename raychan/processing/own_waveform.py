"""The range-Doppler map of any waveform: ramps by two transforms, a waveform of one's own by its own compression."""

from __future__ import annotations

import numpy as np
import scipy.fft

from raychan.parallel import threads
from raychan.processing.range_doppler import mean_power, range_doppler
from raychan.radar.waveform import OwnWaveform, Waveform
from raychan.radar.windows import window
from raychan.records import Cube, RangeDoppler
from raychan.units import C0


def map_by_waveform(
    cube: Cube, waveform: Waveform, range_window: str, rate_window: str, pad: tuple[int, int]
) -> RangeDoppler:
    """Return the map of a frame; arguments and errors as for `range_doppler`.

    A waveform of one's own compresses in range itself: the window along range and the padding there are not used.
    """
    if not isinstance(waveform, OwnWaveform):
        return range_doppler(cube, waveform, range_window, rate_window, pad)
    _, chirps, samples = cube.samples.shape
    if (chirps, samples) != (waveform.n_chirps, waveform.n_samples):
        wanted = f"{waveform.n_chirps} by {waveform.n_samples}"
        raise ValueError(f"cube of {chirps} repetitions by {samples} samples; the waveform has {wanted}")
    taper = window(rate_window, chirps)
    cells = int(pad[1]) * chirps if chirps > 1 else 1
    weight = (taper / taper.sum()).astype(np.float32)
    profiles = waveform.compressed(cube.samples) * weight[:, None]
    rows = scipy.fft.ifft(profiles, cells, axis=1, norm="forward", workers=threads())
    spectrum = scipy.fft.fftshift(rows, axes=1).astype(np.complex64)
    # White noise in a cell of the profile: the power of the compression's answer to one sample.
    one = np.zeros((chirps, samples), np.complex64)
    one[0, 0] = 1.0
    gain = float((np.abs(waveform.compressed(one)) ** 2).sum()) * float((taper**2).sum() / taper.sum() ** 2)
    doppler = (np.arange(cells) - cells // 2) / (cells * waveform.repetition)
    metre_per_hertz = 0.5 * C0 / waveform.middle
    return RangeDoppler(
        range=np.arange(spectrum.shape[2]) * waveform.range_resolution,
        rate=doppler * metre_per_hertz,
        spectrum=spectrum,
        power=mean_power(spectrum),
        noise=cube.noise_power * gain,
        range_resolution=waveform.range_resolution,
        rate_resolution=metre_per_hertz / (chirps * waveform.repetition),
        unambiguous_range=waveform.unambiguous_range,
        unambiguous_rate=0.5 * metre_per_hertz / waveform.repetition,
    )
