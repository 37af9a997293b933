"""An array's detection is wrong by what is wrong in its beam; errors from other directions are outside of it."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc
from raychan.records import Cube
from raychan.run.receiver import map_error
from raychan.units import C0

_COUNT = 4


def echo(radar: rc.Radar, sine: float, amplitude: float) -> np.ndarray:
    """Return samples (a, chirp, sample) of a plane wave from an azimuth of this sine, in one map cell."""
    wave = radar.waveform
    phase = 0.5 * np.arange(_COUNT) * sine
    beat = np.exp(2j * np.pi * 10.0 * np.arange(wave.n_samples) / wave.n_samples)
    one = np.broadcast_to(beat, (wave.n_chirps, wave.n_samples))
    return (amplitude * np.exp(2j * np.pi * phase)[:, None, None] * one).astype(np.complex64)


@pytest.mark.parametrize(("sine", "share"), [(0.1, 1.0), (0.1 + 2.0 / _COUNT, 1.0 / _COUNT)])
def test_an_error_counts_in_full_in_its_own_direction_and_by_the_mean_over_beams_in_a_null(sine, share):
    waveform = rc.Waveform(carrier=77e9, bandwidth=500e6, chirp_duration=30e-6, n_chirps=32, n_samples=64)
    radar = rc.Radar(waveform=waveform, elements=rc.uniform_array(_COUNT, 0.5 * C0 / waveform.middle))
    own, wrong = echo(radar, 0.1, 1.0), echo(radar, sine, 0.1)
    found = map_error(Cube(own, 0.0), Cube(own - wrong, 0.0), radar, radar.processing).power
    alone = map_error(Cube(own, 0.0), Cube(own - echo(radar, 0.1, 0.1), 0.0), radar, radar.processing).power
    assert found.max() == pytest.approx(share * alone.max(), rel=1e-3)
