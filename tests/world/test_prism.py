"""An outline raised to a height is a closed body of its area times its height, whatever its corners."""

import numpy as np
import pytest

from raychan.world.errors import SceneError
from raychan.world.meshes.mesh import Mesh
from raychan.world.shapes import build
from raychan.world.shapes.prism import ears, prism

L = [[0, 0], [4, 0], [4, 1], [1, 1], [1, 3], [0, 3]]
HULL = [[-5, -1.5], [2, -1.6], [6, 0], [2, 1.6], [-5, 1.5], [-4.5, 0]]


def star(count, seed):
    rng = np.random.default_rng(seed)
    turn = (np.arange(count) + rng.uniform(0.1, 0.9, count)) * 2.0 * np.pi / count
    return rng.uniform(0.3, 3.0, count)[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)


def area(plan):
    x, y = np.asarray(plan, float).T
    return 0.5 * abs(x @ np.roll(y, -1) - y @ np.roll(x, -1))


@pytest.mark.parametrize("plan", [L, HULL, *(star(n, n) for n in (3, 4, 5, 17, 120))], ids=len)
@pytest.mark.parametrize("turned", [False, True])
def test_a_prism_is_closed_and_fills_its_outline(plan, turned):
    plan = np.asarray(plan, float)[:: -1 if turned else 1]
    mesh: Mesh = prism(plan, 2.5)
    assert mesh.report.watertight and mesh.report.zero_area == mesh.report.duplicates == 0
    assert mesh.volume() == pytest.approx(2.5 * area(plan))
    assert len(mesh.corners) == 4 * len(plan) - 4
    sides = np.linalg.norm(np.roll(plan, -1, axis=0) - plan, axis=1).sum()
    assert mesh.areas.sum() == pytest.approx(2.0 * area(plan) + 2.5 * sides)


@pytest.mark.parametrize("seed", range(30))
def test_ears_cover_the_polygon_once(seed):
    plan = star(5 + 3 * seed, seed)
    a, b, c = (plan[ears(plan)[:, k]] for k in range(3))
    each = 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    assert (each > 0.0).all() and each.sum() == pytest.approx(area(plan))


def test_corners_on_a_straight_line_add_nothing():
    along = [[0, 0], [1, 0], [2, 0], [4, 0], [4, 1], [1, 1], [1, 2], [1, 3], [0, 3], [0, 1]]
    assert len(prism(along).corners) == len(prism(L).corners)
    comb = [[0, 0], [6, 0], [6, 2], [5, 2], [5, 1], [4, 1], [4, 2], [3, 2], [3, 1], [2, 1], [2, 2], [0, 2]]
    assert prism(comb, 1.0).volume() == pytest.approx(area(comb))


@pytest.mark.parametrize("apart", [0.0, 1e-13, 1e-10])
@pytest.mark.parametrize("twice", range(-1, 6))
@pytest.mark.parametrize("turned", [False, True])
def test_a_corner_given_twice_in_a_row_counts_once(apart, twice, turned):
    plan = [*L, L[0]] if twice < 0 else [*L[: twice + 1], *L[twice:]]
    plan[-1 if twice < 0 else twice] = [x + apart for x in plan[-1 if twice < 0 else twice]]
    mesh = prism(plan[:: -1 if turned else 1], 2.0)
    assert mesh.volume() == pytest.approx(2.0 * area(L)) and len(mesh.corners) == len(prism(L).corners)


def test_an_outline_thinner_than_rounding_has_no_area():
    with pytest.raises(ValueError, match="outline has no area"):
        prism([[0, 0], [1, 0], [1, 1e-10]])


def test_a_scene_file_gives_the_outline_as_a_list():
    assert build("prism", {"outline": L, "height": 3.0}).volume() == pytest.approx(18.0)


@pytest.mark.parametrize(
    "plan",
    [
        [[0, 0], [1, 0]],
        [[0, 0], [1, 0], [2, 0]],
        [[0, 0], [1, 1], [1, 0], [0, 1]],
        [[0, 0], [4, 0], [4, 2], [2, 0], [0, 2]],
        [[0, 0], [2, 0], [2, 1], [3, 0.5], [2, 1], [2, 2], [0, 2]],
        [[0, 0, 0], [1, 0, 0], [0, 1, 0]],
        [[0, 0], [1, float("nan")], [0, 1]],
        ["a", "b", "c"],
    ],
)
def test_an_outline_of_no_body_is_refused(plan):
    with pytest.raises(SceneError, match="outline"):
        build("prism", {"outline": plan})
