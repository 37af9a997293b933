"""What a body, a scene or an antenna is given stays the caller's: its later change changes nothing made of it."""

import copy

import numpy as np
import pytest
import trimesh

import raychan as rc


def test_a_body_does_not_follow_the_arrays_and_lists_it_was_given():
    given = {
        "position": np.array([15.0, 0.0, 0.5]),
        "velocity": [1.0, 0.0, 0.0],
        "spin_dps": np.zeros(3),
        "rcs_dbsm": [[0.0, 10.0], (180.0, 20.0)],
        "rcs_point": np.zeros(3),
        "params": {"outline": [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], "height": 2.0},
        "materials": {"*": "brick"},
    }
    as_given = copy.deepcopy(given)
    body, other = rc.Body("b", shape="prism", **given), rc.Body("b", shape="prism", **as_given)
    scene = rc.Scene([body])
    given["position"][:] = np.nan
    given["velocity"][0] = -5.0
    given["spin_dps"][2] = 90.0
    given["rcs_dbsm"][0][1] = given["rcs_dbsm"][1] = (90.0, 30.0)
    given["rcs_point"][:] = 1.0
    given["params"]["outline"][1][0] = 9.0
    given["materials"]["*"] = "wood"
    assert body == other and scene.bodies[0] == other
    assert body.position == (15.0, 0.0, 0.5) and body.rcs_dbsm == ((0.0, 10.0), (180.0, 20.0))
    with pytest.raises(TypeError, match="read-only"):
        body.materials["*"] = "wood"


def test_bodies_made_with_one_array_stand_where_it_said_each_time():
    place, bodies = np.array([10.0, 0.0, 0.5]), []
    for k in range(3):
        bodies.append(rc.Body(f"b{k}", shape="box", position=place))
        place += [5.0, 0.0, 0.0]
    assert [b.motion.position[0] for b in bodies] == [10.0, 15.0, 20.0]


def test_a_body_does_not_follow_a_mesh_in_memory():
    mesh = trimesh.creation.box()
    body = rc.Body("b", mesh=mesh, velocity=(1.0, 0.0, 0.0))
    mesh.apply_translation([5.0, 0.0, 0.0])
    assert body.geometry.bounds[1, 0] == pytest.approx(0.5)
    later = body.at(2.0)
    assert later.mesh is body.mesh and later.geometry is body.geometry and later.position == (2.0, 0.0, 0.0)


def test_a_scene_of_tables_does_not_follow_them():
    data = {"bodies": [{"name": "b", "shape": "box", "position": [9.0, 0.0, 0.0]}]}
    scene = rc.Scene.from_dict(data)
    data["bodies"][0]["position"][0] = 30.0
    assert scene.override(["bodies.b.yaw_deg=5"]).bodies[0].position == (9.0, 0.0, 0.0)


def test_a_measured_antenna_keeps_its_pattern():
    gain = np.zeros((2, 2))
    antenna = rc.MeasuredAntenna([-1.0, 1.0], [-1.0, 1.0], gain, np.zeros((2, 2)))
    gain[:] = 60.0
    assert (antenna.gain_db == 0.0).all()
    with pytest.raises(ValueError, match="read-only"):
        antenna.gain_db[:] = 60.0
