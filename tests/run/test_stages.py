"""The public stages give the digits of `simulate`, and refuse what they were not made for."""

from dataclasses import replace

import numpy as np
import pytest

import raychan as rc
from raychan.tracing import solver

RADAR = {
    "position": [0.0, 0.0, 0.6],
    "waveform": {"bandwidth_mhz": 500.0, "chirp_us": 30.0, "chirps": 32, "samples": 64},
}


def street(**model):
    bodies = [
        rc.Body(name="ground", shape="ground", params={"size": 60.0}),
        rc.Body(name="wall", shape="wall", params={"length": 12.0}, position=(12, 5, 0)),
        rc.Body(name="car", shape="car", position=(9, 0, 0), velocity=(-3, 0, 0)),
        rc.Body(name="post", shape="box", params={"length": 0.2, "width": 0.2}, position=(6, -2, 0)),
        rc.Body(name="child", rcs_dbsm=-8.0, shape="box", params={"length": 0.3, "width": 0.3}, position=(11, -2, 0)),
    ]
    settings = {"max_bounces": 3, "tolerance_db": 3.0, "diffraction": True} | model
    return rc.Scene(bodies=bodies, radar=RADAR, model=settings)


def same(a, b):
    return all(
        np.array_equal(getattr(a, name), getattr(b, name), equal_nan=getattr(a, name).dtype.kind == "f")
        for name in a.__dataclass_fields__
        if isinstance(getattr(a, name), np.ndarray) and hasattr(b, name)
    )


@pytest.fixture(scope="module")
def scene():
    return street()


@pytest.fixture(scope="module")
def routes(scene):
    return rc.trace(scene)


def test_the_stages_one_after_the_other_give_the_digits_of_simulate(scene, routes):
    whole = rc.simulate(scene, seed=3)
    paths = rc.transfer(routes, scene.radar)
    cube = rc.synthesize(paths, scene.radar, seed=3)
    rdmap = rc.range_doppler(cube, scene.radar)
    found = rc.detect(rdmap, scene.radar)
    assert len(routes) > 100 and len(found.range) > 0
    for mine, theirs in (
        (paths, whole.paths), (cube, whole.cube), (rdmap, whole.rdmap), (found, whole.detections),
    ):  # fmt: skip
        assert same(mine, theirs), type(mine)


def test_the_check_launch_is_that_which_states_the_error(scene):
    silent = replace(scene.radar, noise=False)
    cubes = [rc.synthesize(rc.transfer(rc.trace(scene, check=c), scene.radar), silent) for c in (False, True)]
    apart = rc.range_doppler(replace(cubes[0], samples=cubes[0].samples - cubes[1].samples), scene.radar).power
    stated = rc.simulate(scene).error.power
    below = stated - apart
    # Beside it stands one figure for all cells: what no launch cuts.
    assert below == pytest.approx(np.median(below), rel=1e-3)


def test_polarisation_power_and_noise_are_swept_without_tracing_again(scene, routes):
    radar = replace(scene.radar, power=2.0 * scene.radar.power, noise_figure_db=scene.radar.noise_figure_db + 6.0)
    again = rc.simulate(scene)
    paths = rc.transfer(routes, radar)
    assert np.array_equal(paths.amplitude, again.paths.amplitude)
    cube = rc.synthesize(paths, replace(radar, noise=False))
    once = rc.synthesize(paths, replace(scene.radar, noise=False))
    assert cube.samples == pytest.approx(np.sqrt(2.0) * once.samples, rel=1e-5)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (lambda r: {"position": np.asarray(r.position) + np.array((0.0, 0.001, 0.0))}, "position"),
        (lambda r: {"waveform": replace(r.waveform, carrier=r.waveform.carrier * 1.001)}, "carrier"),
        (lambda r: {"waveform": replace(r.waveform, bandwidth=2.0 * r.waveform.bandwidth)}, "bandwidth"),
        (lambda r: {"noise": False}, "noise"),
    ],
    ids=lambda x: x if isinstance(x, str) else "",
)
def test_a_radar_that_the_routes_were_not_traced_for_is_refused(scene, routes, change, word):
    with pytest.raises(ValueError, match=f"do not serve this radar: its .*{word}"):
        rc.transfer(routes, replace(scene.radar, **change(scene.radar)))


def test_a_radar_that_looks_elsewhere_is_refused(scene):
    radar = RADAR | {"antenna": {"kind": "array", "ny": 8, "nz": 2}}
    narrow = rc.Scene(bodies=scene.bodies, radar=radar, model={"max_bounces": 1, "tolerance_db": 6.0})
    routes = rc.trace(narrow)
    assert len(rc.transfer(routes, narrow.radar).length) > 0
    with pytest.raises(ValueError, match="do not serve this radar: its antennas"):
        rc.transfer(routes, replace(narrow.radar, yaw_deg=30.0))


def test_what_a_leg_keeps_does_not_depend_on_the_order_of_the_others(scene, monkeypatch):
    def kept(order):
        legs_over = solver.legs_over

        def turned(*args):
            direct, *others = legs_over(*args)
            return [direct, *others[::order]]

        # Legs are traced in the order in which they are found; none can be chosen.
        with monkeypatch.context() as patch:
            patch.setattr(solver, "legs_over", turned)
            found = rc.trace(scene)
        lengths = np.concatenate([b.length for b in found.batches if hasattr(b, "length")])
        return np.sort(lengths)

    one, other = kept(1), kept(-1)
    assert len(one) == len(other) > 100
    assert np.array_equal(one, other)


def test_routes_tell_of_themselves(routes):
    assert "routes in" in repr(routes) and "rays" in repr(routes)
