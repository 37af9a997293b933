"""Sight by fused loops against slow, obvious forms: rectangles that hide, a mirror's image, points that face an end."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from support.facets import facets, ground, quad

from raychan.columns import take
from raychan.geometry.lit_parts import lit_parts
from raychan.tracing.legs import Leg
from raychan.tracing.mirrors import Mirror
from raychan.tracing.shadow_edges import longest_shadows, shadow_edges_of
from raychan.tracing.tubes import Refinement, launch_tubes
from raychan.tracing.visibility import tube_visibility
from raychan.world.geometry import Geometry

LOW, HIGH = np.array([-0.3, -0.2]), np.array([0.4, 0.5])  # m: a rectangle in the plane x = 4, seen from the origin
RULE = Refinement(wavenumber=1600.0)


def across(x, low, high):
    """Return a rectangle in a plane x, facing the origin."""
    (a, b), (c, d) = low, high
    return quad([[x, a, b], [x, a, d], [x, c, d], [x, c, b]])


def hidden(points, end=(0.0, 0.0, 0.0)):
    """Which straight ways from an end to points beyond the plane x = 4 pass through the rectangle."""
    end = np.asarray(end)
    t = (4.0 - end[0]) / (points[..., 0] - end[0])
    at = (end + t[..., None] * (points - end))[..., 1:]
    return ((at > LOW) & (at < HIGH)).all(axis=-1) & (t > 0.0) & (t < 1.0)


def street(floor, least):
    """Return the rectangle, a plate behind it whose lower edge is at a height, and a floor."""
    plate = across(8.0, (-2.0, least), (2.0, 2.0))
    return Geometry(facets([across(4.0, LOW, HIGH), plate, ground(20.0, floor)]))


def small_tubes(geometry, leg, rng, n=600):
    facet = rng.choice(np.flatnonzero(geometry.facets.body == 1), n).astype(np.int32)
    centre = rng.dirichlet(np.ones(3), (n, 1))
    return launch_tubes(geometry, leg, facet, 0.9 * centre + 0.1 * rng.dirichlet(np.ones(3), (n, 3)))


def test_tubes_behind_a_rectangle_are_seen_as_its_shadow_says():
    geometry = street(-3.0, -2.0)
    leg = Leg(end=np.zeros(3))
    tubes = small_tubes(geometry, leg, np.random.default_rng(1))
    n = len(tubes)
    matters = np.arange(n) % 5 > 0
    view = tube_visibility(geometry, leg, tubes, matters, True, RULE)
    p = tubes.points
    drawn = np.concatenate([p[:, 3:] + 0.98 * (p[:, :3] - p[:, 3:]), p[:, 3:]], axis=1)
    seen = ~hidden(drawn)
    seen[~matters] = seen[~matters, 3:]
    np.testing.assert_array_equal(view.centre.seen, seen[:, 3])
    np.testing.assert_array_equal(view.some, seen.any(axis=1))
    # Where the rectangle's outline runs through a tube of which some is seen, that side of its shadow is found.
    corners = np.array([[4.0, y, z] for y, z in [(LOW[0], LOW[1]), (HIGH[0], LOW[1]), tuple(HIGH), (LOW[0], HIGH[1])]])
    found = (view.side != 0.0).any(axis=1)
    for i in range(n):
        sides = []
        for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            m = np.cross(a, b)
            along = 2.0 * (a + np.linspace(0.0, 1.0, 2001)[:, None] * (b - a))
            inside = np.linalg.solve(p[i, :3].T, along.T).min(axis=0)
            sides.append((p[i, :3] @ m / np.linalg.norm(m), (inside > 1e-9).mean(), (inside > 0.02).any()))
        if found[i]:
            assert matters[i] and seen[i].any()
            assert any(np.allclose(np.abs(view.side[i]), np.abs(s), atol=1e-9) and share > 0.0 for s, share, _ in sides)
        else:
            assert not (matters[i] and seen[i].any() and any(well for _, _, well in sides))
    assert 20 < found.sum() < n // 2
    mixed = (seen.any(axis=1) & ~seen.all(axis=1)) | found
    np.testing.assert_array_equal(view.mixed, mixed)


def test_points_over_a_mirror_are_seen_where_neither_stretch_is_hidden():
    geometry = street(-0.6, -0.5)
    floor = int(np.flatnonzero(geometry.facets.body == 2)[0])
    end = np.array([0.0, 0.0, 0.5])
    leg = Leg(end=end, mirrors=(Mirror.of(geometry, floor, 1.0),))
    points = small_tubes(geometry, leg, np.random.default_rng(2), 2000).points[:, 3]
    facet = np.array([np.flatnonzero(geometry.facets.body == 1)[0]], np.int32).repeat(len(points))
    view = leg.visible(geometry, points, facet, np.full(len(points), 1e-4), 2)
    spot = view.corners[:, 0]
    np.testing.assert_allclose(spot[:, 2], -0.6, atol=1e-12)
    way = np.linalg.norm(spot - end, axis=1) + np.linalg.norm(points - spot, axis=1)
    np.testing.assert_allclose(way, np.linalg.norm(points - [0.0, 0.0, -1.7], axis=1), rtol=1e-14)
    free = ~hidden(spot, end) & ~np.array([hidden(p[None], s)[0] for p, s in zip(points, spot, strict=True)])
    np.testing.assert_array_equal(view.seen, free)
    assert 0 < free.sum() < len(free)


def test_where_nothing_is_an_end_sees_all_points():
    nothing = Geometry(take(facets([ground()]), np.zeros(0, int)))
    view = Leg(end=np.zeros(3)).visible(nothing, np.eye(3), np.full(3, -1, np.int32), np.full(3, 1e-6), 2)
    assert view.seen.all() and (view.passed == -1).all() and (view.blocker == -1).all()
    assert view.corners.shape == (3, 0, 3) and nothing.rays == 0


@pytest.mark.parametrize("end", [(0.0, 0.0, 0.0), (3.0, 4.0, 1.0), (6.0, -4.0, 1.0)])
def test_parts_that_are_lit_are_where_points_face_the_source(end):
    ball = trimesh.creation.icosphere(subdivisions=2, radius=1.0)
    ball.apply_translation((6.0, 0.0, 0.0))
    geometry = Geometry(facets([ball], smooth=True))
    f, end = geometry.facets, np.array(end)
    facet = np.arange(len(f.body), dtype=np.int32)
    shape = f.vertices, f.normals, geometry.edge_curvature, geometry.both_sides
    rows, bary = lit_parts(facet, np.broadcast_to(np.eye(3), (len(facet), 3, 3)).copy(), *shape, end, False)
    rng = np.random.default_rng(3)
    w = rng.dirichlet(np.ones(3), (len(facet), 40))
    xy, yz, zx = (np.roll(w, -i, axis=2)[..., :1] * np.roll(w, -i - 1, axis=2)[..., :1] for i in range(3))
    b = geometry.edge_curvature[:, None]
    p = w @ f.vertices - xy * b[:, :, 0] - yz * b[:, :, 1] - zx * b[:, :, 2]
    normal = w @ f.normals
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    cosine = ((end - p) * normal).sum(axis=2) / np.linalg.norm(end - p, axis=2)
    within = np.zeros(cosine.shape, bool)
    for row, part in zip(rows, bary, strict=True):
        within[row] |= (np.linalg.solve(part.T, w[row].T) > -1e-9).all(axis=0)
    # The terminator is cut as a straight line: near it a point may fall on either side.
    sure = np.abs(cosine) > 0.02
    np.testing.assert_array_equal(within[sure], cosine[sure] > 0.0)
    assert (within & sure).any() and not within.all()


def test_a_tube_far_beside_all_silhouettes_has_no_shadow():
    # The grid of the silhouettes' directions spans 1 mm; the wall, 160 degrees.
    crumb = trimesh.creation.box(extents=(1e-3, 1e-3, 1e-3))
    crumb.apply_translation((4.0, 0.0, 0.0))
    wide = across(6.0, (-30.0, -30.0), (30.0, 30.0))
    geometry = Geometry(facets([crumb, wide], role=[0, 1]))
    leg = Leg(end=np.zeros(3))
    tubes = small_tubes(geometry, leg, np.random.default_rng(3))
    side, slack = np.zeros((len(tubes), 3)), np.full(len(tubes), 1e-5)
    facets_of = geometry.normal, geometry.smooth, geometry.touch
    longest_shadows(tubes.points, tubes.facet, slack, *facets_of, shadow_edges_of(geometry, leg), side)
    y, z = tubes.points[..., 1], tubes.points[..., 2]
    clear = (np.hypot(y, z) > 20.0).all(axis=1) & ((y > 1.0).all(axis=1) | (z > 1.0).all(axis=1))
    assert clear.sum() > 20
    assert not side[clear].any()


def test_a_body_that_runs_into_a_plate_hides_it_up_to_the_line_where_they_meet():
    # Seen from a little below the slab: rays past its front face end on its underside, which few tubes meet.
    slab = trimesh.creation.box(extents=(0.4, 2.0, 0.3))
    slab.apply_translation((8.0, 0.0, 0.35))
    geometry = Geometry(facets([slab, across(8.0, (-0.5, -1.0), (0.5, 1.0))]))
    leg = Leg(end=np.zeros(3))
    tubes = small_tubes(geometry, leg, np.random.default_rng(4))
    view = tube_visibility(geometry, leg, tubes, np.ones(len(tubes), bool), True, RULE)
    z = tubes.points[:, :3, 2] - 0.2
    # Of tubes that the slab's upper edge, at 0.51 m, does not reach, and of which no ray ends on its underside.
    rows = (z.min(axis=1) < -1e-3) & (z.max(axis=1) > 6e-3) & (z.max(axis=1) < 0.3) & view.mixed
    rows &= ~(np.abs(tubes.points[..., 2] - 0.203) < 3e-3).any(axis=1)
    assert rows.sum() > 20
    side, z = (x / x[:, np.abs(x[0]).argmax()][:, None] for x in (view.side[rows], z[rows]))
    np.testing.assert_allclose(side, z, rtol=1e-9, atol=1e-9)
