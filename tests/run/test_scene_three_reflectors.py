"""The bundled scene of three reflectors: one alone, two in one cell, as published."""

import numpy as np
import pytest

import raychan as rc
from raychan.world.scene_files.bundled import found


@pytest.fixture(scope="module")
def result():
    return rc.simulate(rc.Scene.load(found("three_reflectors")), seed=0)


def test_the_three_targets_are_detected_where_they_are_printed(result):
    d = result.detections
    assert [why.bodies for why in result.provenance] == ["t1", "t2", "t3"]
    assert d.range == pytest.approx([20.0, 32.0, 32.0], abs=0.15)  # a range cell
    assert d.rate == pytest.approx([9.0, -10.0, -10.0], abs=0.39)  # a rate cell
    assert np.degrees(d.azimuth) == pytest.approx([-15.0, 2.0, -2.0], abs=0.2)
    assert not d.ambiguous.any()


def test_a_target_at_32_m_has_6_db_a_sample_at_one_receiver(result):
    radar = result.require_scene().radar
    power = radar.power * np.abs(result.paths.amplitude[1:]) ** 2
    assert 10.0 * np.log10(power / radar.noise_power) == pytest.approx([6.0, 6.0], abs=0.05)


def test_the_pair_is_in_phase_at_the_first_receiver(result):
    """Ways from transmitter over a target to the first receiver: equal to a hundredth of a wavelength."""
    scene = result.require_scene()
    at = scene.points(0.0).position[1:]
    here = scene.radar.position
    first = here + scene.radar.elements_world[0]
    ways = np.linalg.norm(at - here, axis=1) + np.linalg.norm(at - first, axis=1)
    assert abs(np.diff(ways)[0]) < 0.01 * scene.radar.waveform.wavelength


def test_shares_and_levels_of_a_detection_are_those_in_its_beam(result):
    """In the middle of the array both echoes of the cell have the same level."""
    for number, body in ((2, "t2"), (3, "t3")):
        why = rc.explain(result, detection=number)
        assert why.beam and why.paths.beam
        level = np.abs(why.paths.wave) ** 2
        first = why.contributions[0]
        assert first.chain == (body,) == why.paths.chains[why.paths.chain[0]]
        assert level[0] / level.sum() == pytest.approx(first.share, abs=1e-3)
        assert why.predicted == pytest.approx(abs(why.paths.wave.sum()) ** 2, rel=2e-2)
    alone = rc.explain(result, detection=1)
    assert alone.beam and alone.paths.beam
    assert alone.predicted == pytest.approx(rc.explain(result, alone.range, alone.speed, cell=True).predicted, rel=1e-3)


def test_a_pair_that_cancels_at_the_middle_of_the_array_is_named(result):
    """Bartlett's beams show one detection between the two, whose echoes add up to little at the middle."""
    scene = result.require_scene().override(["processing.doa=bartlett"])
    merged = rc.simulate(scene, seed=0)
    pair = [why for why in merged.provenance if why.range > 30.0]
    assert len(pair) == 1
    assert (pair[0].label, pair[0].bodies) == ("direct", "t2")
    assert pair[0].predicted == pytest.approx(pair[0].power, rel=0.1)
