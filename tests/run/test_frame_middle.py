"""Frames that are traced once: levels, rates and directions are those of their middle, samples refer to their start."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc
from raychan.units import C0
from raychan.view.scene import drawing_of

_WAVE = {"carrier": 77e9, "bandwidth": 300e6, "chirp_duration": 20e-6, "n_samples": 128}
_RADIUS = 0.3


def _scene(
    place: tuple[float, ...],
    velocity: tuple[float, ...],
    *,
    own: float = 0.0,
    repetition: float = 300e-6,
    chirps: int = 64,
    model: dict[str, object] | None = None,
) -> rc.Scene:
    """Return a ball before eight receivers on a radar that drives ahead."""
    ball = rc.Body(
        name="ball", shape="sphere", params={"radius": _RADIUS}, position=place, velocity=velocity, material="pec"
    )
    radar = rc.Radar(
        position=(0.0, 0.0, 1.0),
        velocity=(own, 0.0, 0.0),
        elements=[(0.0, 0.00194 * k, 0.0) for k in range(8)],
        waveform=rc.Waveform(**_WAVE, n_chirps=chirps, repetition=repetition),
        power=100.0,
        noise=False,
    )
    return rc.Scene(bodies=[ball], radar=radar, model={"max_bounces": 1, "tolerance_db": 0.25, **(model or {})})


def _strongest(result: rc.Result) -> int:
    return int(np.argmax(result.detections.power))


@pytest.mark.parametrize(("velocity", "own"), [(20.0, 0.0), (-15.0, 0.0), (0.0, 12.0)])
def test_the_level_is_that_of_a_ball_at_rest_where_it_is_at_mid_frame(velocity: float, own: float) -> None:
    scene = _scene((4.0, 0.0, 1.0), (velocity, 0.0, 0.0), own=own, repetition=80e-6)
    middle = scene.radar.waveform.centre
    there = _scene((4.0 + (velocity - own) * middle, 0.0, 1.0), (0.0, 0.0, 0.0), repetition=80e-6)
    moved, at_rest = rc.simulate(scene), rc.simulate(there)
    one, other = (r.detections.power[_strongest(r)] for r in (moved, at_rest))
    # The start is 0.13 to 0.22 dB off.
    assert 10.0 * np.log10(one / other) == pytest.approx(0.0, abs=0.03)
    assert moved.stats["traced_at_s"] == middle
    assert at_rest.stats["traced_at_s"] == 0.0


def test_rate_and_azimuth_of_a_crossing_ball_are_those_of_the_middle() -> None:
    scene = _scene((12.0, 1.0, 1.0), (0.0, 12.0, 0.0))
    then = np.array([12.0, 1.0 + 12.0 * scene.radar.waveform.centre, 0.0])
    found = rc.simulate(scene).detections
    at = int(np.argmax(found.power))
    assert found.rate[at] == pytest.approx(12.0 * then[1] / np.linalg.norm(then), abs=0.01)
    assert np.degrees(found.azimuth[at]) == pytest.approx(np.degrees(np.arctan2(then[1], then[0])), abs=0.05)


def test_delays_and_phases_refer_to_the_start_of_the_frame() -> None:
    scene = _scene((9.0, 0.0, 1.0), (20.0, 0.0, 0.0))
    paths = rc.simulate(scene).paths
    start = rc.simulate(_scene((9.0, 0.0, 1.0), (0.0, 0.0, 0.0))).paths
    assert np.min(paths.length) == pytest.approx(np.min(start.length), abs=1e-4)
    # Their sums have one phase: that of the front of the ball.
    turn = np.angle(paths.amplitude.sum() / start.amplitude.sum())
    assert turn == pytest.approx(0.0, abs=0.02)


def test_samples_are_those_of_a_tracing_at_each_chirp() -> None:
    place, velocity = np.array([9.0, 0.5, 1.0]), np.array([-18.0, 2.0, 0.0])
    scene = _scene(tuple(place), tuple(velocity))
    samples, middle = rc.simulate(scene).cube.samples[0], scene.radar.waveform.centre
    for chirp in range(0, 64, 9):
        time = chirp * scene.radar.waveform.repetition
        one = rc.simulate(_scene(tuple(place + time * velocity), tuple(velocity), chirps=1)).cube.samples[0, 0]
        # Levels, by 1 / R^2 of the amplitude, and phases, by the radial acceleration, are those of the middle.
        level = 2.0 * 18.0 * abs(time - middle) / 8.5
        phase = 2.0 * np.pi * 77e9 / C0 * (2.0 + 18.0 * 0.5 / 9.0) ** 2 / 8.5 * (time - middle) ** 2
        assert np.linalg.norm(samples[chirp] - one) / np.linalg.norm(one) < level + phase + 0.01


def test_stages_and_simulate_trace_the_same_instant() -> None:
    scene = _scene((9.0, 0.5, 1.0), (-18.0, 2.0, 0.0), own=3.0)
    by_stages = rc.transfer(rc.trace(scene), scene.radar)
    paths = rc.simulate(scene).paths
    assert np.array_equal(np.sort(by_stages.length), np.sort(paths.length))
    assert by_stages.amplitude.sum() == pytest.approx(paths.amplitude.sum())


def test_a_frame_in_whose_middle_the_radar_is_inside_a_body_is_that_of_its_start_and_says_so() -> None:
    # A preview: levels of a ball so near and fast take minutes to refine.
    result = rc.simulate(_scene((0.45, 0.0, 1.0), (-20.0, 0.0, 0.0), model={"mode": "preview"}))
    assert result.stats["traced_at_s"] == 0.0
    assert any("frame's start" in line for line in result.warnings)


def test_rays_end_on_the_bodies_of_a_picture() -> None:
    scene = _scene((9.0, 0.5, 1.0), (-18.0, 2.0, 0.0), own=3.0)
    drawing = drawing_of(scene, rc.simulate(scene))
    corners = np.concatenate([shape.triangles.reshape(-1, 3) for shape in drawing.shapes])
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    for ray in drawing.rays:
        assert np.linalg.norm(np.asarray(ray.points)[1] - middle) == pytest.approx(_RADIUS, rel=0.02)


def test_phases_are_carried_back_by_the_carrier() -> None:
    scene = _scene((9.0, 0.0, 1.0), (20.0, 0.0, 0.0))
    middle = scene.radar.waveform.centre
    there = rc.simulate(_scene((9.0 + 20.0 * middle, 0.0, 1.0), (0.0, 0.0, 0.0))).paths.amplitude.sum()
    turned = there * np.exp(2j * np.pi * scene.radar.waveform.carrier / C0 * 2.0 * 20.0 * middle)
    assert abs(rc.simulate(scene).paths.amplitude.sum() / turned - 1.0) < 0.02


def test_receivers_elsewhere_that_move_are_where_they_are_at_mid_frame_in_each_frame_of_a_sequence() -> None:
    radar = rc.Radar(
        rc.Waveform(**_WAVE, n_chirps=64, repetition=400e-6),
        position=(0.0, 0.0, 1.0),
        rx_position=(0.0, 6.0, 1.0),
        rx_velocity=(20.0, 0.0, 0.0),
        antenna=rc.IsotropicAntenna(),
    )
    point = rc.Body("p", shape="sphere", params={"radius": 0.01}, position=(10.0, 2.0, 1.0), rcs_dbsm=20.0)
    scene = rc.Scene(bodies=[point], radar=radar, model={"max_bounces": 1})
    for frame in rc.frames(scene, 2, 0.05):
        then = frame.time + radar.waveform.centre
        way = np.array([10.0 - 20.0 * then, -4.0, 0.0])
        rates = frame.result.paths.range_rate
        assert np.abs(rates - 0.5 * (-20.0 * way[0]) / np.linalg.norm(way)).min() < 1e-6


def test_frames_with_an_interferer_that_moves_are_those_of_runs_by_themselves() -> None:
    wave = rc.Waveform(**_WAVE, n_chirps=32, repetition=200e-6)
    radar = rc.Radar(wave, position=(0.0, 0.0, 1.0), power=0.01)
    other = rc.Radar(wave, position=(10.0, 3.0, 1.0), yaw_deg=180.0, velocity=(0.0, -20.0, 0.0), power=0.01)
    point = rc.Body("p", shape="sphere", params={"radius": 0.01}, position=(20.0, 1.0, 1.0), rcs_dbsm=20.0)
    beside = [rc.Interferer(radar=other, name="other", locked=True)]
    scene = rc.Scene(bodies=[point], radar=radar, interferers=beside, model={"max_bounces": 1})
    for frame in rc.frames(scene, 2, 0.05):
        alone = rc.simulate(scene.at(frame.time), seed=frame.number).cube.samples
        off = np.linalg.norm(frame.result.cube.samples - alone) / np.linalg.norm(alone)
        assert off < 1e-4


def test_the_phase_left_out_of_receivers_beside_the_transmitter_is_that_of_one_place() -> None:
    levels = []
    for aside in (None, (0.0, 0.01, 1.0)):
        radar = rc.Radar(rc.Waveform(**_WAVE, n_chirps=64, repetition=300e-6), position=(0, 0, 1), rx_position=aside)
        point = rc.Body(
            "p", shape="sphere", params={"radius": 0.01}, position=(8, 0, 1), velocity=(0, 22, 0), rcs_dbsm=30
        )
        result = rc.simulate(rc.Scene(bodies=[point], radar=radar, model={"max_bounces": 1, "retrace": 1}))
        levels.append(result.ledger["intra-frame motion"].level_db)
        assert any("intra-frame motion" in line for line in result.warnings)
    assert levels[0] == pytest.approx(levels[1], abs=0.1)
