"""Levels at elements off the phase centre: waves spread over the distance to the element, not to the phase centre."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc
from raychan.units import db

WAVE = rc.Waveform(24e9, 2e9, 30e-6, n_chirps=16, n_samples=128)
CENTRE = np.array([0.0, 0.0, 1.0])
MODEL = {"max_bounces": 1, "tolerance_db": 0.1}


def found(body, **radar):
    radar = rc.Radar(WAVE, position=CENTRE, antenna=rc.IsotropicAntenna(), power=1.0, noise=False, **radar)
    detections = rc.simulate(rc.Scene(bodies=[body], radar=radar, model=MODEL), seed=1).detections
    # Nearer than half way is the line of sight to a receiver elsewhere.
    top = int(
        np.argmax(np.where(detections.range > 0.5 * np.linalg.norm(body.position - CENTRE), detections.power, 0.0))
    )
    return db(detections.power[top]), detections.error_db[top], detections.range[top]


@pytest.mark.parametrize("end", ["elements", "tx_elements"])
@pytest.mark.parametrize("seed", range(4))
def test_a_point_target_has_the_level_of_the_bistatic_radar_equation(end, seed):
    rng = np.random.default_rng(seed)
    place = CENTRE + rng.uniform(1.2, 4.0) * np.array([np.cos(a := rng.uniform(-0.9, 0.9)), np.sin(a), 0.0])
    element = np.array([0.0, rng.uniform(-0.3, 0.3), rng.uniform(-0.2, 0.2)])
    ways = np.linalg.norm(place - CENTRE), np.linalg.norm(place - CENTRE - element)
    body = rc.Body(name="t", shape="sphere", params={"radius": 0.004}, position=tuple(place), rcs_dbsm=-5.0)
    level, _, far = found(body, **{end: element[None]})
    lone, _, near = found(body)
    assert level - lone == pytest.approx(20.0 * np.log10(ways[0] / ways[1]), abs=0.02)
    assert far - near == pytest.approx(0.5 * (ways[1] - ways[0]), abs=2e-3)


@pytest.mark.parametrize("seed", range(3))
def test_an_element_sees_of_a_sphere_what_a_receiver_at_its_place_sees(seed):
    rng = np.random.default_rng(10 + seed)
    place, element = (rng.uniform(1.0, 2.0), rng.uniform(-0.7, 0.7), 1.1), rng.uniform(-0.2, 0.2, 3) * [0.0, 1.0, 1.0]
    body = rc.Body(name="b", shape="sphere", params={"radius": 0.1}, position=place)
    (level, error, _), (there, other, _) = (
        found(body, elements=element[None]),
        found(body, rx_position=CENTRE + element),
    )
    assert level == pytest.approx(there, abs=1.3 * (error + other) + 0.02)


def test_elements_wide_apart_see_of_a_plate_what_a_sum_over_its_points_says():
    middle, yaw, size, k = np.array([4.6, 0.0, 1.0]), np.radians(179.0), 0.14, 2.0 * np.pi * 77.01e9 / 299_792_458.0
    elements = np.array([[0.0, y, 0.0] for y in np.linspace(-0.25, 0.25, 7)])
    radar = rc.Radar(
        rc.Waveform(77e9, 20e6, 20e-6, n_chirps=16, n_samples=16),
        position=CENTRE,
        antenna=rc.IsotropicAntenna(),
        power=1e3,
        elements=elements,
    )
    shape = {"width": size, "height": size}
    plate = rc.Body(name="p", shape="plate", params=shape, position=tuple(middle), yaw_deg=np.degrees(yaw))
    model = {"max_bounces": 1, "tolerance_db": 0.5}
    result = rc.simulate(rc.Scene(bodies=[plate], radar=radar, model=model), seed=1)
    normal, along = np.array([np.cos(yaw), np.sin(yaw), 0.0]), np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    off = (np.arange(600) + 0.5) / 600 * size - 0.5 * size
    points = middle + off[:, None, None] * along + off[None, :, None] * np.array([0.0, 0.0, 1.0])
    away = np.linalg.norm(points - CENTRE, axis=2)
    lit = ((CENTRE - points) @ normal) / away**2 * np.exp(-1j * k * away)
    back = [np.linalg.norm(points - CENTRE - x, axis=2) for x in elements]
    truth = np.array([np.abs((lit * np.exp(-1j * k * b) / b).sum()) ** 2 for b in back])
    level = (np.abs(result.cube.samples.mean(axis=1)) ** 2).mean(axis=1)
    # The middle element stands at the phase centre, for which tubes are exact.
    assert db(level / level[3]) == pytest.approx(db(truth / truth[3]), abs=0.2)
    assert db(level.mean() / level[3]) == pytest.approx(db(truth.mean() / truth[3]), abs=0.05)
