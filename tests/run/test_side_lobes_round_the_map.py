"""What a side lobe reaches round the ends of the map is not folded, unless the echo itself is."""

import numpy as np
import pytest
from support.echoes import echoes

import raychan as rc
from raychan.run.explanation.folding import Shown, truth
from raychan.run.explanation.point_spread import PointSpread

WAVE = rc.Waveform(77e9, 300e6, 30e-6, n_chirps=32, n_samples=512)
LIMIT = WAVE.unambiguous_range


def told(at, rate, shown_range, shown_rate, unfolded=0.0, wave=WAVE):
    """Return the truth of a cell that one path explains."""
    shown = Shown(shown_range, shown_rate, shown_rate + unfolded)
    return truth(echoes([at], rate), np.array([0]), 0, PointSpread(wave, "hann", "hann"), shown)


@pytest.mark.parametrize("complex_sampling", [True, False])
def test_a_side_lobe_beyond_either_end_of_the_map_is_not_folded(complex_sampling):
    wave = rc.Waveform(77e9, 300e6, 30e-6, n_chirps=32, n_samples=512, complex_sampling=complex_sampling)
    far = wave.unambiguous_range - 3.0
    assert not told(15.24, 0.0, far, 0.0, wave=wave).folded
    assert told(15.24, 0.0, far, 0.0, wave=wave).range == pytest.approx(15.24, abs=0.01)
    top = wave.unambiguous_rate
    assert not told(15.24, 0.9 * top, 15.24, -0.5 * top, wave=wave).folded


def test_side_lobes_of_folded_echoes_are_folded():
    assert told(LIMIT + 40.0, 0.0, 80.0, 0.0).folded
    period = PointSpread(WAVE, "hann", "hann").periods[1]
    assert told(40.0, period, 80.0, 0.0).folded
    assert not told(40.0, period, 80.0, 0.0, unfolded=period).folded


def test_spurs_of_a_saturated_converter_are_not_called_folded_and_the_run_says_that_errors_do_not_hold_them():
    ball = rc.Body("ball", shape="sphere", params={"radius": 0.05}, position=(15.237, 0.0, 0.5), rcs_dbsm=85.0)
    faults = rc.Impairments(converter=rc.Converter(12, -60.0))
    found = rc.simulate(rc.Scene([ball], radar=rc.Radar(WAVE, noise=False, impairments=faults)))
    assert len(found.detections.range) > 20 and not found.detections.folded.any()
    (line,) = [x for x in found.warnings if "clips" in x]
    assert line.endswith("the errors stated do not hold what clipping does to levels, nor its spurs")
