"""Of which time in the frame range, rate and azimuth of a detection are, as docs/conventions.md has it."""

from dataclasses import dataclass

import numpy as np
import pytest

import raychan as rc
from raychan.cli import invoke

WAVE = rc.Waveform(carrier=77e9, bandwidth=5e8, chirp_duration=40e-6, n_chirps=512, n_samples=128)
POST, SPEED = np.array([4.0, 4.0]), 30.0


def seen_at(time: float) -> tuple[float, float, float]:
    """Return range [m], rate [m/s] and azimuth [deg] of the post from a radar that passes it."""
    away = POST - [SPEED * time, 0.0]
    far = float(np.linalg.norm(away))
    return far, float(-SPEED * away[0] / far), float(np.degrees(np.arctan2(away[1], away[0])))


@pytest.mark.parametrize("tracings", [1, 2, 5])
def test_range_rate_and_azimuth_are_of_the_middle_traced_once_or_often(tracings):
    post = rc.Body("post", shape="sphere", params={"radius": 0.01}, position=(*POST, 0.5), rcs_dbsm=0.0)
    line = rc.uniform_array(8, 0.5 * WAVE.wavelength)
    radar = rc.Radar(WAVE, position=(0.0, 0.0, 0.5), velocity=(SPEED, 0.0, 0.0), elements=line)
    result = rc.simulate(rc.Scene([post], radar=radar, model={"max_bounces": 1, "retrace": tracings}))
    found, why = result.detections, result.provenance[0]
    far, rate, azimuth = seen_at(WAVE.centre)
    assert found.range == pytest.approx([far], abs=0.01)
    assert found.rate == pytest.approx([rate], abs=0.06)
    assert np.degrees(found.azimuth) == pytest.approx([azimuth], abs=0.15)
    # What is told of the truth is of the middle, too: the rates of start and end are 2.5 m/s apart.
    assert found.true_range == pytest.approx([far], abs=0.01)
    assert [*found.true_rate, why.contributions[0].rate] == pytest.approx([rate, rate], abs=0.01)
    assert [why.departure[1], why.arrival[1]] == pytest.approx(2 * [np.sin(np.radians(azimuth))], abs=1e-3)
    assert result.traced_at == pytest.approx(WAVE.centre, abs=WAVE.repetition)


RETRACED = [(9, 0.0, "move or turn relative to the radar"), ("auto", 900.0, "turn")]


@pytest.mark.parametrize(("retrace", "turn", "moves"), RETRACED)
@pytest.mark.parametrize(
    ("key", "radar"),
    [
        ("radar.rx_position", {"rx_position": [0.0, 3.0, 0.5]}),
        ("radar.rx_polarization", {"rx_polarization": "both"}),
        ("radar.waveform.stagger_us", {"stagger_us": [40.0, 50.0]}),
    ],
)
def test_a_frame_that_is_traced_once_only_is_refused_by_its_key(tmp_path, capsys, key, radar, retrace, turn, moves):
    wave = {"bandwidth_mhz": 300.0, "chirp_us": 30.0, "chirps": 512, "samples": 64}
    wave |= {"stagger_us": radar["stagger_us"]} if "stagger_us" in radar else {"repetition_us": 40.0}
    given = {"position": [0.0, 0.0, 0.5], "velocity_mps": [SPEED, 0.0, 0.0], "waveform": wave}
    given |= {name: value for name, value in radar.items() if name != "stagger_us"}
    box = rc.Body("box", shape="box", position=(*POST, 0.5), turn_rate_dps=turn)
    scene = rc.Scene([box], radar=given, model={"max_bounces": 1, "retrace": retrace})
    file = tmp_path / "scene.toml"
    file.write_text(scene.to_toml(), encoding="utf-8")
    with pytest.raises(rc.SceneError) as refused:
        rc.simulate(rc.Scene.load(file))
    error = refused.value
    assert (error.key, error.value, error.allowed, error.file) == ("model.retrace", retrace, "1", file)
    assert key in str(error) and f"bodies {moves} is traced once" in str(error)
    assert invoke(["run", str(file), "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert "model.retrace" in said and "Traceback" not in said and not (tmp_path / "out").exists()


@dataclass(frozen=True)
class Silent(rc.Waveform):
    """A waveform of one's own of which no echo is heard."""

    def received(self, amplitude, delay, delay_rate):
        return np.zeros((self.n_chirps, self.n_samples), complex)

    def compressed(self, samples):
        return samples


def test_a_waveform_of_ones_own_is_refused_where_frames_take_several_tracings():
    wave = Silent(carrier=77e9, bandwidth=3e8, chirp_duration=3e-5, repetition=4e-5, n_chirps=512, n_samples=64)
    box = rc.Body("box", shape="box", position=(*POST, 0.5), turn_rate_dps=400.0)
    radar = rc.Radar(wave, position=(0.0, 0.0, 0.5))
    with pytest.raises(rc.SceneError, match="waveform of one's own") as refused:
        rc.simulate(rc.Scene([box], radar=radar, model={"max_bounces": 1}))
    assert refused.value.key == "model.retrace"
    once = rc.simulate(rc.Scene([box], radar=radar, model={"max_bounces": 1, "retrace": 1}))
    assert len(once.detections.range) == 0
