"""Without noise the level of a detection is that of its paths, where an array tells several directions apart in a cell
and where an echo peaks between map cells."""

import h5py
import numpy as np
import pytest

import raychan as rc
from raychan.cli import invoke

WAVE = rc.Waveform(
    carrier=77e9, bandwidth=150e6, chirp_duration=30e-6, repetition=40e-6, n_chirps=32, n_samples=64
)  # fmt: skip


def seen(count, seed, elements=4):
    """Return a run of points within a cell, in random directions, before a line of elements half a wavelength apart."""
    rng, bodies = np.random.default_rng(seed + 1000 * count), []
    middle = rng.uniform(8.0, 20.0)
    for k in range(count):
        azimuth, away = rng.uniform(-0.7, 0.7), middle + rng.uniform(-0.2, 0.2)
        place = away * np.cos(azimuth), away * np.sin(azimuth), 1.0
        size = {"radius": 0.01, "max_sag": 0.001}
        level = rng.uniform(7.0, 10.0)
        bodies.append(rc.Body(name=f"p{k}", shape="sphere", params=size, position=place, rcs_dbsm=level))
    array = {"elements": rc.uniform_array(elements, 0.5 * WAVE.wavelength)} if elements > 1 else {}
    radar = rc.Radar(WAVE, position=(0, 0, 1), power=1.0, noise=False, **array)
    return rc.simulate(rc.Scene(bodies=bodies, radar=radar, model={"max_bounces": 1}), seed=seed)


def off(result):
    """Return by how much (n,) [dB] the sums of the paths of detections are off their levels."""
    sums = np.array([why.predicted for why in result.provenance])
    return 10.0 * np.log10(sums / result.detections.power)


@pytest.mark.parametrize("count", [2, 3])
def test_the_paths_add_up_to_the_level_of_each_of_several_directions_in_a_cell(count):
    results = [seen(count, seed) for seed in range(6)]
    strong = [x for r in results for x in off(r)[r.detections.power > 1e-2 * r.detections.power[0]]]
    assert len(strong) > 6
    assert np.abs(strong).max() < 0.01


def test_the_paths_of_a_lone_echo_between_cells_add_up_to_its_peak():
    assert max(np.abs(off(seen(1, seed, elements=1))).max() for seed in range(6)) < 0.01


def test_explanations_from_a_file_have_the_waves_of_the_beam(tmp_path):
    made = seen(2, 13)
    assert made.detections.beam.shape == (len(made.detections.range), 4)
    rc.save_result(made, tmp_path / "out")
    for k, why in enumerate(made.provenance):
        told = rc.explain(tmp_path / "out", detection=k + 1)
        assert told.beam and abs(told.paths.wave.sum()) ** 2 == pytest.approx(why.predicted, rel=1e-3)


def test_levels_at_the_middle_of_the_array_are_said_to_be_such(tmp_path, capsys):
    rc.save_result(seen(2, 13), tmp_path / "out")
    with h5py.File(tmp_path / "out" / "result.nc", "a") as held:
        del held["beams"]
    assert invoke(["explain", str(tmp_path / "out"), "--detection", "1"]) == 0
    assert "levels of paths are those at the middle of the array" in capsys.readouterr().out


def folded(multiplexing, azimuths, rate):
    """Return by how much (n,) [dB] paths are off the levels of echoes of two points in a cell, one folded once more."""
    wave = rc.Waveform(77e9, 300e6, 20e-6, repetition=25e-6, n_chirps=96, n_samples=128)
    lines = [[(0.0, k * step * wave.wavelength, 0.0) for k in range(n)] for n, step in ((3, 2.0), (4, 0.5))]
    radar = rc.Radar(
        wave, position=(0.0, 0.0, 1.0), power=1.0, noise=False, elements=lines[1], tx_elements=lines[0],
        multiplexing=multiplexing, antenna=rc.IsotropicAntenna(),
    )  # fmt: skip
    bodies = []
    for k, (azimuth, rcs) in enumerate(zip(np.radians(azimuths), (10.0, 6.0), strict=True)):
        way = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        velocity = (rate + k * wave.wavelength / (2.0 * radar.slots * wave.repetition)) * way
        point = {"radius": 0.01}, tuple(11.0 * way + (0.0, 0.0, 1.0)), velocity
        bodies.append(
            rc.Body(f"t{k}", shape="sphere", params=point[0], position=point[1], velocity=point[2], rcs_dbsm=rcs)
        )
    result = rc.simulate(rc.Scene(bodies=bodies, radar=radar, model={"max_bounces": 1}))
    return off(result)[[why.label == "direct" for why in result.provenance]]


@pytest.mark.parametrize("multiplexing", ["tdm", "ddm"])
def test_echoes_of_one_cell_and_other_folds_have_the_levels_of_their_paths(multiplexing):
    cases = (
        ((-15.0, -23.0), 3.62),
        ((23.0, -11.0), 3.31),
        ((0.6, 6.2), 5.71),
        ((-17.0, 1.0), 3.94),
        ((5.0, -30.0), -2.0),
    )
    away = np.abs(np.concatenate([folded(multiplexing, *case) for case in cases]))
    assert len(away) >= 6 and away.max() < 0.1


@pytest.mark.parametrize("multiplexing", ["tdm", "ddm"])
def test_mirror_images_of_real_sampling_have_the_levels_of_their_paths_and_are_said_to_be_such(multiplexing):
    wave = rc.Waveform(77e9, 300e6, 20e-6, repetition=25e-6, n_chirps=96, n_samples=64, complex_sampling=False)
    lines = [[(0.0, k * step * wave.wavelength, 0.0) for k in range(n)] for n, step in ((2, 2.0), (4, 0.5))]
    radar = rc.Radar(
        wave, position=(0.0, 0.0, 1.0), power=1.0, noise=False, elements=lines[1], tx_elements=lines[0],
        multiplexing=multiplexing, antenna=rc.IsotropicAntenna(),
    )  # fmt: skip
    way = np.array([np.cos(0.4), -np.sin(0.4), 0.0])
    body = rc.Body(
        "t", shape="sphere", params={"radius": 0.01}, position=tuple(20.2 * way + (0.0, 0.0, 1.0)),
        velocity=tuple(-4.3 * way), rcs_dbsm=10.0,
    )  # fmt: skip
    result = rc.simulate(rc.Scene(bodies=[body], radar=radar, model={"max_bounces": 1}))
    assert np.abs(off(result)).max() < 0.5
    assert any("mirrored" in line for line in result.warnings)
