"""The ledger says what flat facets would change where a mesh's normals were estimated."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

import raychan as rc
from raychan.world.shapes.piece import Assembly
from raychan.world.shapes.solid import ellipsoid

RADAR = {"waveform": {"bandwidth_mhz": 500.0, "chirp_us": 30.0, "chirps": 16, "samples": 64}}


def entry(mesh):
    body = rc.Body(name="it", mesh=mesh, material="pec", position=(4.0, 0.0, 0.0))
    plate = rc.Body(name="plate", shape="box", position=(8.0, 3.0, 0.0))
    return rc.simulate(rc.Scene(bodies=[body, plate], radar=RADAR, model={"max_bounces": 1})).ledger["tessellation"]


@pytest.mark.parametrize("subdivisions", [3, 4])
def test_flat_facets_of_a_ball_are_off_by_twice_the_wavenumber_times_their_sag(subdivisions):
    """Chords of a sphere: the sag is L^2 / 8 r."""
    radius = 0.15
    ball = trimesh.creation.icosphere(subdivisions, radius)
    sag = np.mean((ball.edges_unique_length**2 / (8.0 * radius)) ** 2) ** 0.5
    found = entry(ball)
    told = float(found.how.split(" rad")[0].split()[-1])
    assert told == pytest.approx(2.0 * 2.0 * np.pi * 77e9 / 299792458.0 * sag, rel=0.1)
    assert isinstance(found.level_db, float)


def test_bodies_that_know_their_surface_leave_nothing_open():
    assert entry(trimesh.creation.box((0.3, 0.3, 0.3))).level_db == "none"
    scene = rc.Scene(bodies=[rc.Body(name="b", shape="sphere", position=(4.0, 0.0, 0.0))], radar=RADAR)
    assert rc.simulate(scene).ledger["tessellation"].level_db == "none"


def test_known_normals_of_facets_that_cubic_ones_differ_from_leave_a_level_unknown():
    """Of an egg stretched from a sphere, whose quadratic facets err by the third power of their size."""
    told = []
    for sag in (8e-3, 2e-3):
        mesh = made_mesh("egg", "pec", ellipsoid((0.1, 0.15, 0.3), sag))
        body = rc.Body(name="egg", mesh=mesh, position=(4.0, 0.0, 0.5))
        found = rc.simulate(rc.Scene(bodies=[body], radar=RADAR, model={"max_bounces": 1})).ledger["tessellation"]
        assert found.level_db == "unknown" and "egg" in found.how
        told.append(float(found.how.split(" rad")[0].split()[-1]))
    assert told[0] / told[1] == pytest.approx(4.0**1.5, rel=0.3)


def made_mesh(part, material, piece):
    made = Assembly()
    made.add(part, material, piece)
    return made.mesh()
