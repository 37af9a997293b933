"""What a preview prunes: whole facets by the bounds of the tubes that they would be, and no more than it may."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.places import SCENES

import raychan as rc
from raychan.run.preview.bounds import NEAR, facet_bounds
from raychan.run.preview.frame import preview_rule
from raychan.run.preview.launch import legs_over_ground, that_count
from raychan.tracing.contributions import SHARE, Contributions, amplitudes
from raychan.tracing.culling import seed_facets
from raychan.tracing.radiation import phases_of
from raychan.tracing.tubes import CENTRE, launch_tubes
from raychan.world.geometry import geometry_of


@pytest.mark.parametrize("name", ["urban", "living_street"])
def test_the_bound_of_a_whole_facet_is_that_of_its_tube(name):
    """On every leg in and out, over curved facets, metal and skin, within the beam and beside it; more where the phase
    along an edge turns back. What is too near for its middle to stand for it always counts."""
    scene = rc.Scene.load(SCENES / f"{name}.toml").override(["model.mode=preview"])
    geometry, rule = geometry_of(scene), preview_rule(scene.radar, scene.processing, scene.model)
    refined = rule.refinement.for_depth(rule.bounces)
    legs = legs_over_ground(geometry, scene.radar.position, 2, rule.beam)
    for leg in legs:
        allowed = np.ones(len(geometry.piece_role), bool)
        allowed[leg.pieces(geometry)] = False
        facet = seed_facets(geometry, leg, allowed)[::7]
        tubes = launch_tubes(geometry, leg, facet, np.broadcast_to(np.eye(3), (len(facet), 3, 3)).copy())
        corners = geometry.facets.vertices[facet]
        edges = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).max(axis=1)
        near = edges > NEAR * np.linalg.norm(tubes.points[:, CENTRE] - leg.image, axis=1)
        for out, (bound, length) in zip(
            legs, facet_bounds(geometry, leg, legs, facet, refined.wavenumber), strict=True
        ):
            ph = phases_of(geometry, leg, out, tubes, refined)
            assert (bound[near] > 1e5 * ph.bound.max()).all() or not near.any()
            bound[near] = ph.bound[near]
            along = 1e-4 * (np.roll(corners, -1, axis=1) - corners)
            steps = [_two_way(leg, out, corners + (1e4 - 1.0) * t * along) for t in (0.0, 1.0)]
            ends = _two_way(leg, out, corners + along), _two_way(leg, out, corners + 1e4 * along)
            turns = ((ends[0] - steps[0]) * (ends[1] - steps[1]) < 0.0).any(axis=1)
            least = 1e-12 * ph.bound.max()
            np.testing.assert_allclose(bound[~turns], ph.bound[~turns], rtol=1e-9, atol=least)
            assert (bound >= (1.0 - 1e-9) * ph.bound - least).all()
            assert (bound <= (1.0 + 1e-9) * ph.in_phase + least)[~near].all()
            np.testing.assert_allclose(length, ph.length, rtol=1e-12)


@pytest.mark.parametrize("distance", [13.0, 14.0, 20.0])
def test_what_a_facet_metres_long_returns_about_its_specular_point_is_within_its_bound(distance):
    """A lamp post's pole is of facets of 5.9 m: their returns by tubes a 32nd as long."""
    post = rc.Body("post", shape="lamp_post", position=(distance, 1.0, 0.0))
    scene = rc.Scene(bodies=[post], radar=rc.Scene.load(SCENES / "urban.toml").radar, model={"mode": "preview"})
    geometry, rule = geometry_of(scene), preview_rule(scene.radar, scene.processing, scene.model)
    refined = rule.refinement.for_depth(rule.bounces)
    leg = legs_over_ground(geometry, scene.radar.position, 2, rule.beam)[0]
    facet = seed_facets(geometry, leg, np.ones(len(geometry.piece_role), bool))
    corners = geometry.facets.vertices[facet]
    facet = facet[np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).max(axis=1) > 5.0]
    ((bound, _),) = facet_bounds(geometry, leg, [leg], facet, refined.wavenumber)
    parts = np.eye(3)[None]
    for _ in range(5):
        a, b, c = parts.transpose(1, 0, 2)
        ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
        parts = np.concatenate([np.stack(x, axis=1) for x in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    each = [amplitudes(phases_of(geometry, leg, leg, _tubes(geometry, leg, f, parts), refined)).sum() for f in facet]
    ends = 1.2  # the Fresnel integral rises to 1.17 of its limit
    assert len(facet) > 10 and (np.abs(each) <= ends * bound).all()
    assert np.abs(each).max() > 0.2 * bound.max()


def _two_way(leg, out, points):
    return sum(np.linalg.norm(points - end.image, axis=2) for end in (leg, out))


def _tubes(geometry, leg, facet, parts):
    return launch_tubes(geometry, leg, np.full(len(parts), facet, np.int32), parts)


@pytest.mark.parametrize("seed", range(5))
def test_what_is_pruned_adds_up_to_less_than_it_may_in_each_range_cell(seed):
    """Sums over all that is pruned, in their phases and in unrelated ones, by a sum over each cell; and what alone is
    more than that stays."""
    rng = np.random.default_rng(seed)
    scene = rc.Scene.load(SCENES / "urban.toml")
    rule = replace(preview_rule(scene.radar, scene.processing, scene.model).refinement, cell=0.5)
    found, n, weight = Contributions(rule), 4000, 2.0
    length = rng.uniform(10.0, 14.0, n)
    each = rule.floor * 10.0 ** rng.uniform(-5.0, 1.0, n) * np.exp(2j * np.pi * rng.random(n) * rng.integers(0, 2))
    kept = that_count(found, each, length, weight)
    most = SHARE * found.prune_threshold(length)
    assert kept[weight * np.abs(each) > most].all() and 0 < kept.sum() < n
    for cell in np.unique((length / rule.cell).astype(int)):
        gone = ~kept & ((length / rule.cell).astype(int) == cell)
        assert weight * abs(each[gone].sum()) <= most[0] * (1.0 + 1e-9)
        assert weight * np.sqrt((np.abs(each[gone]) ** 2).sum()) <= most[0] * (1.0 + 1e-9)
