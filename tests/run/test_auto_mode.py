"""Mode auto: a look tells which bounces, legs and levels detections need; none that the fixed model knows is lost."""

from __future__ import annotations

import numpy as np
import pytest
from bench.auto import agreement
from support.boxes_and_balls import WAVEFORM, scene_of

import raychan as rc
from raychan.run.refinement.map_cells import MapCells
from raychan.tracing.legs import legs_over
from raychan.tracing.lit_legs import lit_legs
from raychan.world.geometry import geometry_of

RADAR = {"waveform": WAVEFORM, "position": (0, 0, 0.6), "power_dbm": 20.0}


def both(bodies, **radar):
    """Return the results of a scene in mode auto and of the fixed model."""
    modes = "auto", "physical"
    return [rc.simulate(rc.Scene(bodies=bodies, radar={**RADAR, **radar}, model={"mode": m})) for m in modes]


@pytest.mark.parametrize("seed", [1, 3])
def test_detections_are_those_of_the_fixed_model_within_the_errors_stated(seed):
    ours, theirs = (rc.simulate(scene_of(seed, mode=mode)) for mode in ("auto", "physical"))
    found = agreement(ours, theirs, 0.5)
    assert found["both"] >= 3
    assert found["lost"] == 0
    assert found["beyond"] <= 1


def test_a_corner_that_only_three_bounces_see_is_kept():
    corner = rc.Body("corner", shape="trihedral", params={"size": 0.15}, position=(9.0, 0.0, 0.6), yaw_deg=180.0)
    ours, theirs = both([corner])
    assert ours.ledger["model"].bounces == 3
    assert len(theirs.detections.range) >= 1
    assert agreement(ours, theirs, 0.5) | {"beyond": 0, "lost": 0} == agreement(ours, theirs, 0.5)


def test_a_ghost_over_a_wall_is_kept():
    wall = rc.Body("wall", shape="box", params={"length": 14.0, "width": 0.3, "height": 2.5}, position=(9.0, 4.0, 0.0))
    ball = rc.Body("ball", shape="sphere", params={"radius": 0.5}, position=(8.0, 0.0, 0.6))
    ours, theirs = both([wall, ball])
    assert any(one.label == "multipath" for one in theirs.provenance)
    found = agreement(ours, theirs, 0.5)
    assert found["lost"] == 0 and found["beyond"] == 0


def test_bounces_below_any_detection_are_left_out_and_their_level_is_told():
    wall = rc.Body("wall", shape="box", params={"length": 14.0, "width": 0.3, "height": 2.5}, position=(9.0, 4.0, 0.0))
    ball = rc.Body("ball", shape="sphere", params={"radius": 0.5}, position=(8.0, 0.0, 0.6))
    ours, theirs = both([wall, ball], power_dbm=4.0)
    chosen = ours.ledger["model"]
    assert chosen.bounces < 3
    assert chosen.level_db < 0.0
    assert any("left out" in line and "dB" in line for line in chosen.why)
    assert len(theirs.detections.range) >= 1 and agreement(ours, theirs, 0.5)["lost"] == 0


@pytest.mark.parametrize("height", [0.5, 0.8, 1.1])
def test_the_stated_error_holds_what_the_bounces_left_out_would_bring(height):
    ball = rc.Body("ball", shape="sphere", params={"radius": 0.3}, position=(12.0, 0.0, height))
    bodies, asked = [rc.Body("ground", shape="ground"), ball], (("auto", 6.0), ("physical", 0.1))
    ours, theirs = (
        rc.simulate(rc.Scene(bodies=bodies, radar=RADAR, model={"mode": m, "tolerance_db": t})) for m, t in asked
    )
    found = agreement(ours, theirs, 6.0)
    assert found["both"] == len(theirs.detections.range) >= 2
    assert found["beyond"] == 0


def test_legs_over_a_mirror_behind_a_wall_are_not_lit_and_those_over_the_ground_are():
    size = {"length": 0.2, "width": 6.0, "height": 3.0}
    front = rc.Body("front", shape="box", params=size, position=(6.0, 0.0, 0.0))
    behind = rc.Body("behind", shape="box", params={**size, "width": 2.0, "height": 1.0}, position=(9.0, 0.0, 0.0))
    scene = rc.Scene(bodies=[rc.Body("ground", shape="ground"), front, behind], radar=RADAR)
    geometry = geometry_of(scene, 0.5)
    legs = legs_over(geometry, np.array(RADAR["position"], float), 2)
    lit = lit_legs(geometry, legs, 2)
    names = [[geometry.facets.body_names[m.body] for m in leg.mirrors] for leg in legs]
    assert lit[0] and lit[names.index(["ground"])] and lit[names.index(["front"])]
    assert any("behind" in name for name in names)
    assert not any(x for x, name in zip(lit, names, strict=True) if name[:1] == ["behind"])


def test_levels_below_detection_may_be_wrong_by_what_they_lack_and_others_by_the_tolerance():
    place = np.zeros((3, 3))
    cells = MapCells(place, np.array([0.1, 0.5, 2.0], complex), 0.5)
    strict = cells.allowed
    np.testing.assert_allclose(strict, 1.0 - 10.0 ** (-0.5 / 20.0))
    cells.spare(np.ones(3))
    assert cells.allowed[0] > cells.allowed[1] > strict[1]
    assert cells.allowed[2] == strict[2]
    assert (np.abs(cells.level[:2]) * (1.0 + cells.allowed[:2]) <= 1.0 + 1e-12).all()
    cells.level[0] = 1.5  # it has become a detection
    assert cells.allowed[0] == strict[0]


def test_a_cell_whose_sources_bring_nothing_any_more_keeps_its_changes():
    cells = MapCells(np.zeros((1, 3)), np.array([1.0 + 0.0j]), 0.5)
    source = np.array([5, 9], np.int64)
    cells.changed(0, source, np.array([0.2, 0.1j]))
    before = cells.doubt
    cells.changed(0, np.zeros(0, np.int64), np.zeros(0, complex))
    np.testing.assert_array_equal(cells.doubt, before)
