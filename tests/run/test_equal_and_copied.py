"""Records are compared by their numbers, results by identity; routes are copied and pickled."""

import copy
import pickle

import numpy as np
import pytest

import raychan as rc

RADAR = rc.Radar(rc.Waveform(77e9, 3e8, 3e-5, n_chirps=16, n_samples=64))
POST = rc.Body("post", shape="box", position=(9.0, 0.0, 0.0))


@pytest.fixture(scope="module")
def scene():
    return rc.Scene([POST], radar=RADAR, model={"tolerance_db": 3.0})


def test_equal_runs_give_equal_records_and_other_seeds_others(scene):
    one, same, other = rc.simulate(scene), rc.simulate(scene), rc.simulate(scene, seed=1)
    assert one == one and one != same and len({one, same}) == 2
    for name in ("paths", "profile", "cube", "rdmap", "detections", "error"):
        assert getattr(one, name) == getattr(same, name), name
    assert one.cube != other.cube and one.cube != one.rdmap
    assert one.detections.replace(rate=one.detections.rate + 1.0) != one.detections
    assert np.isnan(one.detections.azimuth).all()


def test_routes_are_copied_and_pickled(scene):
    routes = rc.trace(scene)
    sent = pickle.loads(pickle.dumps(routes))
    assert len(sent) == len(routes) > 0 and sent.stats.rays == routes.stats.rays
    assert rc.transfer(sent, RADAR) == rc.transfer(routes, RADAR)
    assert copy.deepcopy(routes) is routes and copy.copy(routes) is routes and routes == routes
