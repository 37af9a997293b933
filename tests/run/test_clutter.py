"""Clutter: sigma-nought of simulated ground is what was asked, its statistics those stated; hidden ground is silent."""

import numpy as np
import pytest
from scipy import special, stats

import raychan as rc
from raychan.channel.diffuse import diffuse_paths
from raychan.em.diffuse import Diffuse
from raychan.geometry.patches import Patches
from raychan.records import DIFFUSE
from raychan.run.clutter import clutter_of
from raychan.tracing.diffuse_patches import PatchSize, visible_patches
from raychan.units import C0
from raychan.world.geometry import geometry_of

FREQUENCY, HEIGHT = 77e9, 1.5
WAVE = rc.Waveform(carrier=FREQUENCY, bandwidth=500e6, chirp_duration=40e-6, n_chirps=16, n_samples=256)
FEW = rc.Processing(min_snr_db=60.0)
"""For runs of which only the samples are looked at: hardly any cell of clutter is a detection."""


def scene(law, bodies=(), **radar):
    road = rc.Material(eps_r=5.0, sigma=0.5, diffuse=law)
    plane = rc.Body(name="ground", shape="ground", material=road)
    made = rc.Radar(WAVE, (0.0, 0.0, HEIGHT), antenna=rc.IsotropicAntenna(), noise=False, **radar)
    return rc.Scene(bodies=[plane, *bodies], radar=made)


def drawn(made, seed=0):
    geometry = geometry_of(made)
    return clutter_of(geometry, made.radar, made.model, np.random.default_rng(seed))[0]


@pytest.mark.parametrize("law", [Diffuse("constant", -20.0), Diffuse("gamma", -12.0), Diffuse("lambert", -9.0)])
def test_mean_power_is_that_of_the_radar_equation_over_the_ground(law):
    paths = [drawn(scene(law), seed) for seed in range(20)]
    # From edge to edge of rings, so that no ring counts in part.
    rings = np.unique(paths[0].range.round(6))
    edges = 0.5 * (rings[1:] + rings[:-1])
    near, far = edges[np.searchsorted(edges, [5.0, 25.0])]
    power = [(np.abs(p.amplitude) ** 2)[(p.range > near) & (p.range < far)].sum() for p in paths]
    # dA = 2 pi R dR on a plane; the closed form by quadrature over the slant range.
    r = np.linspace(near, far, 200_001)
    sine = HEIGHT / r
    sigma = {"constant": 10**-2.0 + 0.0 * r, "gamma": 10**-1.2 * sine, "lambert": 4.0 * 10**-0.9 * sine**2}[law.law]
    asked = np.trapezoid((C0 / FREQUENCY) ** 2 / (4.0 * np.pi) ** 3 * sigma * 2.0 * np.pi / r**3, r)
    assert 10.0 * np.log10(np.mean(power) / asked) == pytest.approx(0.0, abs=0.1)


def test_the_samples_hold_the_power_that_was_asked_for():
    made = scene(Diffuse("constant", -15.0), processing=FEW)
    cubes = [rc.simulate(made, seed=seed, max_bounces=1).cube.samples[0] for seed in range(6)]
    power = np.mean([np.abs(np.fft.fft(x.mean(axis=0)) / WAVE.n_samples) ** 2 for x in cubes], axis=0)
    # Beat frequencies are negative: propagation is exp(-j 2 pi f tau).
    at = np.arange(WAVE.n_samples) * -1 % WAVE.n_samples * WAVE.range_resolution
    chosen = (at > 4.0) & (at < 20.0)
    r = np.linspace(4.0, 20.0, 100_001)
    asked = made.radar.power * (C0 / FREQUENCY) ** 2 / (4.0 * np.pi) ** 3 * 10**-1.5 * 2.0 * np.pi / r**3
    assert 10.0 * np.log10(power[chosen].sum() / np.trapezoid(asked, r)) == pytest.approx(0.0, abs=1.0)


def of_one_cell(law, count=4000):
    """Powers (count,) over their mean of a cell of 30 patches, drawn anew each time."""
    made = scene(law)
    geometry, rng = geometry_of(made), np.random.default_rng(5)
    angle = np.linspace(0.0, 0.05, 30)
    point = np.stack([12.0 * np.cos(angle), 12.0 * np.sin(angle), 0.0 * angle], axis=1)
    patches = Patches(point, np.zeros(30, np.int64), np.full(30, 0.01))
    facets, normal = geometry.facets, geometry.normal
    fields = [
        diffuse_paths(patches, facets, normal, made.radar, FREQUENCY, [law] * len(facets.materials.kind), rng)
        for _ in range(count)
    ]
    power = np.array([abs(p.amplitude.sum()) ** 2 for p in fields])
    return power / power.mean()


def test_a_cell_is_rayleigh():
    assert stats.kstest(of_one_cell(Diffuse("constant", -20.0)), "expon").pvalue > 0.01


def test_a_cell_within_one_texture_is_k_distributed():
    shape = 0.8
    power = of_one_cell(Diffuse("constant", -20.0, k_shape=shape, texture_m=100.0))

    def cdf(x):
        root = 2.0 * np.sqrt(shape * np.maximum(x, 1e-300))
        return 1.0 - 2.0 / special.gamma(shape) * (0.5 * root) ** shape * special.kv(shape, root)

    assert stats.kstest(power, cdf).pvalue > 0.01
    assert stats.kstest(power, "expon").pvalue < 1e-6


def test_ground_behind_a_wall_is_silent():
    wall = rc.Body(
        name="wall", shape="box", params={"length": 0.2, "width": 60.0, "height": 6.0}, position=(8.0, 0.0, 0.0)
    )
    open_field, walled = drawn(scene(Diffuse("gamma", -10.0))), drawn(scene(Diffuse("gamma", -10.0), [wall]))
    ahead = [
        (p.vertices[:, 1, 0] > 8.2) & (np.abs(p.vertices[:, 1, 1]) < 0.5 * p.vertices[:, 1, 0])
        for p in (open_field, walled)
    ]
    assert ahead[0].sum() > 100 and ahead[1].sum() == 0
    assert set(walled.bodies.ravel()) == {"ground"} and (walled.kind == DIFFUSE).all()


def test_a_moving_radar_sees_rates_by_the_angle():
    speed = 10.0
    paths = drawn(scene(Diffuse("gamma", -10.0), velocity=(speed, 0.0, 0.0)))
    np.testing.assert_allclose(paths.range_rate, -speed * paths.departure[:, 0], atol=1e-5)


def test_patches_of_a_wall_add_up_to_its_area():
    wall = rc.Body(
        name="wall",
        shape="box",
        params={"length": 0.2, "width": 4.0, "height": 2.0},
        position=(8.0, 0.0, 0.5),
        material=rc.Material(eps_r=5.0, diffuse=Diffuse("lambert", -10.0)),
    )
    made = scene(None, [wall])
    geometry = geometry_of(made)
    which = np.array([m is not None for m in geometry.facets.materials.diffuse])
    patches = visible_patches(geometry, np.array([0.0, 0.0, HEIGHT]), which, PatchSize(0.15, 0.03, 100.0, 0.1))
    assert patches.area.sum() == pytest.approx(8.0, rel=1e-12)
    np.testing.assert_allclose(patches.point[:, 0], 7.9, atol=1e-6)


def test_cross_polarised_clutter_is_as_far_below_as_asked():
    law = Diffuse("constant", -20.0, cross_db=10.0)
    co = drawn(scene(law))
    crossed = drawn(scene(law, rx_antenna=rc.IsotropicAntenna("H")))
    ratio = (np.abs(crossed.amplitude) ** 2).sum() / (np.abs(co.amplitude) ** 2).sum()
    assert 10.0 * np.log10(ratio) == pytest.approx(-10.0, abs=0.5)


def test_equal_seeds_give_equal_bytes_and_other_seeds_others():
    made = scene(Diffuse("gamma", -15.0), processing=FEW)
    one, same, other = (rc.simulate(made, seed=s, max_bounces=1).cube.samples for s in (1, 1, 2))
    assert one.tobytes() == same.tobytes() != other.tobytes()


def level_told(made, near):
    """Return the ledger's level of diffuse scattering, and that of the closed form in the cell at a range [m]."""
    result = rc.simulate(made, max_bounces=1)
    r = near + 0.5 * WAVE.range_resolution
    ring = 2.0 * np.pi * r * WAVE.range_resolution
    power = made.radar.power * (C0 / FREQUENCY) ** 2 / (4.0 * np.pi) ** 3 * 10**-2.0 * ring / r**4
    entry = result.ledger["diffuse scattering"]
    return entry, 10.0 * np.log10(power / result.detections.power.min())


def test_the_ledger_states_the_level_of_clutter_that_is_not_modelled_and_of_what_lies_beyond_the_unambiguous_range():
    sign = rc.Body(name="sign", shape="sphere", params={"radius": 0.2}, position=(9, 2, 1.5), rcs_dbsm=30.0)
    made = scene(Diffuse("constant", -20.0), [sign])
    off = rc.Scene(made.bodies, radar=made.radar, model={"diffuse": "off"})
    left, asked = level_told(off, HEIGHT)
    assert left.kind == "estimate" and "beyond" not in left.how
    assert left.level_db == pytest.approx(asked, abs=0.7)
    reach = WAVE.unambiguous_range
    beyond, asked = level_told(made, reach)
    assert f"beyond the unambiguous range of {reach:.4g} m" in beyond.how
    assert beyond.level_db == pytest.approx(asked, abs=0.7)


def test_explain_lists_the_patches_that_a_cell_of_clutter_adds_up_from():
    result = rc.simulate(scene(Diffuse("constant", -20.0)))
    row, column = np.unravel_index(np.argmax(result.rdmap.power), result.rdmap.power.shape)
    why = rc.explain(result, range=float(result.rdmap.range[column]), speed=float(result.rdmap.rate[row]), cell=True)
    assert abs(why.paths.wave.sum()) ** 2 == pytest.approx(result.rdmap.power[row, column], rel=2e-2)
    assert ("diffuse ground",) in why.paths.met


def test_of_two_chains_over_the_ground_explain_lists_the_level_of_the_one_that_a_cell_has():
    plate = rc.Body(name="plate", shape="plate", params={"width": 0.3, "height": 0.3}, position=(6.0, 0.0, 0.6))
    result = rc.simulate(scene(Diffuse("constant", -20.0), [plate]))
    row, column = np.unravel_index(np.argmax(result.rdmap.power[:, 20:]), result.rdmap.power[:, 20:].shape)
    at = float(result.rdmap.range[column + 20]), float(result.rdmap.rate[row])
    why = rc.explain(result, range=at[0], speed=at[1], cell=True)
    powers = [abs(why.paths.wave[why.paths.of(part)].sum()) ** 2 for part in why.contributions]
    shares = np.array([part.share for part in why.contributions])
    assert powers / np.sum(powers) * shares.sum() == pytest.approx(shares, rel=0.02)
