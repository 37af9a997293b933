"""Speckle: levels of several echoes in one cell move with their bodies as their phasors do, others stay."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import raychan as rc
from raychan.records import MIRROR, REFLECT, SCATTER
from raychan.run.explanation.point_spread import PointSpread
from raychan.run.refinement.scene_refinement import SceneRefinement
from raychan.run.refinement.speckle import SHIFT, TURN, slopes_of, spreads_db
from raychan.tracing.stats import Stats
from raychan.units import C0, db
from raychan.world.geometry import geometry_of

WAVE = {"bandwidth_mhz": 500.0, "chirp_us": 30.0, "chirps": 16, "samples": 128}
RADAR = {"position": [0, 0, 0], "antenna": {"kind": "isotropic"}, "power_dbm": 50.0, "waveform": WAVE}
LAMBDA = C0 / (77e9 + 250e6)  # a cell's phase is that at the middle of the ramp
DRAWS = 20


def scene(*bodies, bounces=1, tolerance_db=0.5):
    model = {"max_bounces": bounces, "tolerance_db": tolerance_db, "speckle": True}
    return rc.Scene(bodies=list(bodies), radar=RADAR, model=model)


def launched(*bodies, bounces=1):
    """Return what `spreads_db` takes, of the first launch over a scene, or over one of some bodies."""
    of = bodies[0] if isinstance(bodies[0], rc.Scene) else scene(*bodies, bounces=bounces)
    given, batches, wave = (geometry_of(of), of.points(0.0), of.radar, of.processing), [], of.radar.channel_waveform
    refinement = SceneRefinement(*given, of.model, lambda *_: None, Stats(), batches)
    paths = refinement.first().paths
    response = PointSpread(wave, of.processing.range_window, of.processing.rate_window)
    place = refinement._cells(replace(of.radar, noise=False), response, paths).place
    named = {"geometry": given[0], "radar": of.radar, "response": response}
    return {"paths": paths, "batches": batches[0], "cells": place, "noise": refinement._noise} | named


def strongest(given):
    """Return the spread [dB] of the strongest cell."""
    at = int(np.argmax(given["cells"][:, 2]))
    return spreads_db(**given | {"cells": given["cells"][at : at + 1]})[0]


def draws(given, name):
    """Return turns (k, 3) [rad] and shifts (k, 3) [m] of a body."""
    names, rng = given["geometry"].facets.body_names, np.random.default_rng(0)
    turn, shift = (rng.standard_normal((DRAWS, len(names), 3))[:, names.index(name)] for _ in range(2))
    return TURN * turn, SHIFT * shift


def ball(name, *place):
    return rc.Body(name=name, shape="sphere", params={"radius": 0.3}, position=place)


def test_two_equal_echoes_move_as_two_phasors():
    given = launched(ball("one", 12, 0.8, 0), ball("two", 12, -0.8, 0))
    ranges = [
        np.linalg.norm(np.array([12.0, side, 0.0]) + draws(given, name)[1], axis=1)
        for name, side in (("one", 0.8), ("two", -0.8))
    ]
    asked = np.std(db(np.abs(1.0 + np.exp(-4j * np.pi / LAMBDA * (ranges[0] - ranges[1]))) ** 2))
    assert asked > 3.0 and strongest(given) == pytest.approx(asked, rel=0.03)


def test_a_lone_sphere_does_not_move():
    assert strongest(launched(ball("one", 12, 0.8, 0))) < 0.02


def test_a_plate_at_normal_incidence_moves_by_the_sinc_of_its_turns():
    width, height = 0.5, 0.3
    size = {"width": width, "height": height}
    given = launched(rc.Body(name="plate", shape="plate", params=size, position=(150, 0, 0), yaw_deg=180.0))
    turn, _ = draws(given, "plate")
    far = np.sinc(2.0 * width * np.sin(turn[:, 2]) / LAMBDA) * np.sinc(2.0 * height * np.sin(turn[:, 1]) / LAMBDA)
    assert strongest(given) == pytest.approx(np.std(db(far**2)), rel=0.05)


FACE_ON = """
[radar.waveform]
bandwidth_mhz = 500.0
chirp_us = 40.0
chirps = 32
samples = 128
[model]
max_bounces = 1
tolerance_db = 0.5
speckle = true
[[bodies]]
name = "it"
shape = "suv"
position = [{}, {}, 0.0]
yaw_deg = {}
"""


@pytest.mark.parametrize(
    ("x", "y", "yaw"),
    [
        (10.168669365657005, 1.1361122799831707, 181.82434739249885),
        (12.918070746409654, 0.7567150769534114, 186.7912696021885),
        (19.406207387976004, -1.1537989485679514, -6.9086516887462555),
    ],
)
def test_vehicles_seen_face_on_stay_as_the_place_that_mirrors_slides_over_them(tmp_path, x, y, yaw):
    """While footprints kept their own sums and only turned, these moved by 0.66 to 1.04 dB, and the run said so."""
    (tmp_path / "it.toml").write_text(FACE_ON.format(x, y, yaw))
    assert strongest(launched(rc.Scene.load(tmp_path / "it.toml"))) < 0.2


def test_mirrors_stay():
    given = launched(ball("one", 12, 0.8, 0), ball("two", 12, -0.8, 0))
    facets, extents = given["geometry"].facets, given["geometry"].extents
    still = SimpleNamespace(facets=facets.replace(role=np.full_like(facets.role, MIRROR)), extents=extents)
    assert strongest(given | {"geometry": still}) < 1e-9


def test_lengths_change_as_over_the_images_of_displaced_mirrors():
    wall = rc.Body(
        name="wall", shape="plate", params={"width": 6.0, "height": 3.0}, position=(6.0, 4.0, 0.0), yaw_deg=-90.0
    )
    plate = rc.Body(
        name="plate", shape="plate", params={"width": 0.4, "height": 0.4}, position=(12, 0, 0.2), yaw_deg=161.0
    )
    given = launched(wall, plate, bounces=2)
    geometry = given["geometry"]
    middle, names = geometry.extents.mean(axis=1), geometry.facets.body_names
    turn, shift = 1e-4 * np.random.default_rng(1).standard_normal((2, len(names), 3))

    def moved(points, body):
        return points + shift[body] + np.cross(turn[body], points - middle[body])

    compared, a, b = 0, names.index("wall"), names.index("plate")
    for batch in given["batches"]:
        if batch.kind.shape[1] < 2:
            continue
        by_way = batch.kind[:, :2] == (REFLECT, SCATTER), batch.kind[:, :2] == (SCATTER, REFLECT)
        for inward, kinds in zip((True, False), by_way, strict=False):
            first, last = (a, b) if inward else (b, a)
            rows = np.flatnonzero(kinds.all(axis=1) & (batch.body[:, 0] == first) & (batch.body[:, 1] == last))
            if not len(rows):
                continue
            longer = sum(s.longer(turn, shift) for s in slopes_of(batch, middle))[rows]
            corner, at = batch.points[rows], moved(batch.vertices[rows, 0 if inward else 1], a)[:, None]
            normal = batch.normals[rows, 0 if inward else 1]
            normal = (normal + np.cross(turn[a], normal))[:, None]
            there, end = moved(corner, b), np.zeros(3)
            image = end - 2.0 * ((end - at) * normal).sum(axis=2, keepdims=True) * normal / (normal**2).sum(
                axis=2, keepdims=True
            )
            asked = np.linalg.norm(there - image, axis=2) + np.linalg.norm(there - end, axis=2) - batch.lengths[rows]
            assert longer[:, :6] == pytest.approx(asked, abs=2e-3 * np.abs(asked).max())
            compared += len(rows)
    assert compared > 10


def post(speckle):
    """Return a run over a lamp post, of which pole, base and arm share a cell."""
    of = rc.Body(name="post", shape="lamp_post", position=(11.0, 0.7, 0.0), yaw_deg=160.0)
    radar = {"position": [0, 0, 0.6], "power_dbm": 12.0, "waveform": WAVE}
    model = {"max_bounces": 2, "tolerance_db": 0.1, "max_rays": 400_000, "speckle": speckle}
    return rc.simulate(rc.Scene(bodies=[of], radar=radar, model=model))


def test_a_run_says_which_levels_two_steps_leave_open_are_speckle_and_traces_them_less():
    loose, wanted = post(True), post(False)
    assert any("number 1 among them" in line for line in loose.warnings)
    assert loose.stats["refinements"] >= 2 and loose.stats["rays"] < wanted.stats["rays"]
    assert loose.detections.error_db[0] > 0.1


def test_what_two_steps_bring_within_the_tolerance_is_not_speckle():
    """Two spheres in a cell move by decibels, but their level is known to 0.1 dB after one step."""
    result = rc.simulate(scene(ball("one", 12, 0.8, 0), ball("two", 12, -0.8, 0)))
    assert result.stats["refinements"] < 2 and result.detections.error_db[0] < 0.1
    assert not any("model.speckle" in line for line in result.warnings)
