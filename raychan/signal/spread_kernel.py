"""Phase noise and quantisation as a spread over the range-Doppler map: what is expected of the physical model, and the
shortcut of one kernel for all ranges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from raychan.radar.impairments import Converter, PhaseNoise
from raychan.radar.waveform import Waveform
from raychan.radar.windows import window
from raychan.units import undb

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Processor:
    """How a map is made of samples: waveform, windows along range and rate, zero padding along range and rate."""

    waveform: Waveform
    range_window: str = "hann"
    rate_window: str = "hann"
    pad: tuple[int, int] = (2, 2)

    @property
    def tapers(self) -> tuple[Floats, Floats]:
        """Windows along range and rate, each with a sum of 1."""
        sizes = (self.range_window, self.waveform.n_samples), (self.rate_window, self.waveform.n_chirps)
        return tuple(w / w.sum() for w in (window(name, n) for name, n in sizes))  # type: ignore[return-value]

    @property
    def noise_share(self) -> float:
        """Power of white noise in a cell over that in a sample."""
        along, over = self.tapers
        return float((along**2).sum() * (over**2).sum())


def pedestal(processor: Processor, noise: PhaseNoise, delay: float) -> Floats:
    """Return the expected power (v, r) in cells off the peak of one path over the power of its peak.

    Cell (l, i) is l cells up in rate and i in range from the peak, cyclic as the transforms. It sums the power density
    S of the beat (`PhaseNoise.beat_density`) at nu_l + n / T_r, which the chirps fold onto one rate, each seen through
    the range window W: sum over n of S(nu_l + n / T_r) |W(n / T_r - f_i)|^2 times sum(w^2) / T_r of the rate window.
    S is taken as level over one cell of rate. Args: delay of the path [s].
    """
    wave = processor.waveform
    step = wave.chirp_duration / wave.n_samples
    along, over = processor.tapers
    cells = processor.pad[1] * wave.n_chirps, processor.pad[0] * wave.n_samples
    rate = np.fft.fftfreq(cells[0], wave.repetition)
    lines = np.arange(-int(0.5 / step * wave.repetition), int(0.5 / step * wave.repetition) + 1) / wave.repetition
    offset = rate[:, None] + lines
    density = np.where(np.abs(offset) < 0.5 / step, noise.beat_density(offset, delay), 0.0)
    # Window transforms at n / T_r - f_i: one transform of the window, turned to each line.
    t = np.arange(wave.n_samples) * step
    seen = np.abs(scipy.fft.fft(along * np.exp(2j * np.pi * lines[:, None] * t), cells[1], axis=1)) ** 2
    return np.asarray(density @ seen * ((over**2).sum() / wave.repetition))


def spread_kernel(processor: Processor, noise: PhaseNoise | None, converter: Converter | None, delay: float) -> Floats:
    """Return the kernel (v, r), its middle at [0, 0], with which the shortcut spreads the powers of a map.

    It holds 1 at its middle, the pedestal of phase noise of a path of one delay [s], taken for all, and the noise of
    quantisation, 6.02 bits + 1.76 dB below each path, as if each were a full-scale sine. Physically phase noise grows
    with a path's own delay, and quantisation is one floor by the converter's step (`Converter.noise_power`).
    """
    cells = processor.pad[1] * processor.waveform.n_chirps, processor.pad[0] * processor.waveform.n_samples
    share = np.zeros(cells) if noise is None else pedestal(processor, noise, delay)
    if converter is not None:
        share = share + undb(-converter.snr_db) * processor.noise_share
    # A path stands in the map as its windows spread it: the sum of their powers over all cells is taken out.
    kernel = share / (cells[0] * cells[1] * processor.noise_share)
    kernel[0, 0] += 1.0
    return np.asarray(kernel)


def spread(power: Floats, kernel: Floats) -> Floats:
    """Return the powers (v, r) [W] of a map after cyclic convolution with a kernel (v, r)."""
    transformed = scipy.fft.rfft2(power) * scipy.fft.rfft2(kernel)
    return np.asarray(np.maximum(scipy.fft.irfft2(transformed, power.shape), 0.0))
