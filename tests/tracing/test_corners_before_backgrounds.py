"""A corner reflector returns the same whatever stands behind it: its tubes are clipped at its edges, not at random."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.boxes_and_balls import WAVEFORM

import raychan as rc
from raychan.channel.paths import paths_of
from raychan.run.rules import step_rule
from raychan.tracing.solver import Launch
from raychan.tracing.sources import depth_of
from raychan.tracing.stats import Stats
from raychan.world.geometry import geometry_of

_BACKGROUNDS = {
    "ground": {"shape": "ground", "params": {"size": 60.0}},
    "wall": {"shape": "plate", "params": {"width": 8.0, "height": 3.0}, "position": (14.0, 0.0, 1.5), "yaw_deg": 170.0},
}


def returned(shape: dict, background: str, step: int, least: int = 0) -> tuple[complex, int]:
    """Return the sum of what a corner alone brings by as many bounces as it has faces, for a step of refinement and a
    least number of bisections, and by how many tubes."""
    bodies = [rc.Body("corner", **shape, position=(10.4, 0.3, 0.9), yaw_deg=165.0)]
    bodies += [rc.Body("behind", **_BACKGROUNDS[background])] if background else []
    bounces = 2 if shape["shape"] == "dihedral" else 3
    radar = {"waveform": WAVEFORM, "position": (0, 0, 0.8), "power_dbm": 30.0}
    scene = rc.Scene(bodies=bodies, radar=radar, model={"max_bounces": bounces})
    geometry = geometry_of(scene)
    rule = step_rule(scene.radar, scene.processing, scene.model, step)
    rule = replace(rule, refinement=replace(rule.refinement, least=least))
    launch = Launch(geometry, scene.points(0.0), rule)
    total, count = 0j, 0
    for batch, source in launch.whole(Stats(), lambda routes: routes):
        paths = paths_of(batch, geometry.facets, scene.radar, scene.radar.waveform.carrier)
        alone = (paths.trajectories.body <= 0).all(axis=1) & (depth_of(source) == bounces)
        total, count = total + paths.amplitude[alone[paths.trajectory]].sum(), count + int(alone.sum())
    return complex(total), count


_CORNERS = [
    {"shape": "dihedral", "params": {"size": 0.1, "height": 0.4}},
    {"shape": "trihedral", "params": {"size": 0.25}},
]


@pytest.mark.parametrize("background", list(_BACKGROUNDS))
@pytest.mark.parametrize("step", [1, 3])
@pytest.mark.parametrize("shape", _CORNERS)
def test_what_stands_behind_a_corner_does_not_change_its_return(shape, step, background):
    (alone, _), (before, _) = returned(shape, "", step), returned(shape, background, step)
    assert abs(np.abs(before / alone) - 1.0) < 2e-3


@pytest.mark.parametrize("shape", _CORNERS)
def test_a_least_number_of_bisections_makes_more_tubes_of_the_same_field(shape):
    """A launch that were no finer than the one before would change nothing, and state no error."""
    (coarse, few), (fine, many) = returned(shape, "", 1), returned(shape, "", 1, least=4)
    assert many > 2 * few
    assert abs(fine / coarse - 1.0) < 2e-3
