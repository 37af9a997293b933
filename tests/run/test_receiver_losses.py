"""What beams of plane waves lose of spherical ones, and peaks of echoes that migrate: as levels of runs, and told."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc
from raychan.processing.scan import Scan
from raychan.radar.array import mimo_array, uniform_array
from raychan.run.receiver_losses import beam_losses, far_field_distance, migration, near_field_losses, range_spread
from raychan.units import C0

STEP = 0.5 * C0 / 77e9


@pytest.fixture(autouse=True)
def music_stays_with_plane_waves(monkeypatch):
    """Let music seek near echoes as plane waves, as any method does where curvature is below the noise."""
    fronts = Scan.fronts
    monkeypatch.setattr(Scan, "fronts", lambda scan, *of: fronts(scan, *of) if scan.method == "bartlett" else [scan])


def run(
    place, rate=0.0, window="hann", chirps=16, pad=2, azimuth=0.2, bandwidth=1e9, samples=128, doa="bartlett", **radar
):
    """Return a run of a point target of 10 dBsm on a direction of 0.2 rad, and its radar."""
    wave = rc.Waveform(77e9, bandwidth, 20e-6, 40e-6, chirps, samples)
    look = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    settings = rc.Processing(range_window=window, rate_window=window, pad=(pad, pad), doa=doa)
    made = rc.Radar(wave, noise=False, position=(0.0, 0.0, 0.0), processing=settings, **radar)
    target = {"shape": "box", "rcs_dbsm": 10.0, "rcs_point": (0.0, 0.0, 0.0)}
    body = rc.Body("target", position=place * look, velocity=rate * look, **target)
    return rc.simulate(rc.Scene([body], radar=made)), made


def up(loss):
    """Return a loss [dB] as lines have it, which do not fall short of it."""
    return f"{np.ceil(10.0 * loss) / 10.0:.1f}"


def level(result):
    """Return the level [dB] of the only detection."""
    (power,) = result.detections.power
    return 10.0 * np.log10(power)


@pytest.mark.parametrize("place", [3.0, 6.0, 9.0])
@pytest.mark.parametrize("receivers", [2, 64, 112])
def test_a_beam_loses_what_is_told_of_a_spherical_wave(receivers, place):
    elements = uniform_array(receivers, STEP)
    near, radar = run(place, elements=elements, doa="music")
    loss = near_field_losses(near.detections, radar)
    assert loss == pytest.approx([level(run(place)[0]) - level(near)], abs=0.06)
    said = [x for x in near.warnings if "near field" in x and "dB less" in x]
    assert len(said) == (loss[0] > 0.5)
    assert all(f"{up(loss[0])} dB less" in x and f"= {far_field_distance(radar):.3g} m" in x for x in said)


@pytest.mark.parametrize("place", [3.0, 6.0])
def test_a_beam_of_spherical_waves_loses_nothing(place):
    near, radar = run(place, elements=uniform_array(112, STEP))
    assert level(near) == pytest.approx(level(run(place)[0]), abs=0.06)
    assert near_field_losses(near.detections, radar)[0] < 0.06
    assert not any("near field" in x for x in near.warnings)


def test_an_array_beside_the_phase_centre_loses_no_more_than_about_it():
    elements = uniform_array(64, STEP)
    about, beside = (run(4.0, elements=elements + np.array([0.0, off, 0.0]))[0] for off in (0.0, 0.2))
    # Nearer to the target its wave is stronger.
    nearer = 20.0 * np.log10(4.0 / np.hypot(4.0 * np.cos(0.2), 4.0 * np.sin(0.2) - 0.2))
    assert level(beside) == pytest.approx(level(about) + nearer, abs=0.02)
    radar = beside.scene.radar
    assert near_field_losses(beside.detections, radar) == pytest.approx(
        near_field_losses(about.detections, about.scene.radar), abs=0.03
    )


def test_transmitters_and_receivers_lose_each_by_itself():
    near, radar = run(8.0, **mimo_array(8, 16, STEP), multiplexing="tdm", doa="music")
    far, _ = run(8.0)
    assert near_field_losses(near.detections, radar) == pytest.approx([level(far) - level(near)], abs=0.06)


@pytest.mark.parametrize("window", ["rect", "hann", "blackman"])
def test_a_peak_loses_what_is_told_of_an_echo_that_migrates(window):
    still = level(run(10.0, window=window, chirps=256, pad=4)[0])
    for rate in (3.0, -12.0, 24.0):
        found, radar = run(10.0, rate, window, 256, 4)
        moved, loss = migration(found.detections.true_rate, radar)
        # The run has the level of the target's place at mid frame.
        there = still - 40.0 * np.log10(1.0 + rate * radar.waveform.centre / 10.0)
        assert loss == pytest.approx([there - level(found)], abs=0.01)
        assert moved == pytest.approx([abs(rate) * 256 * 40e-6 / (0.5 * C0 / 1e9)], rel=1e-3)
        said = [x for x in found.warnings if "over range cells" in x]
        assert len(said) == (loss[0] > 0.5)
        assert all(f"up to {moved[0]:.1f}: peaks read up to {up(loss[0])} dB less" in x for x in said)


@pytest.mark.parametrize(("receivers", "place"), [(64, 0.6), (128, 2.0)])
def test_where_a_beams_peak_splits_what_is_told_is_the_loss_of_the_best_beam(receivers, place):
    near, radar = run(place, elements=uniform_array(receivers, STEP), doa="music")
    found, y = near.detections, radar.elements[:, 1]
    assert len(found.range) == 2
    for away, azimuth, told in zip(found.range, found.azimuth, near_field_losses(found, radar), strict=True):
        wave = np.hypot(away * np.cos(azimuth), away * np.sin(azimuth) - y)
        beams = np.exp(1j * np.pi / STEP * (wave + np.linspace(-1.0, 1.0, 4001)[:, None] * y))
        assert told == pytest.approx(-20.0 * np.log10(np.abs(beams.mean(axis=1)).max()), abs=0.1)
        # Its parts are seen in beams with nulls towards each other, which read more.
        assert told > level(run(place)[0]) - 10.0 * np.log10(found.power.max())


def test_an_echo_that_folds_to_the_near_field_loses_nothing():
    wave = rc.Waveform(77e9, 1e9, 20e-6, 40e-6, 16, 256)
    target = {"shape": "box", "rcs_dbsm": 40.0, "rcs_point": (0.0, 0.0, 0.0), "position": (40.0, 0.0, 0.0)}
    radar = rc.Radar(wave, noise=False, elements=uniform_array(64, STEP))
    found = rc.simulate(rc.Scene([rc.Body("target", **target)], radar=radar))
    assert found.detections.range[0] < 5.0 and not any("near field" in x for x in found.warnings)


@pytest.mark.parametrize(
    ("senders", "receivers", "azimuth", "window"),
    [(8, 8, 0.0, "rect"), (8, 8, 1.0, "hann"), (1, 64, 1.0, "rect"), (1, 64, 1.0, "hann"), (4, 32, 0.8, "rect")],
)
def test_a_beam_loses_what_is_told_of_ranges_that_differ_over_the_elements(senders, receivers, azimuth, window):
    wide = {"azimuth": azimuth, "bandwidth": 4e9, "samples": 512, "window": window, "chirps": 2 * senders}
    given = mimo_array(senders, receivers, 0.5 * C0 / 79e9) if senders > 1 else {"elements": rc.uniform_array(64, STEP)}
    division = {"multiplexing": "tdm"} if senders > 1 else {}
    found, radar = run(16.0, **wide, **given, **division)
    one, _ = run(16.0, **(wide | {"chirps": 2}))
    differ, loss = range_spread(found.detections, radar)
    near = near_field_losses(found.detections, radar)
    assert loss[0] + near[0] == pytest.approx(level(one) - found_level(found), abs=0.25)
    across = np.ptp(radar.virtual_elements[:, 1]) * np.sin(azimuth)
    assert differ[0] == pytest.approx(across * 4e9 / C0, rel=2e-3, abs=1e-2)
    whole = beam_losses(found.detections, found.provenance, radar).whole
    assert whole[0] == pytest.approx(level(one) - found_level(found), abs=0.25)
    said = [x for x in found.warnings if "have ranges that differ" in x or "has ranges that differ" in x]
    assert len(said) == (whole[0] > 0.5)
    assert all(f"by up to {differ[0]:.1f} cells" in x and f"{up(whole.max())} dB less" in x for x in said)


def found_level(result):
    """Return the level [dB] of the strongest detection."""
    return 10.0 * np.log10(result.detections.power.max())


def test_a_weaker_echo_told_apart_in_the_cell_of_a_near_one_is_no_side_lobe_of_it():
    place, azimuths = 4.03, np.radians([-8.0, 9.6])
    _, radar = run(place, elements=uniform_array(64, STEP))
    bodies = [
        rc.Body(f"target_{k}", shape="box", rcs_dbsm=level_dbsm, position=place * np.array([np.cos(a), np.sin(a), 0.0]))
        for k, (a, level_dbsm) in enumerate(zip(azimuths, (0.0, -4.8), strict=True))
    ]
    found = rc.simulate(rc.Scene(bodies, radar=radar)).detections
    assert np.sort(found.azimuth) == pytest.approx(azimuths, abs=0.01)


@pytest.mark.parametrize(
    ("away", "azimuth", "bandwidth"), [(22.0, -0.65, 370e6), (24.0, 0.65, 370e6), (30.0, 0.9, 6e8)]
)
def test_losses_that_come_together_are_told_in_one_figure_that_is_not_exceeded(away, azimuth, bandwidth):
    """Of a near wave whose range differs over the elements each loss alone is less than both."""
    wide = {"azimuth": azimuth, "bandwidth": bandwidth, "chirps": 24}
    both, radar = run(away, **wide, **mimo_array(3, 48, STEP * 2.2), multiplexing="tdm", doa="music")
    one, _ = run(away, **(wide | {"chirps": 8}))
    less, said = level(one) - found_level(both), [x for x in both.warnings if "dB less" in x]
    losses = beam_losses(both.detections, both.provenance, radar)
    assert losses.whole.max() == pytest.approx(less, abs=0.06)
    assert max(losses.near.max(), losses.ranges.max()) < less - 0.1
    told = [float(x.split(" dB less")[0].split()[-1]) for x in said]
    assert len(told) == 1 and less - 0.03 < told[0] < less + 0.2
    assert "counted in" in said[0]


def test_two_losses_of_which_none_is_told_alone_are_told():
    wide = mimo_array(3, 48, STEP * 2.2)
    both, radar = run(22.0, azimuth=0.9, bandwidth=5e8, chirps=24, **wide, multiplexing="tdm", doa="music")
    losses = beam_losses(both.detections, both.provenance, radar)
    assert losses.near[0] < 0.5 and losses.ranges[0] < 0.5 < losses.whole[0]
    assert sum("dB less" in x and "counted in" in x for x in both.warnings) == 1


def test_an_echo_that_shows_in_a_grating_lobe_loses_by_where_it_comes_from():
    wide = {"azimuth": 0.87, "bandwidth": 1.2e9, "samples": 256}
    lobes, radar = run(14.0, **wide, elements=uniform_array(32, 4.0 * STEP), doa="music")
    assert abs(lobes.detections.azimuth[0]) < 0.4
    one, _ = run(14.0, **wide)
    losses = beam_losses(lobes.detections, lobes.provenance, radar)
    assert losses.whole == pytest.approx([level(one) - level(lobes)], abs=0.1)
    assert losses.ranges[0] > range_spread(lobes.detections, radar)[1][0] + 0.1


def test_before_an_array_that_detects_nothing_nothing_is_lost():
    wave = rc.Waveform(77e9, 1e9, 20e-6, 40e-6, 16, 128)
    radar = rc.Radar(wave, power=1e-9, elements=uniform_array(64, STEP))
    target = rc.Body("target", shape="box", rcs_dbsm=-60.0, position=(20.0, 0.0, 0.0))
    result = rc.simulate(rc.Scene([target], radar=radar))
    assert not len(result.detections.range)
    assert not len(beam_losses(result.detections, result.provenance, radar).whole)


@pytest.mark.parametrize(("cell", "least"), [(0.264, 5), (1.0, None)])
def test_a_line_tells_where_ranges_that_differ_over_the_elements_hide_echoes_of_a_cell(cell, least):
    """Three points of 42, 36 and 30 dB, far apart before a sparse line 0.49 m wide: the weakest is lost."""
    places = 0.5 * C0 / 24e9 * np.array([-40, -39, -32, -16, -11, -5, -4, -2, 0, 3, 8, 9, 11, 13, 14, 17, 34, 39])
    waveform = rc.Waveform(24e9, C0 / 2.0 / cell, 20e-6, 25e-6, n_chirps=24, n_samples=128)
    bodies = [
        rc.Body(
            f"t{k}",
            shape="sphere",
            params={"radius": 0.005},
            rcs_dbsm=-6.0 * k,
            position=(away * np.sqrt(1.0 - u**2), away * u, 0.0),
        )
        for k, (away, u) in enumerate([(10.54, -0.675), (10.57, 0.628), (10.53, -0.1745)])
    ]
    elements = np.stack([0.0 * places, places, 0.0 * places], axis=1)
    radar = rc.Radar(waveform, (0.0, 0.0, 0.0), power=1.16e-2, noise_figure_db=12.0, elements=elements)
    result = rc.simulate(rc.Scene(bodies, radar=radar, model={"max_bounces": 1}), seed=9)
    told = [line for line in result.warnings if "may hide echoes of their cells" in line]
    assert len(result.detections.range) == (3 if least is None else 2)
    assert [f"over {least} dB weaker (numbers 1, 2)" in line for line in told] == [True] * (least is not None)
