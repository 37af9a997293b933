"""Tubes launched in batches, so that memory does not grow with their number, carry what all at once do."""

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
import trimesh

from raychan.run.cross_section.refinement import refinements
from raychan.run.cross_section.scattering import scattering
from raychan.run.cross_section.single_body import facets_of
from raychan.tracing.legs import Leg
from raychan.world.geometry import Geometry
from raychan.world.shapes import build

F = 77e9


def test_tubes_launched_in_batches_carry_what_those_launched_at_once_do():
    look = np.array([np.cos(np.radians(20.0)), np.sin(np.radians(20.0)), 0.0])
    plate = build("plate", {"width": 0.5, "height": 0.4}), Leg(end=3.0 * look)
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.2), Leg(end=look, far=True)
    for mesh, leg in (plate, ball):
        geometry, found = Geometry(facets_of(mesh, "pec", F)), []
        for batch in (1 << 17, 50):
            fine = islice(refinements(geometry, F), 2)
            rules = [replace(rule, batch=batch) for rule in fine]
            found.append([abs(scattering(geometry, leg, leg, F, 3, rule).sum(axis=0)[0, 0]) for rule in rules])
        assert found[1] == pytest.approx(found[0], rel=1e-9)
