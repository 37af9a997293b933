"""A body's parameters stay as they were given."""

from __future__ import annotations

import copy
import pickle
from dataclasses import replace

import pytest

import raychan as rc


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
