"""Occlusion against rectangles worked out by hand, and against a slow count of where lines of sight go."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from support.facets import box, facets, ground, quad
from support.places import SCENES
from support.points import point

from raychan.records import LAYER, Points
from raychan.tracing.occlusion import occlusion
from raychan.world.scene import Scene

EYE = np.zeros(3)
NONE = Points(
    position=np.zeros((0, 3)), velocity=np.zeros((0, 3)), body=np.zeros(0, int), azimuth=np.array([-np.pi, np.pi]),
    sigma=np.zeros((0, 2)), heading=np.zeros(0),
)  # fmt: skip
GLASS = (LAYER, 6.3 - 0.1j, 4e-3, 0.0)
PEC = (0, 1.0 + 0j, 0.0, 0.0)


def plate(x, left, right, low, high):
    """Upright rectangle at distance x, facing the eye."""
    return quad([[x, left, low], [x, left, high], [x, right, high], [x, right, low]])


def seen(meshes, target=0, **more):
    f = facets(meshes, more.pop("materials", None), role=more.pop("role", None))
    return occlusion(f, more.pop("points", NONE), more.pop("eye", EYE), f"body{target}", **more)


def solid_angle(x, left, right, low, high):
    """Of a rectangle facing the eye: the closed form for one corner under the eye, four times (Khadjavi 1968)."""

    def corner(a, b):
        return np.arctan(a * b / (x * np.sqrt(a * a + b * b + x * x)))

    return corner(right, high) - corner(left, high) - corner(right, low) + corner(left, low)


def rectangle_share(target, others):
    """Share of a rectangle (x, left, right, low, high) hidden by others, in solid angle: cells cut at every edge.

    Rectangles that face the eye stay rectangles when they are projected to the target's plane.
    """
    x, *outline = target
    shadows = [[v * x / o[0] for v in o[1:]] for o in others]
    ys = np.unique(np.clip([*outline[:2], *(s[i] for s in shadows for i in (0, 1))], outline[0], outline[1]))
    zs = np.unique(np.clip([*outline[2:], *(s[i] for s in shadows for i in (2, 3))], outline[2], outline[3]))
    hidden = 0.0
    for y0, y1 in pairwise(ys):
        for z0, z1 in pairwise(zs):
            y, z = 0.5 * (y0 + y1), 0.5 * (z0 + z1)
            if any(a < y < b and c < z < d for a, b, c, d in shadows):
                hidden += solid_angle(x, y0, y1, z0, z1)
    return hidden / solid_angle(*target)


def test_a_plate_half_covered_by_another_is_half_blocked():
    found = seen([plate(10, -1, 1, -1, 1), plate(5, 0, 3, -3, 3)])
    assert found.blocked == pytest.approx(0.5, abs=found.error)
    assert found.error < 0.01
    assert [name for name, _ in found.by] == ["body1"]
    assert found.solid_angle == pytest.approx(solid_angle(10, -1, 1, -1, 1), rel=1e-2)


def test_a_target_in_the_clear_is_not_blocked_and_behind_a_wall_wholly():
    target = box((10, -0.3, 0), (10.3, 0.3, 1.8))
    clear = seen([target, box((12, -3, 0), (13, 3, 4)), ground(height=-0.5)], role=[0, 0, 1])
    assert (clear.blocked, clear.behind_layers, clear.by) == (0.0, 0.0, ())
    hidden = seen([target, box((5, -9, -9), (5.2, 9, 9))])
    assert hidden.blocked == 1.0
    assert hidden.by == (("body1", pytest.approx(1.0)),)
    assert 0.0 < hidden.error < 1e-3, "a gap smaller than a sample goes unseen"


def test_shares_of_blockers_match_rectangles_within_the_stated_error():
    rng = np.random.default_rng(3)
    inside = 0
    for _ in range(60):
        x = rng.uniform(8, 20)
        (y0, z0), (w, h) = rng.uniform(-3, 3, 2), rng.uniform(0.3, 3, 2)
        target = (x, y0, y0 + w, z0, z0 + h)
        others = []
        for _ in range(rng.integers(1, 4)):
            s = rng.uniform(0.3, 0.95)
            a, b = s * (y0 + rng.uniform(-w, w)), s * (z0 + rng.uniform(-h, h))
            others.append((s * x, a, a + s * w * rng.uniform(0.3, 1), b, b + s * h * rng.uniform(0.3, 1)))
        found = seen([plate(*target), *(plate(*o) for o in others)], rays=4000)
        truth = rectangle_share(target, others)
        inside += abs(found.blocked - truth) <= found.error
        assert found.blocked == pytest.approx(truth, abs=0.02)
        assert found.error < 0.03
        assert sum(share for _, share in found.by) == pytest.approx(found.blocked)
    assert inside >= 54  # the stated error is to hold in 95 of 100


def test_the_first_opaque_body_counts_and_glass_is_told_apart():
    target, pane, wall = plate(10, -1, 1, -1, 1), plate(4, -3, 0, -3, 3), plate(6, -0.3, 3, -3, 3)
    found = seen([target, pane, wall], materials=[PEC, GLASS, PEC])
    # The pane covers the left half; the wall, 3/5 of the way, hides what lies right of y = -0.5.
    assert found.by == (("body2", pytest.approx(0.75, abs=0.01)),)
    assert found.behind_layers == pytest.approx(0.25, abs=0.01)
    assert found.blocked + found.behind_layers == pytest.approx(1.0, abs=1e-12)
    opaque = seen([target, pane, wall], materials=[PEC, GLASS, PEC], layers=0)
    assert dict(opaque.by)["body1"] == pytest.approx(0.5, abs=0.01)


def test_a_body_does_not_hide_itself_and_what_touches_it_from_behind_neither():
    front, back = box((10, -1, -1), (11, 1, 1)), box((11, -2, -2), (12, 2, 2))
    assert seen([front, back]).blocked == 0.0
    assert seen([front, back], target=1).blocked > 0.2


def test_far_from_the_origin_and_around_the_eye_it_is_the_same():
    shift = np.array([1e4, -1e4, 0.0])
    meshes = [plate(10, -1, 1, -1, 1), plate(5, 0, 3, -3, 3)]
    near = seen(meshes)
    for m in meshes:
        m.apply_translation(shift)
    assert seen(meshes, eye=shift).blocked == pytest.approx(near.blocked, abs=near.error)
    # A room around the eye fills the sphere; half of it stands behind a screen through which nothing is seen.
    room = box((-9, -9, -9), (9, 9, 9))
    around = seen([room, quad([[1e-3, -9, -9], [1e-3, -9, 9], [1e-3, 9, 9], [1e-3, 9, -9]])])
    assert around.solid_angle == pytest.approx(4 * np.pi, rel=1e-6)
    assert around.blocked == pytest.approx(0.5, abs=max(around.error, 1e-3))


def test_a_plate_seen_edge_on_has_no_outline_and_no_share():
    edge = quad([[9, -1, 0], [11, -1, 0], [11, 1, 0], [9, 1, 0]])
    found = seen([edge, box((5, -9, -9), (5.2, 9, 9))])
    assert (found.solid_angle, found.blocked, found.by) == (0.0, None, ())


def test_the_point_of_a_target_given_by_its_rcs_is_told_apart_from_its_outline():
    target, wall = box((9.9, -1, 0), (10.1, 1, 2)), box((5, 0, -9), (5.2, 9, 9))
    behind = seen([target, wall], points=point((10.0, 0.5, 1.0), 1.0, body=0))
    beside = seen([target, wall], points=point((10.0, -0.5, 1.0), 1.0, body=0))
    assert behind.blocked == beside.blocked == pytest.approx(0.5, abs=0.02)
    assert (behind.point, beside.point, seen([target, wall]).point) == ("body1.whole", "", None)


def test_bodies_that_are_not_there_or_have_no_outline_are_told():
    with pytest.raises(ValueError, match="no body 'body7'; there are body0, body1"):
        seen([plate(10, -1, 1, -1, 1), plate(5, 0, 3, -3, 3)], target=7)
    with pytest.raises(ValueError, match="without an outline"):
        seen([ground(height=-1.0)], role=[1])


def test_the_studys_pedestrian_stands_behind_metal_but_for_head_and_foot():
    scene = Scene.load(SCENES / "occluded_pedestrian.toml")
    found = occlusion(scene.facets(), scene.points(), scene.radar.position, "pedestrian")
    # The scene's comment: 93 % behind metal and tyre, 3 % through a window, 4 % under the car.
    assert found.blocked == pytest.approx(0.93, abs=0.01)
    assert found.behind_layers == pytest.approx(0.03, abs=0.01)
    assert found.by[0][0] == "car"
    assert found.point == "car.front_door_left"
