"""Spectra of many samples where they are wanted: near zero, or of one sign of frequency."""

from __future__ import annotations

import numpy as np
import scipy.fft
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

MANY = 4096
"""Samples from above which whole spectra on fine grids take too much memory and time: of 2^20 samples 14 GB."""


def near_zero(weights: Floats, fine: int, count: int) -> Complexes:
    """Return the spectrum of weights (n,) at `count` places from 0 on, `fine` of them in a resolution cell.

    Source: Bluestein (1970), IEEE Trans. Audio Electroacoust. 18(4), for more than MANY weights.
    """
    n = len(weights)
    if n <= MANY:
        return np.asarray(scipy.fft.fft(weights, n * fine).take(range(count), mode="wrap"))
    length = int(scipy.fft.next_fast_len(n + count - 1))
    chirp = _chirp(np.arange(max(n, count)), n * fine)
    against = np.zeros(length, np.complex128)
    against[:count], against[length - n + 1 :] = chirp[:count].conj(), chirp[n - 1 : 0 : -1].conj()
    turned = scipy.fft.fft(weights * chirp[:n], length) * scipy.fft.fft(against)
    return np.asarray(scipy.fft.ifft(turned)[:count] * chirp[:count])


def _chirp(k: NDArray[np.int64], whole: int) -> Complexes:
    """Return exp(-j pi k^2 / whole), its phase reduced as whole numbers."""
    return np.asarray(np.exp((-1j * np.pi / whole) * (k * k % (2 * whole))))
