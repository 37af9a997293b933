"""Two echoes of one cell before a rectangle, less than a beam width apart: both are found, or one is ambiguous."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc
from raychan.records import Cube
from raychan.units import C0

WAVE = rc.Waveform(carrier=77e9, bandwidth=300e6, chirp_duration=20e-6, n_chirps=16, n_samples=32)
LAMBDA = C0 / WAVE.middle
NOISE = 1e-14


def found(count, waves, levels_db, rng) -> tuple[rc.Detections, np.ndarray]:
    """Return the detections of waves from cosines (k, 2) at levels [dB] over the noise of the beam, before count (2,)
    elements half a wavelength apart, and these elements."""
    y, z = np.indices(count).reshape(2, -1) * 0.5 * LAMBDA
    elements, shape = np.stack([0.0 * y, y, z], axis=1), (WAVE.n_chirps, WAVE.n_samples)
    size = np.sqrt(NOISE * 2.25 / np.prod(shape) / len(y) * 10.0 ** (0.1 * np.array(levels_db)))
    size = size * np.exp(2j * np.pi * rng.random(len(size)))
    seen = np.exp(2j * np.pi / LAMBDA * elements[:, 1:] @ np.array(waves).T) @ size
    # A fifth of a cell from the middle of one, in range and in rate.
    beat = np.exp(-2j * np.pi * 10.2 * np.arange(shape[1]) / shape[1])
    turn = np.exp(2j * np.pi * 3.2 * np.arange(shape[0]) / shape[0])
    noise = rng.standard_normal((len(y), *shape, 2)) @ [1.0, 1.0j] * np.sqrt(0.5 * NOISE)
    cube = Cube((seen[:, None, None] * np.outer(turn, beat) + noise).astype(np.complex64), NOISE)
    radar = rc.Radar(WAVE, elements=elements)
    return rc.detect(rc.range_doppler(cube, radar), radar), elements


@pytest.mark.parametrize("apart", [0.8, 0.9, 1.0, 1.2])
@pytest.mark.parametrize("below", [10.0, 15.0, 20.0, 25.0])
def test_a_weaker_echo_beside_a_strong_one_is_found_or_said_to_be_missing(below, apart):
    for seed, count in enumerate([(3, 3), (3, 5), (4, 4), (5, 6), (6, 4), (8, 8)]):
        rng = np.random.default_rng(seed)
        axis, one = seed % 2, rng.uniform(-0.3, 0.1, 2)
        other = one + np.eye(2)[axis] * apart * 2.0 / count[axis]
        seen, elements = found(count, [one, other], [55.0, 55.0 - below], rng)
        if seen.ambiguous.any():
            continue
        assert len(seen.range) == 2
        u = np.cos(seen.elevation) * np.sin(seen.azimuth)
        beams = np.exp(2j * np.pi / LAMBDA * np.stack([u, np.sin(seen.elevation)], axis=1) @ elements[:, 1:].T)
        waves = np.exp(2j * np.pi / LAMBDA * elements[:, 1:] @ np.array([one, other]).T)
        assert (np.abs(beams.conj() @ waves / len(elements)).diagonal() ** 2 > 0.97).all()
        assert seen.snr == pytest.approx([55.0, 55.0 - below], abs=1.5)


@pytest.mark.parametrize("count", [(2, 2), (3, 5), (8, 8)])
def test_a_lone_echo_before_a_rectangle_is_one(count):
    for seed in range(12):
        rng = np.random.default_rng(seed)
        seen, _ = found(count, [rng.uniform(-0.5, 0.5, 2)], [rng.uniform(25.0, 65.0)], rng)
        assert len(seen.range) == 1 and not seen.ambiguous[0]
