"""Side lobes of echoes that are no peaks, on the slope of a stronger one: no detections, against real echoes there."""

from __future__ import annotations

import numpy as np
import pytest
from support.echoes import echoes, make_radar

from raychan.processing.detection import detect
from raychan.processing.range_doppler import range_doppler
from raychan.radar.waveform import Waveform
from raychan.signal.baseband import synthesize
from raychan.units import C0

WAVE = Waveform(77e9, 1e9, 20e-6, 40e-6, 64, 128)


def _found(reach, rate, amplitudes, elements=None):
    """Return the detections of echoes that lie some resolution cells from 6 m and 0 m/s."""
    ranges, rates = 6.0 + np.array(reach) * WAVE.range_resolution, np.array(rate) * WAVE.rate_resolution
    ranges = ranges - rates * WAVE.centre
    radar = make_radar(WAVE, noise=True, **({} if elements is None else {"elements": elements}))
    map = range_doppler(synthesize(echoes(ranges, rates, amplitudes), radar, np.random.default_rng(1)), WAVE)
    return detect(map, waveform=WAVE, elements=elements)


LINE = np.arange(4.0)[:, None] * [0.0, 0.5 * C0 / WAVE.middle, 0.0]


@pytest.mark.parametrize("elements", [None, LINE])
@pytest.mark.parametrize("along", ["range", "rate"])
@pytest.mark.parametrize("beside", [2.0, 2.4, -2.2])
def test_side_lobes_of_an_echo_on_the_slope_of_a_stronger_one_are_no_detections(along, beside, elements):
    apart = ([0.0, beside], [0.3, 0.3]) if along == "range" else ([0.3, 0.3], [0.0, beside])
    for phase in np.linspace(0.0, 6.0, 7):
        found = _found(*apart, [0.1, 0.1 * 10 ** (-24 / 20) * np.exp(1j * phase)], elements)
        away = found.rate / WAVE.rate_resolution if along == "range" else (found.range - 6.0) / WAVE.range_resolution
        assert len(away) and (np.abs(away - 0.3) < 1.0).all()


@pytest.mark.parametrize("below_db", [30, 40])
def test_a_weak_mover_in_the_range_cell_of_an_echo_on_a_slope_is_found(below_db):
    amplitudes = np.array([1.0, 10 ** (-22 / 20), 10 ** (-below_db / 20)]) * 1e-2
    found = _found([0.0, 2.2, 2.2], [0.0, 0.0, 8.0], amplitudes)
    assert np.abs(found.rate / WAVE.rate_resolution - 8.0).min() < 0.3
