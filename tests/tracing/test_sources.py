"""Sources of tubes: a launch of some sources again brings the routes of the whole launch that have them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from support.boxes_and_balls import scene_of

import raychan as rc
from raychan.channel.paths import join, paths_of
from raychan.run.rules import fine_rule
from raychan.signal.baseband import synthesize
from raychan.tracing import solver
from raychan.tracing.solver import Launch
from raychan.tracing.sources import EXACT, Rings, covered, depth_of, facet_of, launches, legs_of, source_of
from raychan.tracing.stats import Further, Stats
from raychan.world.geometry import geometry_of


@pytest.fixture(scope="module")
def whole():
    scene = scene_of(2)
    rule = fine_rule(scene.radar, scene.processing, scene.model)
    launch = Launch(geometry_of(scene), scene.points(0.0), rule)
    routes, sources = zip(*launch.whole(Stats(), lambda routes: routes), strict=True)
    return scene, launch, routes, np.concatenate(sources)


def surfaces(routes):
    """Return bounce and first facet of each route, one route after the other."""
    found = []
    for batch in routes:
        for i in range(len(batch.kind)):
            if batch.scatter[i] < 0:
                found.append((0, -1))
                continue
            met = [s for s in range(batch.scatter[i] + 1) if batch.kind[i, s] != rc.InteractionType.TRANSMIT]
            found.append((met, batch.facet[i]))
    return found


def test_depth_and_facet_are_those_that_the_interactions_tell(whole):
    _, launch, routes, sources = whole
    depths, facets, row = depth_of(sources), facet_of(sources), 0
    legs, outs = legs_of(sources)
    turned = 0
    for met, facet in surfaces(routes):
        if sources[row] == EXACT:
            assert (depths[row], facets[row]) == (0, -1)
        else:
            mirrors, others = (len(launch.legs[int(x[row])].mirrors) for x in (legs, outs))
            # Of routes over one leg and another the same with their ends exchanged have the source, too.
            mirrors = others if depths[row] == 1 and len(met) != mirrors + 1 else mirrors
            turned += mirrors != len(launch.legs[int(legs[row])].mirrors)
            assert depths[row] == len(met) - mirrors
            assert facets[row] == facet[met[mirrors]]
        row += 1
    assert row == len(sources)
    assert {1, 2} <= set(depths.tolist())
    assert turned > 100


def test_covered_tells_what_a_slow_search_tells(whole):
    *_, sources = whole
    rng = np.random.default_rng(3)
    own = np.unique(sources[sources != EXACT])
    some = rng.choice(own, 20, replace=False)
    by = list(launches(some, 1 << 20))
    wanted = set()
    for leg, one in by:
        wanted |= {(leg, one.depth, out, int(f)) for out in one.outs for f in np.flatnonzero(one.facets)}
    slow = [
        s != EXACT and (s >> 49, s >> 31 & 15, s >> 35 & 16383, s & 0x7FFFFFFF) in wanted for s in map(int, sources)
    ]
    assert covered(sources, by).tolist() == slow
    assert covered(some, by).all()


def test_tracing_all_sources_again_by_the_same_rule_gives_the_same_samples(whole):
    scene, launch, routes, sources = whole
    by = list(launches(np.unique(sources), len(launch.geometry.facets.body)))
    further = Further(launch.rule.refinement, by)
    again = [batch for batch, _ in launch.again([further], lambda routes: routes)[0]]
    assert further.stats.rays > 0

    def samples(batches):
        facets, radar = launch.geometry.facets, scene.radar
        return synthesize(join([paths_of(b, facets, radar, radar.waveform.carrier) for b in batches]), radar).samples

    whole_before = samples([b for b in routes if (b.scatter >= 0).all()])
    # What is weak is judged by what the whole launch had found in the end, so some tubes are cut less.
    tolerance = 1.0 - 10.0 ** (-scene.model.tolerance_db / 20.0)
    assert np.linalg.norm(samples(again) - whole_before) < tolerance * np.linalg.norm(whole_before)


def test_further_launches_at_once_bring_what_each_brings_alone(whole):
    _, launch, _, sources = whole
    own, rule = np.unique(sources[sources != EXACT]), launch.rule.refinement
    halves = [list(launches(own[i::2], len(launch.geometry.facets.body))) for i in range(2)]
    asked = [Further(dataclasses.replace(rule, least=i), by) for i, by in enumerate(halves)]
    both = launch.again(asked, lambda routes: routes)
    for further, found in zip(asked, both, strict=True):
        alone = Further(further.refinement, further.wanted)
        again = launch.again([alone], lambda routes: routes)[0]
        assert (further.stats.rays, further.stats.tubes) == (alone.stats.rays, alone.stats.tubes)
        assert sum(len(s) for _, s in found) > 0
        for (a, s), (b, t) in zip(found, again, strict=True):
            assert np.array_equal(s, t)
            assert np.array_equal(a.length, b.length)


def test_a_launch_holds_no_more_routes_than_it_may(whole, monkeypatch):
    """Beside the legs of a group one batch of the direct leg is held at a time, however many there are."""
    _, launch, *_ = whole
    small = dataclasses.replace(launch.rule.refinement, batch=200)
    few = Launch(launch.geometry, launch.points, dataclasses.replace(launch.rule, refinement=small))
    monkeypatch.setattr(solver, "_HELD_ROUTES", 100)
    made, held, most = [], 0, 0

    def each(routes):
        made.append(len(routes.kind))
        return len(routes.kind)

    legs = list[int]()
    for number, source in few.whole(Stats(), each):
        held += number
        straight = (source != EXACT).all() and (legs_of(source)[0] == 0).all()
        legs.append(0 if straight else 1)
        if straight:
            most = max(most, sum(made) - held)
    assert sum(made) == held
    assert legs.count(0) > 5
    # What is made but not yielded yet when a batch of the direct leg is: the other batches of one group at most.
    assert most < 0.5 * held


def test_uncut_deep_tubes_cost_fewer_rays(whole):
    _, launch, *_ = whole
    rough = dataclasses.replace(launch.rule, refinement=dataclasses.replace(launch.rule.refinement, coarse=1e9))
    stats, fine = Stats(), Stats()
    list(Launch(launch.geometry, launch.points, rough).whole(stats, lambda routes: routes))
    list(Launch(launch.geometry, launch.points, launch.rule).whole(fine, lambda routes: routes))
    assert stats.rays < 0.9 * fine.rays


def test_beside_facets_lie_the_rest_of_their_plane_and_what_shares_an_edge(whole):
    _, launch, *_ = whole
    geometry = launch.geometry
    rng = np.random.default_rng(1)
    corners = [[tuple(np.round(p, 6)) for p in v] for v in geometry.facets.vertices]
    for chosen in rng.choice(len(corners), 5, replace=False):
        wanted = np.zeros(len(corners), bool)
        wanted[chosen] = True
        body = geometry.facets.body
        slow = [
            body[i] == body[chosen]
            and (geometry.plane[i] == geometry.plane[chosen] or len(set(corners[i]) & set(corners[chosen])) >= 2)
            for i in range(len(corners))
        ]
        rings = Rings(geometry)
        own, none = source_of(0, 0, 2, np.array([chosen])), np.zeros(0, np.int64)
        ((_, alone),) = Rings(geometry).with_those_beside(none, own)
        assert alone.facets.tolist() == wanted.tolist()
        ((_, first),) = rings.with_those_beside(own, none)
        assert first.facets.tolist() == slow
        # Each is traced once beside what is wanted, at each bounce.
        ((_, second),) = rings.with_those_beside(own, none)
        assert second.facets.tolist() == wanted.tolist()
        ((_, other),) = rings.with_those_beside(source_of(0, 0, 3, np.array([chosen])), none)
        assert other.facets.tolist() == slow
