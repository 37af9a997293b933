"""Arguments of `rcs` that cannot be are refused in words that name them."""

import numpy as np
import pytest
import trimesh

import raychan as rc

PLATE = trimesh.creation.box((0.01, 0.3, 0.3))


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"azimuth_deg": []}, r"azimuth_deg = \[\]: finite numbers of degrees are wanted, one at least"),
        ({"azimuth_deg": [0.0, np.nan]}, r"azimuth_deg = \[0.0, nan\]: finite numbers of degrees are wanted"),
        (
            {"azimuth_deg": [0.0, 1.0, 2.0], "elevation_deg": [0.0, 1.0]},
            r"angles of shapes \(3,\), \(2,\): must be of one shape",
        ),
        ({"azimuth_deg": "3"}, "azimuth_deg = '3': numbers are wanted"),
        ({"azimuth_deg": True}, "azimuth_deg = True: numbers are wanted"),
        ({"azimuth_deg": 0.0, "rx_elevation_deg": "x"}, "rx_elevation_deg = 'x': numbers are wanted"),
        ({"azimuth_deg": 0.0, "rx_distance": "3"}, "rx_distance = '3': a number is wanted"),
        ({"azimuth_deg": 0.0, "rx_distance": 3.0}, "rx_distance = 3.0 m: must be inf where distance is"),
        ({"azimuth_deg": 0.0, "distance": None}, "distance = None: a number is wanted"),
        ({"azimuth_deg": 0.0, "polarization": None}, "polarization = None: must be one of VV, VH, HV, HH"),
        *(
            ({"azimuth_deg": 0.0, "material": x}, f"material = {x}: a text or a Material is wanted")
            for x in (None, 3, True)
        ),
        ({"azimuth_deg": 0.0, "simplify": "no"}, "simplify = 'no': must be true or false"),
        ({"azimuth_deg": 0.0, "max_rays": 0}, "max_rays"),
        ({"azimuth_deg": 0.0, "max_rays": 10.5}, "max_rays"),
    ],
)
def test_what_cannot_be_is_refused(given, said):
    with pytest.raises(ValueError, match=said):
        rc.rcs(PLATE, 77e9, **given)


def test_infinity_of_numpy_is_far():
    far = rc.rcs(PLATE, 10e9, 0, distance=np.float32(np.inf), rx_distance=np.inf, tolerance_db=3, max_bounces=1)
    assert far.sigma.shape == () and far.sigma > 0.0


@pytest.mark.parametrize("given", [rc.Body(name="plate", mesh=PLATE), np.zeros((3, 3))])
def test_what_is_no_mesh_is_refused_by_what_it_is(given):
    with pytest.raises(rc.SceneError, match=f"{type(given).__name__} is no mesh; allowed: a file, Mesh, trimesh"):
        rc.rcs(given, 77e9, 0.0)


def test_a_plate_seen_edge_on_returns_nothing_and_not_what_rounding_leaves():
    plate = rc.Body(name="plate", shape="plate", params={"width": 0.2, "height": 0.1}).geometry
    found = rc.rcs(plate, 77e9, [89.0, 90.0])
    assert found.sigma[0] > 0.0 and np.isfinite(found.error_db[0])
    assert found.sigma[1] == 0.0 and np.isnan(found.error_db[1])
