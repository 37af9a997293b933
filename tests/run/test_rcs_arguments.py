"""Arguments of `rcs` that cannot be are refused in words that name them."""

from fractions import Fraction

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
        *(
            ({"azimuth_deg": 0.0, name: x}, f"{name} = .*: a (whole )?number is wanted")
            for name in ("tolerance_db", "crease_deg", "distance", "rx_distance", "max_rays", "max_bounces")
            for x in (np.array([1, 2]), np.array([]))
        ),
        ({"azimuth_deg": 0.0, "tolerance_db": 10**400}, "tolerance_db = 1000.*: must lie between"),
        ({"azimuth_deg": 0.0, "polarization": np.array(["VV"])}, "polarization = array.*: must be one of VV, VH"),
        ({"azimuth_deg": 90.0, "distance": 0.1}, r"^distance = 0.1 m: the radar at .* is inside the mesh"),
        (
            {"azimuth_deg": 90.0, "distance": 1.0, "rx_distance": 0.1},
            r"^rx_distance = 0.1 m: the radar at .* is inside the mesh",
        ),
    ],
)
def test_what_cannot_be_is_refused(given, said):
    with pytest.raises(ValueError, match=said):
        rc.rcs(PLATE, 77e9, **given)


def test_scalars_of_numpy_and_fractions_are_numbers():
    given = {"azimuth_deg": 0.0, "max_bounces": np.array(1), "max_rays": np.array(100_000)}
    some = rc.rcs(PLATE, 10e9, distance=Fraction(5, 2), tolerance_db=Fraction(3), crease_deg=np.array(20.0), **given)
    assert some.sigma == rc.rcs(PLATE, 10e9, distance=2.5, tolerance_db=3.0, crease_deg=20.0, **given).sigma
    with pytest.raises(ValueError, match=r"frequency = array\(\[.*\]\): a number is wanted"):
        rc.rcs(PLATE, np.array([10e9, 20e9]), 0.0)


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
