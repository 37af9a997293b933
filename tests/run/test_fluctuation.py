"""Targets whose RCS fluctuates: the samples of a frame have the statistics of their Swerling case, the rest stays."""

import numpy as np
import pytest
from support.scene_texts import ISOTROPIC, upright, walker

from raychan.run.clock import Clock
from raychan.run.fluctuation import drawn, fluctuated, of_target
from raychan.run.scene_channel import Channel, channel_of
from raychan.run.simulate import result_of, simulate
from raychan.run.target_links import target_links
from raychan.signal.baseband import synthesize
from raychan.units import db
from raychan.world.errors import SceneError
from raychan.world.scene import Scene

TEXT = ISOTROPIC + upright("sign", 20.0, 0.0)
MEAN_SQUARE = {0: 1.0, 1: 1.0, 2: np.pi / 4.0, 3: 1.0, 4: 9.0 * np.pi / 32.0}
"""Power of the mean amplitude over the mean power, of one draw a frame and of many."""


def scene_of(swerling: int, more: str = "") -> Scene:
    return Scene.from_text(TEXT + walker(8.0, 2.0) + f"swerling = {swerling}\n" + more)


@pytest.fixture(scope="module")
def channel() -> Channel:
    return channel_of(scene_of(0), None, None, Clock(None))


@pytest.mark.parametrize("swerling", [1, 2, 3, 4])
def test_only_the_targets_echo_fluctuates_and_has_the_mean_power_of_its_rcs(channel, swerling):
    scene, paths = scene_of(swerling), channel.launched.paths
    steady = channel.launched.quiet.samples
    body = [b.name for b in scene.bodies].index("walker")
    own = synthesize(
        paths.replace(amplitude=np.where(of_target(paths, body), paths.amplitude, 0.0)), scene.radar
    ).samples
    chirps, powers, means = scene.radar.waveform.n_chirps, [], []
    for seed in range(600):
        factors = drawn(scene, chirps, seed)
        cube, launched = fluctuated(channel.launched.quiet, channel.launched, factors)
        share = (cube.samples - (steady - own))[0, :, 3] / own[0, :, 3]
        assert np.allclose(share, factors[body], rtol=2e-3, atol=2e-3)
        assert (np.ptp(factors[body]) == 0.0) == (swerling in (1, 3))
        assert np.allclose(
            launched.paths.amplitude, paths.amplitude * np.where(of_target(paths, body), factors[body].mean(), 1.0)
        )
        powers.append((share.real**2).mean())
        means.append(share.real.mean() ** 2)
    assert np.mean(powers) == pytest.approx(1.0, abs=0.12)
    spread = (1.0 - MEAN_SQUARE[swerling]) / chirps if swerling in (2, 4) else 0.0
    assert np.mean(means) == pytest.approx(MEAN_SQUARE[swerling] + spread, abs=0.12)


def test_noise_and_all_else_are_byte_equal_and_seeds_repeat(channel):
    steady = result_of(scene_of(0), channel, 5, Clock(None))
    whole = simulate(scene_of(0), 5)
    assert steady.cube.samples.tobytes() == whole.cube.samples.tobytes()
    once, twice = (result_of(scene_of(1), channel, 5, Clock(None)) for _ in range(2))
    assert once.cube.samples.tobytes() == twice.cube.samples.tobytes()
    other = result_of(scene_of(1), channel, 6, Clock(None))
    assert not np.array_equal(once.paths.amplitude, other.paths.amplitude)


def test_a_target_more_leaves_the_draws_of_the_others_as_they_are():
    cart = walker(5.0, 0.0).replace("walker", "cart") + "swerling = 2\n"
    one, more = scene_of(2), Scene.from_text(TEXT + cart + walker(8.0, 2.0) + "swerling = 2\n")
    (alone,), beside = (list(drawn(s, 8, 3).values()) for s in (one, more))
    assert alone.tobytes() == beside[1].tobytes() != beside[0].tobytes()
    assert alone[:3] == pytest.approx([0.51325276, 0.48578192, 1.0595855]), "the same in every process"


def test_the_explanation_knows_how_strong_the_target_was_in_this_frame(channel):
    for seed in range(4):
        found = result_of(scene_of(1), channel, seed, Clock(None))
        for k, why in enumerate(found.provenance):
            if why.bodies == "walker":
                assert db(why.predicted / found.detections.power[k]) == pytest.approx(0.0, abs=1.0)


def test_the_link_budget_is_the_power_of_the_target_in_the_map(channel):
    result = result_of(scene_of(0), channel, 0, Clock(None))
    (link,) = target_links(scene_of(0))
    assert (link.name, link.range) == ("walker", pytest.approx(np.hypot(8.0, 2.0), abs=0.01))
    straight = np.abs(result.paths.amplitude[of_target(result.paths, 1)]).max() ** 2 * scene_of(0).radar.power
    assert link.snr == pytest.approx(db(straight / result.rdmap.noise), abs=0.01)
    assert link.probability == pytest.approx(1.0)
    assert target_links(scene_of(1))[0].probability < 1.0


def test_impossible_fluctuations_are_told():
    with pytest.raises(SceneError, match="only a given RCS fluctuates"):
        Scene.from_text(TEXT + "swerling = 1\n")
    with pytest.raises(SceneError, match="swerling"):
        scene_of(5)
    turning = scene_of(1, "turn_rate_dps = 300.0\n").override(["model.retrace=3"])
    with pytest.raises(SceneError, match="traced more than once"):
        simulate(turning, 0)


def test_a_fluctuating_target_is_written_and_read_again():
    text = scene_of(3).to_toml()
    assert "swerling = 3" in text and Scene.from_text(text).to_toml() == text
