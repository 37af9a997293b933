"""A whole run with several transmitters: a fast mover has its azimuth and rate, and the detection knows its body."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc

WAVE = rc.Waveform(77e9, 300e6, 15e-6, 20e-6, n_chirps=192, n_samples=128)


@pytest.mark.parametrize(("multiplexing", "doa"), [("tdm", "bartlett"), ("tdm", "music"), ("ddm", "bartlett")])
def test_a_mover_at_20_m_per_s_has_its_azimuth_its_rate_and_its_body(multiplexing, doa, tmp_path):
    """20 m/s are beyond the 16.2 m/s (12.2 m/s) that three (four) shares of the chirps tell apart."""
    azimuth = np.radians(17.0)
    look = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    scene = rc.Scene(
        bodies=[
            rc.Body(name="ball", shape="sphere", params={"radius": 0.5}, position=12.0 * look + [0, 0, 0.5],
                    velocity=20.0 * look),
        ],
        radar=rc.Radar(
            WAVE, power=1.0, antenna=rc.CosineAntenna(90.0, 40.0), multiplexing=multiplexing,
            **rc.mimo_array(3, 8, 0.5 * WAVE.wavelength), processing=rc.Processing(doa=doa),
        ),
    )  # fmt: skip
    result = rc.simulate(scene, seed=4)
    assert result.cube.samples.shape == (8, 192, 128) and result.rdmap.spectrum.shape[0] == 24
    assert np.degrees(result.detections.azimuth[0]) == pytest.approx(17.0, abs=0.5)
    assert result.detections.rate[0] == pytest.approx(20.0, abs=0.1)
    assert result.detections.range[0] == pytest.approx(11.5 + 20.0 * 0.5 * WAVE.frame_duration, abs=0.1)
    assert result.provenance[0].bodies == "ball" and not result.detections.folded[0]
    again = rc.Scene.from_text(scene.to_toml()).radar
    np.testing.assert_allclose(again.virtual_elements, scene.radar.virtual_elements, atol=1e-12)


def test_a_rate_that_another_direction_explains_as_well_is_told_to_be_ambiguous():
    """By time division, transmitters above each other: half a turn between them is a fold or an elevation."""
    wave = rc.Waveform(77e9, 200e6, 20e-6, n_chirps=48, n_samples=64)
    above = np.array([[0.0, 0.0, -0.5], [0.0, 0.0, 0.5]]) * wave.wavelength
    ball = rc.Body(name="ball", shape="sphere", params={"radius": 0.01}, position=(25.0, 0.0, 2.0),
                   velocity=(30.0, 0.0, 0.0), rcs_dbsm=10.0)  # fmt: skip
    radar = rc.Radar(
        wave, power=1.0, tx_elements=above, elements=rc.uniform_array(8, 0.5 * wave.wavelength), multiplexing="tdm"
    )
    result = rc.simulate(rc.Scene([ball], radar=radar, model={"max_bounces": 1}))
    assert result.detections.ambiguous.all()
    assert any("ambiguous in rate and direction (number 1)" in line for line in result.warnings)
    assert not any("ambiguous in direction" in line for line in result.warnings)
