"""Spectrograms show each part of a body at the rate that its kinematics give, at the power of a map."""

import numpy as np
import pytest
from support.scene_texts import walker as target

from raychan.run.receiver import noise_of_cell
from raychan.run.simulate import simulate
from raychan.run.spectrogram import Spectrogram, spectrogram
from raychan.units import db
from raychan.world.errors import SceneError
from raychan.world.scene import Scene
from raychan.world.shapes.walker import Walker

RADAR = """
[radar]
position = [0.0, 0.0, 1.0]
power_dbm = 30.0
antenna = { kind = "isotropic", front = true }
[radar.waveform]
bandwidth_mhz = 75.0
chirp_us = 20.0
repetition_us = 150.0
chirps = 128
samples = 16
[model]
max_bounces = 1
tolerance_db = 3.0
"""
SPEED = 1.4
WALKER = '[[bodies]]\nname = "ped"\nshape = "walker"\nposition = [10.0, 0.0, 0.0]\nyaw_deg = 180.0\n'
WALKER += "params = { max_sag = 0.003, phase = 0.1 }\n"


@pytest.fixture(scope="module")
def walk() -> Spectrogram:
    """Return a swing of each leg of a walker who comes towards the radar."""
    return spectrogram(
        Scene.from_text(RADAR + WALKER).override(["radar.noise=false"]), 0.65, resolution=0.15, tracings_per_second=25.0
    )


def rates(limb: str, times: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the range rates (t, n) [m/s], seen from the radar, of points (n, 3) of a limb."""
    person, h, far = Walker(phase=0.1, max_sag=0.003), 1e-4, []
    for when in (times - h, times + h):
        turn, origin = person.poses(limb, when)
        place = np.einsum("tij,nj->tni", turn, points) + (origin + np.outer(when, [SPEED, 0.0, 0.0]))[:, None]
        # The person faces the radar, from 10 m; it stands 1 m high.
        far.append(np.linalg.norm(np.array([10.0, 0.0, -1.0]) + place * [-1.0, -1.0, 1.0], axis=2))
    return (far[1] - far[0]) / (2.0 * h)


def extremes(times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the least and the largest range rate [m/s] of any point of the feet and shanks."""
    meshes = Walker(phase=0.1, max_sag=0.003).meshes()
    found = [rates(limb, times, mesh.vertices) for limb, mesh in meshes.items() if limb[:4] in ("foot", "shan")]
    return np.min([r.min(axis=1) for r in found], axis=0), np.max([r.max(axis=1) for r in found], axis=0)


def test_the_ridge_is_the_trunk(walk):
    ridge = walk.rate[walk.power.argmax(axis=1)]
    trunk = rates("trunk", walk.time, np.zeros((1, 3)))[:, 0]
    assert np.median(np.abs(ridge - trunk)) < walk.resolution
    assert np.median(ridge) == pytest.approx(-SPEED, abs=walk.resolution)


def test_the_feet_set_the_envelope_as_the_kinematics_do(walk):
    """A window spreads an echo over one and a half resolution cells to each side, seen 45 dB below the trunk's peak."""
    fastest, slowest = extremes(walk.time)
    level = db(np.maximum(walk.power, 1e-30) / walk.power.max())
    seen = np.array([walk.rate[row > -45.0][[0, -1]] for row in level])
    swing = fastest < -3.0
    assert swing.sum() > 60
    assert np.median(np.abs(seen[swing, 0] - fastest[swing])) < walk.resolution
    assert seen[:, 0].min() == pytest.approx(fastest.min(), abs=1.5 * walk.resolution)
    assert seen[:, 1].max() == pytest.approx(slowest.max(), abs=1.5 * walk.resolution)
    assert np.corrcoef(seen[:, 0], fastest)[0, 1] > 0.95


def test_carrying_on_from_tracing_to_tracing_is_accurate(walk):
    assert walk.error_db < -20.0
    assert walk.tracings == 17


@pytest.mark.parametrize("rate", [-2.0, 0.0, 3.0])
def test_a_point_target_reads_its_power_and_its_rate(rate):
    text = RADAR + target(12.0, 0.0) + f"velocity_mps = [{rate}, 0.0, 0.0]\nrcs_point = [0.0, 0.0, 0.9]\n"
    quiet = Scene.from_text(text).override(["radar.noise=false"])
    found = spectrogram(quiet, 0.06, resolution=0.25, tracings_per_second=40.0)
    mapped = simulate(quiet)
    assert found.rate[found.power.argmax(axis=1)] == pytest.approx(
        np.full(len(found.time), rate), abs=found.resolution / 4
    )
    assert db(found.power.max(axis=1)) == pytest.approx(np.full(len(found.time), db(mapped.rdmap.power.max())), abs=2.0)


def test_noise_has_the_power_that_is_stated_and_seeds_repeat():
    empty = Scene.from_text(RADAR + target(900.0, 0.0))
    one, again, other = (spectrogram(empty, 0.2, ranges=(2.0, 20.0), seed=s, resolution=0.2) for s in (1, 1, 2))
    assert one.power.mean() == pytest.approx(one.noise, rel=0.05)
    assert one.power.tobytes() == again.power.tobytes() != other.power.tobytes()
    cells = round((one.ranges[1] - one.ranges[0]) / empty.radar.waveform.range_resolution) + 1
    chirps = 0.5 * 3e8 / empty.radar.waveform.middle / (0.2 * 150e-6)
    assert one.noise == pytest.approx(noise_of_cell(empty.radar, empty.processing) * cells * 128 / chirps, rel=0.02)


def test_what_cannot_be_is_told():
    scene = Scene.from_text(RADAR + WALKER)
    with pytest.raises(ValueError, match="duration"):
        spectrogram(scene, 0.0)
    with pytest.raises(ValueError, match="takes longer"):
        spectrogram(scene, 0.01, resolution=0.05)
    with pytest.raises(ValueError, match=r"between 0\.0975 m/s, a stretch of all 133 chirps, and 3\.24 m/s, one of 4"):
        spectrogram(scene, 0.02, resolution=5.0)
    with pytest.raises(ValueError, match="a stretch of 4 chirps, the shortest, takes longer"):
        spectrogram(scene, 4e-4, resolution=5.0)
    with pytest.raises(ValueError, match=r"ranges\[0\] = -1.0: must lie between 0 and"):
        spectrogram(scene, 0.2, ranges=(-1.0, 20.0))
    with pytest.raises(SceneError, match="targets are steady"):
        spectrogram(Scene.from_text(RADAR + target(12.0, 0.0) + "swerling = 1\n"), 0.2)
    with pytest.raises(ValueError, match="GB of memory"):
        spectrogram(scene.override(["radar.waveform.repetition_us=20.0", "radar.waveform.samples=4096"]), 600.0)
    with pytest.raises(ValueError, match="no range cell"):
        spectrogram(scene, 0.2, ranges=(500.0, 600.0))
