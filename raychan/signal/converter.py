"""The end of the receiver: I/Q imbalance, DC offset, and the analogue-to-digital converter."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.radar.impairments import Converter, Impairments
from raychan.records import Cube
from raychan.units import undb, watt

Samples = NDArray[np.complexfloating[Any, Any]]


def digitized(cube: Cube, impairments: Impairments, complex_sampling: bool = True) -> tuple[Cube, int]:
    """Return what a receiver's I/Q mixer and converter make of samples, and how many samples are clipped.

    The cube's noise power stays that of the thermal noise. Without any of these impairments it is the cube given.
    """
    samples: Samples = cube.samples
    if not impairments.iq_balanced:
        samples = imbalanced(samples, impairments.iq_gain_db, impairments.iq_phase_deg)
    if impairments.dc_offset_dbm is not None:
        samples = samples + offset(impairments, complex_sampling)
    clipped = 0
    if impairments.converter is not None:
        samples, clipped = quantized(samples, impairments.converter, complex_sampling)
    if samples is cube.samples:
        return cube, 0
    return Cube(samples=samples.astype(np.complex64), noise_power=cube.noise_power), clipped


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
