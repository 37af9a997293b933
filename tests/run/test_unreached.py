"""Lines on cells that a budget left above the tolerance: detections, and what may still become one."""

from types import SimpleNamespace

import numpy as np

from raychan.run.refinement.map_cells import MapCells
from raychan.run.refinement.unreached import Remains, Unreached, unreached_of

SHALLOW, DEEP = 1 << 31, 2 << 31  # sources of facet 0: bounces 1 and 2
FACETS = SimpleNamespace(
    body=np.array([0, 0, 1, 2]),
    part=np.array([0, 1, 0, 0]),
    body_names=("car", "post", "wall"),
    part_names=("a", "b"),
)


def said(unreached, steps, ranges, rates, error_db=0.0, settled=(), also=()):
    """Return the lines on cells, given the detections and cells of 0.30 m and 0.76 m/s."""
    remains = Remains(tuple(unreached), steps, "8 steps", 0.5, settled=tuple(settled))
    errors = np.broadcast_to(error_db, len(ranges))
    return remains.notes((np.array(ranges), np.array(rates)), (0.30, 0.76), errors, also)


def test_weak_cells_are_told_apart_from_detections():
    place = np.array([[10.0, 1.0, 1.0], [20.0, -2.0, 0.5], [30.0, 0.0, 1.0]])
    cells = MapCells(place, np.array([1.0, 0.5, 1.0], complex), 0.5)
    cells.spare(np.full(3, 0.8))
    cells.changed(0, np.array([SHALLOW]), np.array([0.2 + 0j]))
    cells.changed(1, np.array([DEEP]), np.array([0.01 + 0.4j]))
    found = list(unreached_of(cells, FACETS))
    assert found == [Unreached(10.0, 1.0, 1, ("car.a",)), Unreached(20.0, -2.0, 2, ("car.a",))]
    strong, weak = said(found, 2, [10.02], [0.9])
    assert strong == (
        "refined 2 times, ended by 8 steps: the level still changes by more than 0.5 dB at number 1 "
        "(10.02 m, +0.90 m/s; first surface: car.a)"
    )
    assert "where nothing is detected yet" in weak and "20.00 m, -2.00 m/s (bounce 2 of tubes off car.a)" in weak


def test_nothing_is_said_where_all_is_reached_and_three_cells_are_named():
    assert said([], 1, [], []) == []
    (line,) = said([Unreached(float(k), 0.0, 2, ("post",)) for k in range(5)], 1, [], [])
    assert line.startswith("refined once, ") and line.endswith(
        "2.00 m, +0.00 m/s (bounce 2 of tubes off post) and 2 more"
    )


def test_a_cell_is_a_detection_within_a_cell_of_one_in_range_and_in_rate_not_in_one_of_both():
    cell = Unreached(13.64, -3.79, 2, ("post",))
    for found, weak in (([13.66, -3.74], False), ([13.66, -2.9], True), ([14.2, -3.74], True)):
        (line,) = said([cell], 3, found[:1], found[1:])
        assert ("where nothing is detected yet" in line) == weak and ("13.64 m" in line) == weak


def test_detections_go_by_number_and_place_of_the_table_the_nearest_of_several_once_each():
    cells = [Unreached(r, 0.0, bounce, ("post",)) for r, bounce in ((20.18, 2), (10.0, 1), (20.0, 3), (20.18, 2))]
    (line,) = said(cells, 2, [5.0, 20.2, 10.1, 20.04, 9.95], [0.0, 0.0, 0.0, 0.01, 0.0])
    assert line.endswith(
        "at numbers 2 (20.20 m, +0.00 m/s; bounce 2 of tubes off post), 4 (20.04 m, +0.01 m/s; bounce 3 of tubes off "
        "post), 5 (9.95 m, +0.00 m/s; first surface: post)"
    )
    (line,) = said(cells[:3:2], 2, [20.1], [0.0])
    assert line.endswith("number 1 (20.10 m, +0.00 m/s; bounce 2 of tubes off post; bounce 3 of tubes off post)")
    (line,) = said([Unreached(float(k), 0.0, 2, ("post",)) for k in range(5)], 1, np.arange(5.0), np.zeros(5))
    assert " at numbers 1 (0.00 m, " in line and line.endswith(
        ", 3 (2.00 m, +0.00 m/s; bounce 2 of tubes off post) and 2 more"
    )


def test_the_bounce_and_the_bodies_that_may_change_a_cell_most_are_named():
    cells = MapCells(np.array([[10.0, 1.0, 1.0]]), np.array([1.0], complex), 0.5)
    source = np.array([SHALLOW, DEEP, DEEP + 1, DEEP + 2, DEEP + 3])
    cells.changed(0, source, np.array([0.3, 0.3, 0.29, 0.28, 0.001], complex))
    (cell,) = unreached_of(cells, FACETS)
    assert (cell.bounce, cell.bodies, cell.others) == (2, ("car.a", "car.b"), 1)
    assert cell.text.endswith("(bounce 2 of tubes off car.a, car.b and 1 more)")
    cells.changed(0, source, np.array([0.3, 0.001, 0.001, 0.3, 0.001], complex))
    cells.changed(0, source[:1], np.array([0.6], complex))
    (cell,) = unreached_of(cells, FACETS)
    assert (cell.bounce, cell.bodies) == (1, ("car.a",))


def test_a_level_within_the_tolerance_and_not_as_far_as_asked_is_told_where_its_error_is_above():
    place = np.array([[10.0, 1.0, 1.0], [20.0, 0.0, 1.0], [30.0, 0.0, 1.0]])
    cells, small = (MapCells(place, np.ones(3, complex), 0.5) for _ in range(2))
    small.changed(0, np.array([DEEP]), np.array([1e-3j]))
    # 0.95 and 0.5 of the tolerance: refinement aims at 0.9.
    for i, share in ((0, 0.95), (1, 0.5)):
        cells.changed(i, np.array([DEEP]), np.array([1e-3j * share * small.tolerance[0] / small.doubt[0]]))
    (cell,) = unreached_of(cells, FACETS)
    assert cell == Unreached(10.0, 1.0, 2, ("car.a",), beyond=False)
    assert cells.settled == [(20.0, 0.0), (30.0, 0.0)]
    (line,) = said([cell], 7, [10.0], [1.0], 0.501)
    assert line.endswith("by more than 0.5 dB at number 1 (10.00 m, +1.00 m/s; bounce 2 of tubes off car.a)")
    assert said([cell], 7, [10.0], [1.0], 0.499) == said([cell], 7, [15.0], [1.0], 0.501) == []


def test_errors_above_the_tolerance_of_cells_that_are_refined_are_told_with_what_else_they_hold():
    found = [5.0, 10.05, 20.0], [0.0, 1.0, 0.0]
    settled = [(10.0, 1.0), (20.0, 0.0)]
    (line,) = said([], 4, *found, [0.6, 0.6, 0.4], settled)
    assert line == (
        "refined to 0.5 dB in its own cell: number 2 (10.05 m, +1.00 m/s); what is stated above that is of what may "
        "still change in cells beside and tubes below the noise"
    )
    (line,) = said([], 4, *found, [0.6, 0.6, 0.6], settled, ["merged facets", "turning bodies"])
    assert "numbers 2 (10.05 m, +1.00 m/s), 3 (20.00 m, +0.00 m/s); " in line
    assert "is of merged facets, turning bodies, what may" in line
    # A budget is reason enough, and so is an error that is unknown.
    (line,) = said([Unreached(10.0, 1.0, 1, ("post",))], 4, *found, [0.6, 0.6, np.nan], settled)
    assert line.startswith("refined 4 times")
