"""What a step of a refinement traces again: cells that rays can bring within their tolerance, and no others."""

import numpy as np
import pytest

from raychan.run.refinement.budget import FORESEEN, RAYS, SECONDS
from raychan.run.refinement.map_cells import MapCells
from raychan.run.refinement.plan import SLOW, planned
from raychan.tracing.shooting import Wanted
from raychan.tracing.source_rays import SourceRays
from raychan.tracing.sources import source_of

ONE, OTHER = source_of(0, 0, 1, np.array([0])), source_of(0, 0, 1, np.array([1]))


def cells_of(*doubts):
    """Return cells of level 1, each changed by a source of its own, from the same doubt each time."""
    place = np.array([[10.0 + i, 0.0, 1.0] for i in range(len(doubts))])
    cells = MapCells(place, np.ones(len(doubts), complex), 0.5)
    for steps in range(max(len(d) for d in doubts)):
        for i, history in enumerate(doubts):
            cells.changed(i, source_of(0, 0, 1, np.array([i])), np.array([history[steps] + 0j]))
        cells.stepped()
    return cells


def rays_of(*rays):
    """Return what is known after launches of facets 0, 1, ... that took so many rays each."""
    known = SourceRays(len(rays))
    for i, count in enumerate(rays):
        facets = np.arange(len(rays)) == i
        known.learn(1, [(0, Wanted(facets, 1, frozenset({0})))], source_of(0, 0, 1, np.array([i])), count)
    return known


def test_the_cell_that_takes_fewest_rays_comes_first():
    cells = cells_of((0.4, -0.1), (0.4, -0.1))
    both, rays, ended = planned(cells, rays_of(1000, 10), (1e6, RAYS), 6)
    assert both.tolist() == [*ONE, *OTHER] and ended == ""
    one, fewer, ended = planned(cells, rays_of(1000, 10), (100.0, RAYS), 6)
    assert one.tolist() == [*OTHER] and ended == "" and fewer < rays


def test_where_no_cell_can_be_reached_by_the_rays_left_none_is_traced_again():
    found, rays, ended = planned(cells_of((0.4, -0.1)), rays_of(1000), (100.0, RAYS), 6)
    assert len(found) == 0 and rays == 0.0 and ended == RAYS + FORESEEN
    assert planned(cells_of((0.4, -0.1)), rays_of(1000), (100.0, SECONDS), 6)[2] == SECONDS + FORESEEN


@pytest.mark.parametrize(("rays", "count", "why"), [(1000, 0, SLOW), (10, 1, "")])
def test_a_cell_that_steps_hardly_bring_closer_is_followed_only_for_a_few_rays(rays, count, why):
    found, _, ended = planned(cells_of((0.6, -0.6, 0.6)), rays_of(rays), (1e4, RAYS), 2)
    assert len(found) == count and ended == why


def test_cells_within_their_tolerance_end_a_refinement_and_so_do_all_steps_taken():
    assert planned(cells_of((1e-3, 1e-4)), rays_of(10), (1e6, RAYS), 6)[2] == ""
    assert planned(cells_of((0.4, -0.1)), rays_of(10), (1e6, RAYS), 0)[2] == "8 steps"


def test_a_cell_that_no_source_keeps_open_ends_a_refinement():
    """What is in doubt there is of deep tubes that are never traced again."""
    cells = cells_of((1e-3, 1e-4))
    cells.left[0] = 0.2
    found, _, ended = planned(cells, rays_of(10), (1e6, RAYS), 6)
    assert cells.open[0] and len(found) == 0 and ended == SLOW


def test_a_source_of_two_cells_is_paid_for_once():
    cells = MapCells(np.array([[10.0, 0.0, 1.0], [20.0, 0.0, 1.0]]), np.ones(2, complex), 0.5)
    for i in (0, 1):
        cells.changed(i, ONE, np.array([0.05 + 0j]))
    cells.stepped()
    _, rays, _ = planned(cells, rays_of(100, 100), (1e6, RAYS), 6)
    assert rays == planned(cells_of((0.05,)), rays_of(100), (1e6, RAYS), 6)[1]


@pytest.mark.parametrize(("left", "count", "why"), [(7, 1, ""), (5, 0, SLOW)])
def test_no_cell_is_given_up_before_three_steps_told_how_its_changes_shrink(left, count, why):
    found, _, ended = planned(cells_of((30.0,)), rays_of(1000), (5e3, RAYS), left)
    assert len(found) == count and ended == why
