"""Cells of a map while a run is refined: what may be wrong of their levels, and which sources are traced again."""

from __future__ import annotations

import numpy as np
import pytest

from raychan.channel.error import COVER
from raychan.run.refinement.map_cells import ALONG, MapCells, feeding_sources

SHALLOW, DEEP = 1 << 31, 2 << 31  # sources of facet 0: bounces 1 and 2


def one_cell():
    """Return a cell of level 1 that no launch has changed."""
    return MapCells(np.array([[10.0, 0.0, 1.0]]), np.array([1.0 + 0j]), 0.5)


def again(cells):
    """Return what cell 0 wants traced again where all sources take as many rays."""
    source = cells.sources(0)
    return cells.wanted(0, np.ones(len(source)), source)


def many_changes():
    """Return changes (300,) of many sizes and all phases."""
    rng = np.random.default_rng(3)
    return rng.normal(size=300) * 10.0 ** rng.uniform(-4, -1, 300) * np.exp(2j * np.pi * rng.uniform(size=300))


def test_sources_left_out_bring_less_than_their_share():
    rng = np.random.default_rng(5)
    depth = rng.integers(1, 3, 400)
    source = (depth.astype(np.int64) << 31) | np.arange(400)
    sums = rng.normal(size=400) * 10.0 ** rng.uniform(-4, 0, 400) * np.exp(2j * np.pi * rng.uniform(size=400))
    feeding = feeding_sources(source, sums, 0.06)
    level = abs(sums.sum())
    for bounce in (1, 2):
        own = depth == bounce
        left = ~feeding & own
        assert 0 < left.sum() < own.sum()
        assert np.sqrt((np.abs(sums[left]) ** 2).sum()) <= 0.3 * 0.06 * level
        assert abs(sums[left].sum()) <= 0.3 * 0.06 * level
        assert (np.abs(sums[left]).max() <= np.abs(sums[feeding & own])).all()


@pytest.mark.parametrize(("q", "factor"), [(0.3, 0.5**0.5), (0.64, 1.0), (0.75, 3.0 / 1.8), (1.2, 3.0)])
def test_changes_that_do_not_shrink_count_as_the_rest_of_their_series(q, factor):
    cells = one_cell()
    for change in (0.1, 0.1 * q):
        cells.changed(0, np.array([SHALLOW]), np.array([change + 0j]))
    assert cells.slowness(0)[1] == pytest.approx(factor, rel=0.02)
    assert cells.doubt[0] == pytest.approx(ALONG * COVER * factor * 0.1 * max(q, 0.35), rel=0.02)


@pytest.mark.parametrize("turn", [np.pi, 0.5 * np.pi])
def test_changes_to_and_fro_are_no_series(turn):
    """The error of the newer of two launches has at most half of the power of what they differ by."""
    cells = one_cell()
    for change in (0.1, 0.09 * np.exp(1j * turn)):
        cells.changed(0, np.array([SHALLOW]), np.array([change]))
    assert cells.doubt[0] == pytest.approx(ALONG * COVER * 0.5**0.5 * 0.09)


def test_a_source_that_changed_once_keeps_its_unknown_ratio():
    """Others that changed twice say nothing of it."""
    cells = one_cell()
    cells.changed(0, np.array([SHALLOW, SHALLOW + 1]), np.array([0.1, 0.02 + 0j]))
    cells.changed(0, np.array([SHALLOW]), np.array([0.01 + 0j]))
    factor = dict(zip(*cells.slowness(0)[:2], strict=True))
    assert factor == pytest.approx({SHALLOW: 0.5**0.5, SHALLOW + 1: 2.0 / COVER})


def test_weak_tubes_count_until_they_are_traced_again():
    """However little the stronger ones changed: they are cut finer from the first launch on."""
    cells, weak = one_cell(), np.full(100, 0.003 + 0j)
    cells.tubes[0] = 1.0
    cells.weak(0, SHALLOW + np.arange(100), weak)
    cells.changed(0, np.array([SHALLOW + 200]), np.array([1e-4 + 0j]))
    cells.traced(np.array([SHALLOW + 200]))
    assert cells.doubt[0] == pytest.approx(ALONG * COVER * 0.44 * 0.03, rel=0.02)
    cells.traced(SHALLOW + np.arange(75))
    assert cells.doubt[0] == pytest.approx(ALONG * COVER * 0.44 * 0.015, rel=0.03)
    cells.traced(SHALLOW + np.arange(100))
    cells.weak(0, np.zeros(0, np.int64), np.zeros(0, complex))
    assert cells.doubt[0] == pytest.approx(0.1 * cells.tolerance[0], rel=1e-3)


def test_changes_that_cancel_count_by_their_rms_sum():
    """Two sources change a level to opposite sides: that says nothing of their next changes."""
    cells = one_cell()
    cells.changed(0, np.array([SHALLOW, SHALLOW + 1]), np.array([0.03, -0.03 + 0j]))
    assert cells.level[0] == pytest.approx(1.0)
    assert cells.doubt[0] == pytest.approx(2.0 * 0.03)
    assert cells.open[0]


def test_a_cell_whose_doubts_do_not_shrink_takes_more_steps_than_one_whose_do():
    steps = []
    for history in ((0.5, -0.49, 0.5), (0.5, -0.4, 0.3), (0.5, -0.1, 0.02)):
        cells = one_cell()
        for change in history:
            cells.changed(0, np.array([SHALLOW]), np.array([change + 0j]))
            cells.stepped()
        steps.append(float(cells.steps[0]))
    assert steps[0] > steps[1] > steps[2] == 1.0


def test_one_large_change_after_small_ones_does_not_put_a_cell_out_of_reach():
    steps = []
    for history in ((0.5, -0.1, 0.5), (0.5, -0.5, 0.5)):
        cells = one_cell()
        for change in history:
            cells.changed(0, np.array([SHALLOW]), np.array([change + 0j]))
            cells.stepped()
        steps.append(float(cells.steps[0]))
    assert steps[0] < steps[1]


def test_a_small_change_after_some_that_did_not_shrink_is_not_believed():
    """Half of the doubt before it counts on: launches on alternate lattices may agree by chance."""
    doubts = []
    for history in ((0.4, -0.39, 0.001), (0.4, -0.1, 0.001)):
        cells = one_cell()
        for change in history:
            before = float(cells.doubt[0])
            cells.changed(0, np.array([SHALLOW]), np.array([change + 0j]))
            cells.stepped()
        doubts.append((float(cells.doubt[0]), before))
    (held, before), (believed, _) = doubts
    assert held == pytest.approx(0.5 * before, rel=0.05) and believed < 0.3 * held


def test_a_small_change_after_some_that_did_not_shrink_is_confirmed_by_another():
    cells = one_cell()
    for change in (0.4, -0.39, 0.001):
        cells.changed(0, np.array([SHALLOW]), np.array([change + 0j]))
        cells.stepped()
    assert cells.open[0] and again(cells).tolist() == [SHALLOW]
    cells.changed(0, np.array([SHALLOW]), np.array([0.001 + 0j]))
    cells.stepped()
    assert cells.over[0] <= 1.0 and not cells.open.any()


def test_deep_tubes_that_were_never_cut_keep_a_cell_from_its_tolerance():
    cells = one_cell()
    cells.changed(0, np.array([SHALLOW, DEEP]), np.array([0.001, 0.002 + 0j]))
    assert not cells.open.any()
    cells.left[0] = 0.1
    assert cells.open[0]


def test_what_changed_most_is_traced_again():
    """All but the weakest: most of what is in doubt where a step does not bring a cell within its tolerance."""
    cells, source, change = one_cell(), SHALLOW + np.arange(300), many_changes()
    cells.changed(0, source, change)
    left = ~np.isin(source, again(cells)) & (np.abs(change) > 1e-3 * cells.tolerance[0] * abs(cells.level[0]))
    limit = 0.3 * 2.0 / COVER * np.sqrt((np.abs(change) ** 2).sum())
    assert cells.over[0] > 3.0 and 0 < left.sum() < 300
    assert 2.0 / COVER * abs(change[left].sum()) <= limit
    assert 2.0 / COVER * np.sqrt((np.abs(change[left]) ** 2).sum()) <= limit
    assert np.abs(change[left]).max() <= np.abs(change[np.isin(source, again(cells))]).min()


def test_of_sources_that_change_alike_those_that_take_many_rays_wait():
    cells, source = one_cell(), SHALLOW + np.arange(20)
    cells.changed(0, source, 0.02 * np.exp(2j * np.pi * np.arange(20) / 20.0))
    rays = np.where(source == SHALLOW + 7, 1000.0, 1.0)
    assert set(source) - set(cells.wanted(0, rays, source)) == {SHALLOW + 7}


def test_the_least_that_is_stated_is_a_share_of_the_tolerance_or_all_that_tubes_bring():
    cells = one_cell()
    assert cells.doubt[0] == 0.0
    cells.tubes[0] = 1e-5
    assert cells.doubt[0] == pytest.approx(1e-5)
    cells.tubes[0] = 1.0
    assert cells.doubt[0] == pytest.approx(0.1 * cells.tolerance[0], rel=1e-3)
