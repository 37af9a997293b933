"""The end of the receiver: I/Q imbalance, DC offset, and the analogue-to-digital converter."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.radar.impairments import Converter, Impairments
from raychan.records import Cube
from raychan.units import undb, watt

Samples = NDArray[np.complexfloating[Any, Any]]
Floats = NDArray[np.float64]

_DITHERED = 0.7
"""Of a step: the noise of I or of Q from which on its mean error of rounding is nothing: -94 dB of the noise."""
_STILL = 1.0 / 512.0  # of a step: noise that hardly dithers (-27 dB of the error of rounding lies beside a level's end)
_TABLE = 4096  # places within a step at which the mean error is summed; it is linear in between


def digitized(cube: Cube, impairments: Impairments, complex_sampling: bool = True) -> tuple[Cube, int]:
    """Return what a receiver's I/Q mixer and converter make of samples, and how many samples are clipped.

    The cube's noise power stays that of the thermal noise. Without any of these impairments it is the cube given.
    """
    samples = before_rounding(cube.samples, impairments, complex_sampling)
    clipped = 0
    if impairments.converter is not None:
        samples, clipped = quantized(samples, impairments.converter, complex_sampling)
    if samples is cube.samples:
        return cube, 0
    return Cube(samples=samples.astype(np.complex64), noise_power=cube.noise_power), clipped


def before_rounding(samples: Samples, impairments: Impairments, complex_sampling: bool = True) -> Samples:
    """Return what of samples reaches the converter: with I/Q imbalance and DC offset."""
    if not impairments.iq_balanced:
        samples = imbalanced(samples, impairments.iq_gain_db, impairments.iq_phase_deg)
    if impairments.dc_offset_dbm is not None:
        samples = samples + offset(impairments, complex_sampling)
    return samples


def offset(impairments: Impairments, complex_sampling: bool = True) -> complex:
    """Return the constant [sqrt(W)] that a receiver's DC offset adds to its samples; 0 without an offset."""
    if impairments.dc_offset_dbm is None:
        return 0.0
    size = float(np.sqrt(watt(impairments.dc_offset_dbm)))
    return complex(size * np.exp(0.25j * np.pi)) if complex_sampling else size


def imbalanced(samples: Samples, gain_db: float, phase_deg: float) -> Samples:
    """Return samples x as a mixer of unequal I and Q gives them: K1 x + K2 conj(x).

    Args: gain_db [dB] of Q over I; phase_deg [deg] by which Q is off 90 deg from I. With g and p these two,
    K1 = (1 + g exp(-jp)) / 2 and K2 = (1 - g exp(jp)) / 2: an echo gets an image at minus its beat frequency.
    Source: Valkama, Renfors, Koivunen, IEEE Trans. Signal Process. 49(10), 2001, eqs. 2 to 4.
    """
    own, mirrored = _weights(gain_db, phase_deg)
    return np.asarray(own * samples + mirrored * np.conj(samples))


def images(samples: Samples, gain_db: float, phase_deg: float) -> tuple[float, Samples]:
    """Return what of samples that such a mixer gave are images of echoes, and how strong these are to their echoes.

    Args and source as for `imbalanced`. With y the samples, K2 / conj(K1) conj(y) has each image as y has it.
    Returns: |K2 / K1|^2, 0 where images are not below their echoes (phases of 90 deg and more): which of two is the
    image cannot be told there; and the samples of the images.
    """
    own, mirrored = _weights(gain_db, phase_deg)
    if abs(mirrored) >= abs(own):
        return 0.0, np.zeros_like(samples)
    share = mirrored / np.conj(own)
    return abs(share) ** 2, np.asarray(share * np.conj(samples))


def _weights(gain_db: float, phase_deg: float) -> tuple[complex, complex]:
    """Return K1 and K2 of `imbalanced`."""
    turn = complex(np.sqrt(undb(gain_db)) * np.exp(-1j * np.radians(phase_deg)))
    return 0.5 * (1.0 + turn), 0.5 * (1.0 - turn.conjugate())


def image_rejection_db(gain_db: float, phase_deg: float) -> float:
    """Return by how much the image of an echo is below it [dB]: (1 + 2 g cos p + g2) / (1 - 2 g cos p + g2).

    Args and source as for `imbalanced`.
    """
    g, cosine = float(np.sqrt(undb(gain_db))), float(np.cos(np.radians(phase_deg)))
    return float(10.0 * np.log10((1.0 + 2.0 * g * cosine + g * g) / (1.0 - 2.0 * g * cosine + g * g)))


def quantized(samples: Samples, converter: Converter, complex_sampling: bool = True) -> tuple[Samples, int]:
    """Return samples rounded to the converter's steps and clipped at its ends, and the number of those clipped.

    Codes run from -2^(bits - 1) to 2^(bits - 1) - 1 (two's complement), zero among them. Without complex sampling the
    imaginary parts stay zero.
    """
    step, half = converter.step, 2 ** (converter.bits - 1)
    parts = np.stack([samples.real, samples.imag]).astype(np.float64) / step
    codes = np.clip(np.rint(parts), -half, half - 1)
    if not complex_sampling:
        codes[1] = 0.0
    # A sample counts once, beyond the rails by half a step or more.
    over = (parts < -half - 0.5) | (parts > half - 0.5)
    clipped = int((over.any(axis=0) if complex_sampling else over[0]).sum())
    return np.asarray(step * (codes[0] + 1j * codes[1])), clipped


def dithered(converter: Converter, noise: float) -> bool:
    """Return whether noise of a power [W] in I, or in Q, leaves no mean error of rounding."""
    return noise >= (_DITHERED * converter.step) ** 2


def rounding_error(samples: Samples, impairments: Impairments, noise: float, complex_sampling: bool = True) -> Samples:
    """Return the mean error, over the thermal noise, of a converter that rounds samples: its spurs.

    Args: samples without thermal noise as they reach the converter; noise [W] of a complex sample, before I/Q
    imbalance. The rest of the error is white; clipping is left out.
    """
    converter, wider = impairments.converter, float(undb(impairments.iq_gain_db))
    if converter is None:
        return np.zeros_like(samples)
    error = np.zeros(samples.shape, np.complex64)
    error.real = _mean_error(samples.real, converter, 0.5 * noise)
    if complex_sampling:
        error.imag = _mean_error(samples.imag, converter, 0.5 * noise * wider)
    return error


def _mean_error(values: NDArray[Any], converter: Converter, noise: float) -> Floats:
    """Return the mean error of rounding values (...) in Gaussian noise [W] of rms s steps d: the sum over k of
    (-1)^k d / (pi k) exp(-2 (pi k s)^2) sin(2 pi k x / d).

    Source: Widrow, Kollar, Quantization Noise, Cambridge, 2008 (the characteristic function of the noise smooths the
    saw tooth of the error).
    """
    step, spread = converter.step, float(np.sqrt(noise)) / converter.step
    if dithered(converter, noise):
        return np.zeros(values.shape)
    at = values.astype(np.float64) / step
    if spread < _STILL:
        return np.asarray(step * (np.rint(at) - at))
    k, places = np.arange(1, 2 + int(1.0 / spread)), np.linspace(0.0, 1.0, _TABLE + 1)
    weights = (-1.0) ** k / (np.pi * k) * np.exp(-2.0 * (np.pi * k * spread) ** 2)
    table = sum(w * np.sin(2.0 * np.pi * n * places) for n, w in zip(k.tolist(), weights.tolist(), strict=True))
    return np.asarray(step * np.interp(at - np.floor(at), places, np.asarray(table)))
