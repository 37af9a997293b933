"""The gallery scenes: each shows what it is there for."""

import numpy as np
import pytest

import raychan as rc
from raychan.world.scene_files.bundled import found


def run(name, *changes):
    return rc.simulate(rc.Scene.load(found(name)).override(changes), seed=0)


def test_mimo_tells_two_spheres_apart_that_its_receivers_alone_do_not():
    seen = run("mimo")
    d = seen.detections
    assert {why.bodies for why in seen.provenance} == {"left", "right", "mover"}
    near = np.sort(np.degrees(d.azimuth[d.range < 20.0]))
    assert near == pytest.approx([-2.5, 2.5], abs=0.3)
    mover = int(np.argmax(d.range))
    assert (d.rate[mover], np.degrees(d.azimuth[mover])) == (
        pytest.approx(-18.0, abs=0.1),
        pytest.approx(20.0, abs=0.3),
    )
    alone = run("mimo", "radar.tx_elements_mm=[[0, 0, 0]]", "radar.multiplexing=none")
    assert (alone.detections.range < 20.0).sum() == 1


def test_interference_lifts_the_floor_of_the_map_and_leaves_the_targets():
    with_it, without = run("interference"), run("interference", "interferers.oncoming.power_dbm=-100")
    floors = [np.median(r.rdmap.power) for r in (with_it, without)]
    assert 10.0 * np.log10(floors[0] / floors[1]) > 3.0
    for r in (with_it, without):
        assert [why.bodies for why in r.provenance] == ["car", "pedestrian"]


def test_clutter_returns_at_the_rates_of_what_stands_still_and_the_pedestrian_stands_clear():
    seen = run("clutter")
    d, bodies = seen.detections, np.array([why.bodies for why in seen.provenance])
    assert (bodies == "pedestrian").sum() == 1 and (bodies == "ground").sum() > 10
    walking = d.rate[bodies == "pedestrian"]
    assert walking == pytest.approx([-11.4], abs=0.1)
    assert (d.rate[bodies == "ground"] > -10.2).all()  # own speed 10 m/s; a rate cell is 0.38 m/s
    assert [why.bodies for why in run("clutter", "model.diffuse=off").provenance] == ["pedestrian"]


def test_rain_takes_from_each_target_by_its_distance():
    wet, dry = (run("rain", f"atmosphere.rain_mmh={rate}") for rate in (50, 0))
    loss = -20.0 * np.log10(np.abs(wet.paths.amplitude) / np.abs(dry.paths.amplitude))
    assert loss / wet.paths.length * 1e3 == pytest.approx([17.9, 17.9], abs=0.3)  # dB/km, P.838-3 at 77 GHz, 50 mm/h
    assert (wet.detections.range > 99.0).sum() == 2
