"""What further launches of sources took is known by facet, bounce and leg, and nothing of those not traced."""

import numpy as np
import pytest

from raychan.tracing.shooting import Wanted
from raychan.tracing.source_rays import SourceRays
from raychan.tracing.sources import EXACT, source_of, without_out


def wanted(facets, depth):
    mask = np.zeros(8, bool)
    mask[facets] = True
    return Wanted(mask, depth, frozenset({0, 3}))


def of(leg, out, depth, *facets):
    return source_of(leg, out, depth, np.array(facets))


def test_facets_share_the_rays_of_a_launch_as_its_routes_do():
    rays = SourceRays(8)
    routes = np.concatenate([of(1, 0, 2, 4, 4, 4), of(1, 3, 2, 4, 5), np.array([EXACT])])
    rays.learn(1, [(1, wanted([4, 5, 6], 2))], routes, 60)
    # Facet 6 brings no route and counts as one.
    assert rays.of(of(1, 0, 2, 4, 5, 6)) == pytest.approx([40.0, 10.0, 10.0])
    assert rays.of(of(1, 3, 2, 4)) == rays.of(of(1, 0, 2, 4))


def test_what_was_not_traced_again_is_of_the_first_launch():
    rays = SourceRays(8)
    rays.learn(1, [(0, wanted([2], 1))], of(0, 0, 1, 2), 10)
    rays.learn(2, [(0, wanted([2], 1))], of(0, 0, 1, 2, 2), 30)
    source = np.concatenate([of(0, 0, 1, 2, 3), of(0, 0, 2, 2), of(1, 0, 1, 2)])
    assert rays.step_of(source).tolist() == [2, 0, 0, 0]
    assert rays.of(source).tolist() == [30.0, 1.0, 1.0, 1.0]


def test_legs_out_do_not_tell_launches_apart():
    a, b = of(5, 0, 3, 7), of(5, 9, 3, 7)
    assert a != b and without_out(a) == without_out(b)
    assert (
        len(np.unique(without_out(np.concatenate([of(5, 0, 3, 7), of(4, 0, 3, 7), of(5, 0, 2, 7), of(5, 0, 3, 6)]))))
        == 4
    )


def test_launches_that_save_few_rays_are_made_one_with_finer_ones():
    few, many = [], []
    for rays, found in ((10, few), (10**6, many)):
        known = SourceRays(8)
        known.learn(1, [(0, wanted([2, 3], 1))], of(0, 0, 1, 2, 3), 2 * rays)
        known.learn(2, [(0, wanted([3], 1))], of(0, 0, 1, 3), rays)
        known.learn(1, [(0, wanted([2], 2))], of(0, 0, 2, 2), rays)
        found += known.next_step(np.concatenate([of(0, 0, 1, 2, 3), of(0, 0, 2, 2)])).tolist()
    assert few == [3, 3, 2] and many == [2, 3, 2]
