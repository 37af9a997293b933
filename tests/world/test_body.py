"""A body's parameters stay as they were given."""

from __future__ import annotations

import copy
import math
import pickle
from dataclasses import replace

import numpy as np
import pytest
import trimesh

import raychan as rc
from raychan.world.meshes.mesh import make_mesh

WORD = "allowed: a text without dots, spaces and control characters"


def test_parameters_cannot_be_changed_in_a_made_body_but_in_a_new_one():
    body = rc.Body("ball", shape="sphere", params={"radius": 0.5})
    for change in (
        lambda: body.params.__setitem__("radius", 1.0),
        lambda: body.params.update(radius=1.0),
        lambda: body.params.pop("radius"),
    ):
        with pytest.raises(TypeError, match="read-only"):
            change()
    assert body.params == {"radius": 0.5}
    assert replace(body, params={"radius": 1.0}).geometry.bounds.max() == pytest.approx(1.0, abs=0.01)


def test_a_body_is_copied_pickled_and_compared_with_its_parameters():
    body = rc.Body("ball", shape="sphere", params={"radius": 0.5})
    for other in (copy.copy(body), copy.deepcopy(body), pickle.loads(pickle.dumps(body)), replace(body)):
        assert other == body and other.params == {"radius": 0.5}
    assert "radius = 0.5" in rc.Scene(bodies=[body]).to_toml()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"name": 3}, "bodies.0.name: 3 is not possible; allowed: a text"),
        ({"name": ""}, "bodies.0.name: '' is not possible; allowed: a text of at least 1 character"),
        ({"name": 101 * "a"}, r"bodies.0.name: .* is not possible; allowed: a text of at most 100 characters"),
        ({"name": "a.b"}, f"bodies.0.name: 'a.b' is not possible; {WORD}"),
        ({"name": "a > b"}, f"bodies.0.name: 'a > b' is not possible; {WORD}"),
        ({"name": "p\n"}, r"bodies.0.name: 'p\\n' is not possible; " + WORD),
        ({"params": [1]}, r"bodies.b.params: \[1\] is not possible; allowed: a table"),
        ({"material": 3}, "bodies.b.material: 3 is not possible; allowed: a name or a Material"),
        ({"materials": [3]}, r"bodies.b.materials: \[3\] is not possible; allowed: a table"),
        ({"materials": {"body": 3}}, "bodies.b.materials.body: 3 is not possible; allowed: a text"),
        ({"shape": 3}, "bodies.b.shape: 3 is not possible; allowed: a text"),
        ({"role": []}, r"bodies.b.role: \[\] is not possible; allowed: a text"),
        ({"unit": 3}, "bodies.b.unit: 3 is not possible; allowed: a text"),
        ({"scale": "a"}, "bodies.b.scale: 'a' is not possible; allowed: a number above 1e-09"),
        ({"rcs_dbsm": []}, r"bodies.b.rcs_dbsm: \[\] is not possible; allowed: 2 or more pairs .* or a number"),
        ({"rcs_dbsm": math.nan}, "bodies.b.rcs_dbsm: nan is not possible; allowed: a number between -100 and 100"),
        ({"rcs_dbsm": [(0, math.nan), (1, 2)]}, "bodies.b.rcs_dbsm.0.1: nan is not possible; allowed: a number"),
        ({"rcs_dbsm": 3.0, "rcs_point": (1, 2)}, "bodies.b.rcs_point: .* is not possible; allowed: 3 numbers"),
    ],
)
def test_a_scene_refuses_what_a_scene_file_could_not_hold_and_names_the_field(given, said):
    with pytest.raises(rc.SceneError, match=said):
        rc.Scene(bodies=[rc.Body(**({"name": "b", "shape": "box"} | given))])


def test_a_cross_section_may_be_a_number_or_a_table_of_numpy():
    one, table = (rc.Body("b", shape="box", rcs_dbsm=x) for x in (np.float32(10.0), np.array([[0, 10.0], [90, 10.0]])))
    assert len(rc.Scene(bodies=[one]).points().sigma) == 1
    np.testing.assert_allclose(one.target()[1], 10.0, rtol=1e-6)
    np.testing.assert_allclose(table.target()[1], 10.0, rtol=1e-12)


def test_a_part_whose_name_has_brackets_is_meant_by_its_name():
    sheet = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]]
    mesh = make_mesh(np.array(sheet), np.array([[0, 1, 2], [1, 3, 2]]), np.arange(2, dtype=np.int32), ("[red]x", "rx"))
    body = rc.Body("b", mesh=mesh, materials={"[red]x": "glass"})
    assert body.part_materials() == ["glass", "pec"]
    assert "parts rx is taken" in " ".join(body.notes())
    assert rc.Body("b", mesh=mesh, materials={"[r]*": "glass"}).part_materials() == ["pec", "glass"]


@pytest.mark.parametrize("angle", [float("nan"), -1.0, 400.0, "x", True, None])
@pytest.mark.parametrize("made", [{"shape": "box"}, {"mesh": trimesh.creation.box()}, {"mesh": "box.stl"}])
def test_a_crease_angle_that_is_none_is_refused_by_a_body_outside_a_scene(angle, made, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    trimesh.creation.box().export("box.stl")
    with pytest.raises(rc.SceneError, match=r"b\.crease_deg: .* allowed: a number between 0 and 180 deg"):
        _ = rc.Body("b", crease_deg=angle, **made).geometry
