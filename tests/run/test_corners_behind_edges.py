"""Corner reflectors that an edge hides in part: faces that return nothing alone carry what the corner returns."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc

_SEEN_BY_THEIR_CENTRES = ((0.2033, 10.88154, 184.036, 4.93492, 0.2972), (0.25, 11.0, 178.0, 5.5, 0.31))


def levels(size, x, yaw, at, edge, tolerance_db):
    """Power [dBm] and stated error [dB] of the detection of a trihedral behind the edge of a plate; NaN for none."""
    wave = rc.Waveform(carrier=77e9, bandwidth=500e6, chirp_duration=40e-6, n_chirps=16, n_samples=256)
    corner = rc.Body(name="corner", shape="trihedral", params={"size": size}, position=(x, 0.0, 0.35), yaw_deg=yaw)
    plate = {"width": 0.6, "height": 0.8}
    before = rc.Body(name="plate", shape="plate", params=plate, position=(at, edge, 0.5), yaw_deg=195.0)
    model = {"max_bounces": 3, "tolerance_db": tolerance_db}
    found = rc.simulate(rc.Scene(bodies=[corner, before], radar=rc.Radar(waveform=wave), model=model)).detections
    own = np.flatnonzero(np.abs(found.range - x) < 0.5)
    return (10.0 * np.log10(1e3 * found.power[own[0]]), found.error_db[own[0]]) if len(own) else (np.nan, np.nan)


@pytest.mark.parametrize("case", _SEEN_BY_THEIR_CENTRES)
@pytest.mark.parametrize("tolerance", [3.0, 1.0, 0.5])
def test_a_corner_behind_an_edge_is_as_a_finer_run_has_it(case, tolerance):
    """A face whose centre the edge hides was lost as a whole: a third of the corner's six ways, 3 dB."""
    found, stated = levels(*case, tolerance)
    finer, least = levels(*case, 0.03)
    assert abs(found - finer) <= stated + least and stated <= tolerance


def test_random_corners_behind_edges_lie_within_the_stated_error():
    rng, beyond, seen = np.random.default_rng(77), 0, 0
    for _ in range(20):
        x, share = rng.uniform(8.0, 14.0), rng.uniform(0.35, 0.7)
        case = rng.uniform(0.15, 0.3), x, 180.0 + 10.0 * rng.normal(), share * x, 0.3 + share * rng.uniform(-0.08, 0.08)
        found, stated = levels(*case, 1.0)
        finer, least = levels(*case, 0.1)
        if np.isfinite(finer):
            seen += 1
            beyond += not abs(found - finer) <= stated + least + 0.02
    assert seen >= 10 and beyond <= 1
