"""Peaks of echoes on side lobes of stronger ones, in the beams of arrays: those of a map of finer cells."""

from __future__ import annotations

import numpy as np
import pytest
from support.echoes import echoes, make_radar

from raychan.radar.array import mimo_array, uniform_array
from raychan.radar.processing import Processing
from raychan.radar.waveform import Waveform
from raychan.radar.windows import window
from raychan.run.receiver import detections_in, map_of
from raychan.signal.baseband import synthesize
from raychan.units import C0, db

STEP = 0.5 * C0 / 77e9
ARRAYS = {
    "line": {"elements": uniform_array(8, STEP)},
    "tdm": mimo_array(2, 4, STEP) | {"multiplexing": "tdm"},
    "ddm": mimo_array(2, 4, STEP) | {"multiplexing": "ddm"},
}


def seen(array, sampling, sent, name, pad):
    """Return the detections of echoes (ranges in resolution cells, amplitudes), all in one direction."""
    wave = Waveform(77e9, 300e6, 20e-6, 30e-6, 48, 64, complex_sampling=sampling == "I/Q")
    settings = Processing(range_window=name, rate_window=name, pad=(pad, pad), min_snr_db=3.0)
    radar = make_radar(wave, processing=settings, **ARRAYS[array])
    rate, (reach, levels) = 2.3 * wave.rate_resolution, sent
    paths = echoes(np.array(reach) * wave.range_resolution - rate * wave.centre, rate, levels, 0.2)
    return detections_in(map_of(synthesize(paths, radar), radar, settings), radar, settings), wave


@pytest.mark.parametrize(("name", "away"), [("rect", 7.83), ("hann", 6.09)])
@pytest.mark.parametrize("sampling", ["I/Q", "real"])
@pytest.mark.parametrize("array", ARRAYS)
def test_an_echo_on_a_side_lobe_reads_what_a_map_of_finer_cells_shows(array, sampling, name, away):
    taper = window(name, 64)
    lobe = abs(np.exp(2j * np.pi * away * np.arange(64) / 64) @ taper) / taper.sum()
    sent = [12.3, 12.3 + away], [1e-3, 3e-3 * lobe * np.exp(2j * np.pi * away)]
    (found, wave), (fine, _) = (seen(array, sampling, sent, name, pad) for pad in (2, 8))
    assert len(found.range) == len(fine.range) == 2
    assert db(found.power) == pytest.approx(db(fine.power), abs=0.005)
    assert found.range == pytest.approx(fine.range, abs=0.003 * wave.range_resolution)
    assert found.rate == pytest.approx(fine.rate, abs=0.003 * wave.rate_resolution)
