"""Ranges of folded echoes at both ends: what their Doppler shifts take beyond one end comes from the other."""

from __future__ import annotations

import numpy as np
import pytest
from support.echoes import echoes, make_radar

from raychan.radar.array import mimo_array, uniform_array
from raychan.radar.processing import Processing
from raychan.radar.waveform import Waveform
from raychan.run.receiver import detections_in, map_of
from raychan.signal.baseband import synthesize
from raychan.units import C0

STEP = 0.5 * C0 / 77e9
RAMP = {"bandwidth": 300e6, "chirp_duration": 20e-6, "n_chirps": 48, "n_samples": 64}
EQUAL, STAGGERED = {"repetition": 30e-6}, {"stagger": (30e-6, 33e-6, 37e-6)}
LINE = {"elements": uniform_array(4, STEP)}


def strongest(given, times, place, rate, complex_sampling=True):
    """Return waveform, detections, and the row of the strongest, of an echo at a place [m] at mid frame."""
    wave = Waveform(77e9, **RAMP, **times, complex_sampling=complex_sampling)
    radar = make_radar(wave, **given)
    sent = echoes([place - rate * wave.centre], rate, 1e-3, 0.2)
    found = detections_in(map_of(synthesize(sent, radar), radar, radar.processing), radar, radar.processing)
    return wave, found, int(np.argmax(found.power))


@pytest.mark.parametrize(
    ("given", "times", "before_end", "rate"),
    [
        (mimo_array(2, 4, STEP) | {"multiplexing": "ddm"}, EQUAL, 0.05, 30.0),
        (mimo_array(2, 4, STEP) | {"multiplexing": "tdm"}, EQUAL, 0.14, 21.9),
        (LINE, STAGGERED, 0.41, 79.5),
    ],
)
def test_an_echo_before_the_end_of_the_ranges_is_not_before_the_radar(given, times, before_end, rate):
    place = Waveform(77e9, **RAMP, **times).unambiguous_range - before_end
    wave, found, row = strongest(given, times, place, rate)
    assert ((found.range >= 0.0) & (found.range < wave.unambiguous_range)).all()
    assert found.range[row] == pytest.approx(place, abs=0.2 * wave.range_resolution)


def test_with_real_sampling_the_mirror_image_of_an_echo_near_the_radar_is_ambiguous():
    _, found, row = strongest(LINE, STAGGERED, 0.12, -83.2, complex_sampling=False)
    assert abs(found.rate[row] + 83.2) < 1.0 or found.ambiguous[row]


@pytest.mark.parametrize("pad", [2, 4])
@pytest.mark.parametrize("receivers", [1, 4])
@pytest.mark.parametrize("cells", [0.3, 0.7, 1.2])
def test_an_echo_near_the_radar_is_no_detection_at_minus_its_rate(cells, receivers, pad):
    """With real sampling the map goes on beyond range 0 as the images of echoes of the other sign of rate."""
    wave = Waveform(77e9, **RAMP, **EQUAL, complex_sampling=False)
    elements = uniform_array(receivers, STEP)
    radar = make_radar(wave, elements=elements, processing=Processing(pad=(pad, pad), min_snr_db=30.0))
    for rate in (-17.2, 9.57):
        place = cells * wave.range_resolution
        sent = echoes([place - rate * wave.centre], rate, 1e-3, 0.2)
        found = detections_in(map_of(synthesize(sent, radar), radar, radar.processing), radar, radar.processing)
        assert len(found.range) == 1
        assert found.rate[0] == pytest.approx(rate, abs=0.5 * wave.rate_resolution)
        assert found.range[0] == pytest.approx(place, abs=0.5 * wave.range_resolution)
