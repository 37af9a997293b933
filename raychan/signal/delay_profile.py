"""Power-delay profile: power against delay, as resolved by one ramp of the waveform at the start of a frame."""

from __future__ import annotations

import finufft
import numpy as np
import scipy.fft
from numpy.typing import NDArray

from raychan.parallel import parallel_map
from raychan.radar import windows
from raychan.radar.side_lobes import SideLobeEnvelope
from raychan.radar.waveform import Waveform
from raychan.records import Paths, Profile

_PAD = 4  # zero padding of the transform
_ABOVE_DB = 10.0  # least level of a peak over noise
_SIDE_LOBES_DB = 60.0  # most of a peak under the strongest one
_EPS = 1e-7  # accuracy of the non-uniform transform
_PART = 1 << 16  # paths transformed at once by one thread; not measured


def profile(
    paths: Paths,
    waveform: Waveform,
    power: float = 1.0,
    noise_power: float = 0.0,
    window: str = "hann",
) -> Profile:
    """Return the power-delay profile of a channel in the waveform's band.

    It is the transform of the channel's response to one ramp, without motion and noise samples, scaled so that a lone
    path reads its received power. Ranges c tau/2 reach to n_samples range cells; later paths fold as in the radar.
    Peaks are local maxima over one range cell, 10 dB above noise and within 60 dB of the strongest, that are no side
    lobes.
    Args: power [W] transmitted; noise_power [W] a sample, from which Profile.noise, the noise in a cell of one ramp.
    """
    return profile_of(response(paths, waveform, power, window), waveform, noise_power, window)


def response(paths: Paths, waveform: Waveform, power: float = 1.0, window: str = "hann") -> NDArray[np.complex128]:
    """Return the windowed frequency response (n_samples,) [sqrt(W)] of a channel over one ramp; responses of several
    sets of paths add. Args as for `profile`."""
    n = waveform.n_samples
    taper = windows.window(window, n)
    scale, amplitude, delay = np.sqrt(power) / taper.sum(), paths.amplitude, paths.delay

    def of(part: int) -> NDArray[np.complex128]:
        some = slice(part, part + _PART)
        # The response at f_c + B s/n, s = 0..n-1; type 1 counts from the middle, s = n // 2.
        turns = delay[some] * waveform.bandwidth / n
        weight = scale * amplitude[some] * np.exp(-2j * np.pi * turns * (n // 2))
        at = 2.0 * np.pi * (turns - np.floor(turns + 0.5))
        return np.asarray(finufft.nufft1d1(at, weight, n, eps=_EPS, isign=-1, nthreads=1))

    parts = parallel_map(of, range(0, len(delay), _PART))
    return np.asarray(sum(parts, np.zeros(n, np.complex128)) * taper)


def profile_of(spectrum: NDArray[np.complex128], waveform: Waveform, noise_power: float, window: str) -> Profile:
    """Return the power-delay profile of a channel's response (see `response`); args as for `profile`."""
    n = waveform.n_samples
    taper = windows.window(window, n)
    length = _PAD * n
    received = np.abs(scipy.fft.ifft(spectrum, length, norm="forward")) ** 2
    noise = noise_power / windows.processing_gain(taper)
    around = np.stack([np.roll(received, s) for s in range(-_PAD, _PAD + 1)])
    floor = max(noise * 10.0 ** (0.1 * _ABOVE_DB), received.max() * 10.0 ** (-0.1 * _SIDE_LOBES_DB))
    peaks = np.flatnonzero((received == around.max(axis=0)) & (received > floor))
    peaks = _own(peaks[np.argsort(-received[peaks], kind="stable")], received, SideLobeEnvelope(window, n))
    return Profile(
        range=np.arange(length, dtype=np.float64) * (waveform.range_resolution / _PAD),
        power=received,
        noise=noise,
        peaks=peaks,
    )


def _own(peaks: NDArray[np.int64], power: NDArray[np.float64], envelope: SideLobeEnvelope) -> NDArray[np.int64]:
    """Return the peaks, strongest first, that are not explained by side lobes of stronger ones."""
    lobes = np.zeros(len(peaks))
    kept = np.zeros(len(peaks), bool)
    for i, peak in enumerate(peaks):
        # Side lobes of two equal echoes add in voltage: twice the sum of their powers.
        kept[i] = power[peak] > 2.0 * lobes[i]
        if kept[i]:
            away = np.abs(peaks - peak)
            lobes += power[peak] * envelope(np.minimum(away, len(power) - away) / _PAD)
    return peaks[kept]
