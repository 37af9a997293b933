"""An echo over two spheres is found and has the level of geometrical optics, as many bounces as are modelled."""

from __future__ import annotations

import numpy as np
import pytest
from truth.optics import field_back, shortest_way, unit

import raychan as rc
from raychan.units import db

RADAR = {
    "position": [0, 0, 1],
    "power_dbm": 25,
    "waveform": {"bandwidth_mhz": 1000, "chirp_us": 30, "chirps": 32, "samples": 256},
}
CELL = 0.15  # m
END = np.array([0.0, 0.0, 1.0])


def spheres(seed):
    """Return two spheres beside each other in front of the radar."""
    rng = np.random.default_rng(seed)
    radius, x = rng.uniform(0.3, 1.5, 2), rng.uniform(5.0, 12.0, 2)
    y = rng.uniform(radius[0] + 0.3, 4.0), -rng.uniform(radius[1] + 0.3, 4.0)
    return [(np.array(c), float(r)) for *c, r in zip(x, y, rng.uniform(0.5, 1.5, 2), radius, strict=True)]


def seen_at(paths, rows, place):
    """Return the amplitude of some paths as a map cell at a range sees them: others fade out over two cells."""
    off = np.minimum(np.abs(0.5 * paths.length[rows] - place) / (2.0 * CELL), 1.0)
    return abs((paths.amplitude[rows] * np.cos(0.5 * np.pi * off) ** 2).sum())


# The first of 25 scenes whose echo is 20 dB or more above the noise.
@pytest.mark.parametrize(("seed", "bounces"), [(0, 3), (1, 2), (4, 3), (5, 2)])
def test_an_echo_over_two_spheres_has_the_level_of_geometrical_optics(seed, bounces):
    both = spheres(seed)
    bodies = [
        rc.Body(name=f"ball{i}", shape="sphere", params={"radius": r}, position=tuple(map(float, c)))
        for i, (c, r) in enumerate(both)
    ]
    scene = rc.Scene(bodies=bodies, radar=RADAR, model={"max_bounces": bounces})
    result = rc.simulate(scene, tolerance_db=0.5)
    first, length = shortest_way(END, both)
    (centre, radius), _ = both
    near, far = np.linalg.norm(centre - END) - radius, 0.5 * length
    errors = []
    for place in (near, far):
        row = np.argmin(np.abs(result.detections.range - place))
        assert abs(result.detections.range[row] - place) < 0.12
        errors.append(result.detections.error_db[row])
    # One sphere's echo comes one way, that of two both ways, in phase.
    wanted = 2.0 * field_back(END, unit(first - END), both) / field_back(END, unit(centre - END), both[:1])
    paths, met = result.paths, result.paths.trajectories
    count, body = (met.kind != 0).sum(axis=1)[paths.trajectory], met.body[paths.trajectory, 0]
    one = seen_at(paths, (count == 1) & (body == 0), near)
    two = seen_at(paths, count == 2, far)
    # How a cell sees paths off its middle is taken to 0.1 dB only.
    assert abs(db((two / one / wanted) ** 2)) < sum(errors) + 0.1


def echo_at(bodies, place, tolerance, bounces, **radar):
    """Return the SNR [dB] of what is detected at a range."""
    radar = {"position": [0, 0, 0.9], "waveform": {"bandwidth_mhz": 1000, "chirp_us": 40, "chirps": 16}} | radar
    radar["waveform"] |= {"carrier_ghz": radar.pop("carrier_ghz"), "samples": 256}
    found = rc.simulate(rc.Scene(bodies=bodies, radar=radar, model={"max_bounces": bounces}), tolerance_db=tolerance)
    row = np.argmin(np.abs(found.detections.range - place))
    assert abs(found.detections.range[row] - place) < 0.2
    return found.detections.snr[row]


# Found by a tester who knew the documentation only; levels are those of runs at 0.2 dB and of geometrical optics.
@pytest.mark.parametrize("tolerance", [0.5, 1.0, 3.0])
def test_an_echo_over_a_sphere_and_a_small_box_is_found_at_any_tolerance(tolerance):
    bodies = [
        rc.Body(name="ball", shape="sphere", params={"radius": 0.3295}, position=(4.166, 0.973, 1.024)),
        rc.Body(
            name="box",
            shape="box",
            params={"length": 0.348, "width": 0.148, "height": 0.248},
            position=(5.850, 2.173, 0.924),
            yaw_deg=-156.705,
        ),
    ]
    assert echo_at(bodies, 6.07, tolerance, 2, carrier_ghz=79, power_dbm=28.9) == pytest.approx(43.5, abs=3.0)


@pytest.mark.parametrize("tolerance", [0.5, 3.0])
@pytest.mark.parametrize(
    ("balls", "place", "snr", "bounces", "radar"),
    [
        (
            ((5.786, 2.322, 0.278, 0.205), (4.150, -0.892, 0.110, 0.297)),
            6.73,
            24.5,
            2,
            {"carrier_ghz": 77, "power_dbm": 35.4},
        ),
        (
            ((5.007, -0.907, 0.780, 0.26), (3.545, -0.632, 1.583, 0.511)),
            5.77,
            30.1,
            3,
            {"carrier_ghz": 24, "power_dbm": 40.3},
        ),
    ],
)
def test_weaker_echoes_over_two_spheres_are_found_at_any_tolerance(balls, place, snr, bounces, radar, tolerance):
    bodies = [
        rc.Body(name=f"ball{i}", shape="sphere", params={"radius": r}, position=tuple(at))
        for i, (*at, r) in enumerate(balls)
    ]
    assert echo_at(bodies, place, tolerance, bounces, **radar) == pytest.approx(snr, abs=3.0)
