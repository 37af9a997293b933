"""Scenes, bodies and materials made of values of another type are refused by the key, with what is allowed."""

import numpy as np
import pytest

import raychan as rc


def scene(**body):
    return rc.Scene([rc.Body(**({"name": "b", "shape": "box", "position": (9, 0, 0)} | body))])


@pytest.mark.parametrize(
    ("make", "said"),
    [
        *((lambda x=x: rc.Material(pec=x), f"pec: {x!r} is not possible; allowed: true or false") for x in ("no", 1)),
        *(
            (lambda key=key, x=x: rc.Material(**{key: x}), f"{key}: {x!r} is not possible; allowed: .*between|above")
            for key in ("eps_r", "sigma", "thickness", "roughness")
            for x in ("3", True, float("nan"))
        ),
        (lambda: rc.Material(name=3), "name: 3 is not possible; allowed: a text"),
        *(
            (lambda key=key: rc.Scene(**{key: 3}), f"^{key}: 3 is not possible; allowed: a table")
            for key in ("processing", "model", "atmosphere")
        ),
        (lambda: rc.Scene(model=0), "^model: 0 is not possible; allowed: a table"),
        (lambda: rc.Scene(radar=3), "^radar: 3 is not possible; allowed: a Radar, its table, or None"),
        (lambda: rc.Scene(atmosphere={"foo": 1}), "^atmosphere.foo: unknown key 'foo'"),
        (lambda: rc.Scene(model={"foo": 1}), "^model.foo: unknown key 'foo'"),
        (lambda: rc.Scene(processing={"foo": 1}), "^processing.foo: unknown key 'foo'"),
        (lambda: rc.Scene(radar={"foo": 1}), "^radar.foo: unknown key 'foo'"),
        *((lambda x=x: rc.Scene(title=x), r"^title: .* is not possible; allowed: a text") for x in (3, None, ["a"])),
        (lambda: rc.Scene(text=3), "^text: 3 is not possible; allowed: a text"),
        (lambda: rc.Scene(path=3), "^path: 3 is not possible; allowed: a Path, or None"),
        (lambda: rc.Scene(folder=3), "^folder: 3 is not possible; allowed: a Path, or None"),
        *(
            (
                lambda key=key, x=x: scene(**{key: x}),
                rf"^bodies\.b\.{key}: .* is not possible; allowed: 3 numbers",
            )
            for key in ("position", "velocity", "spin_dps")
            for x in (("5", 0, 0), [[5, 0, 0]], (True, 0, 0), 3)
        ),
        *(
            (lambda key=key, x=x: scene(**{key: x}), rf"^bodies\.b\.{key}: {x!r} is not possible; allowed: between")
            for key in ("yaw_deg", "turn_rate_dps")
            for x in ("30", True)
        ),
        (lambda: scene(rcs_dbsm=1.0, swerling=True), r"^bodies\.b\.swerling: True is not possible; allowed: 0, 1, 2"),
        (lambda: scene(material=""), r"^bodies\.b\.material: '' is not possible; allowed: a name or a Material"),
    ],
)
def test_a_value_of_another_type_is_told_by_its_key(make, said):
    with pytest.raises(rc.SceneError, match=said):
        make()


def test_scalars_of_numpy_lists_and_whole_floats_stay_allowed():
    assert rc.Material(eps_r=np.float32(3.0), sigma=1, pec=np.False_).kind is rc.Material(3.0, 1.0).kind
    given = {"position": np.array([9, 0, 0]), "velocity": [np.int8(1), 0, 0.0], "yaw_deg": np.float64(3)}
    (body,) = scene(**given, rcs_dbsm=1, swerling=1.0).bodies
    assert body.motion.velocity == (1.0, 0.0, 0.0) and body.fluctuates
