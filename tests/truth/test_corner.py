"""Corners against their peaks in closed form, and their footprints against rays."""

from __future__ import annotations

import numpy as np
import pytest
from support.far_field import HEAD_ON, LAM, K, far, sigma

from truth import corner, po


@pytest.mark.parametrize(("a", "b"), [(0.1, 0.1), (0.1, 0.25)])
def test_dihedral_peak(a, b):
    s = corner.corner(corner.dihedral_faces(a, b), K, far(0.0), orders=[(0, 1), (1, 0)])
    assert sigma(s[0, 0]) == pytest.approx(8 * np.pi * a**2 * b**2 / LAM**2)
    assert sigma(s[1, 1]) == pytest.approx(8 * np.pi * a**2 * b**2 / LAM**2)


def test_rolled_dihedral_turns_polarisation():
    """A dihedral whose axis is rolled by psi has VV ~ cos 2 psi and VH ~ sin 2 psi."""
    psi = 0.3
    roll = np.array([[1, 0, 0], [0, np.cos(psi), -np.sin(psi)], [0, np.sin(psi), np.cos(psi)]])
    faces = [f @ roll.T for f in corner.dihedral_faces(0.1, 0.1)]
    s = corner.corner(faces, K, far(0.0), orders=[(0, 1), (1, 0)])
    s = np.abs(s) / np.sqrt(2 * 0.1**4) * LAM
    assert np.allclose(s, [[np.cos(2 * psi), np.sin(2 * psi)], [np.sin(2 * psi), np.cos(2 * psi)]], atol=1e-9)


@pytest.mark.parametrize(("square", "factor"), [(False, 4 / 3), (True, 12.0)])
def test_trihedral_peak(square, factor):
    a = 0.12
    orders = [o for o in corner.sequences(3, 3) if len(o) == 3]
    s = corner.corner(corner.trihedral_faces(a, square), K, far(0.0), orders=orders)
    assert np.allclose(sigma(np.diag(s)), factor * np.pi * a**4 / LAM**2, rtol=1e-9)
    assert abs(s[0, 1]) < 1e-9


@pytest.mark.parametrize("square", [False, True])
@pytest.mark.parametrize("view", [(0.0, 0.0), (0.3, 0.1), (-0.2, 0.25)])
def test_trihedral_footprints_cover_what_rays_hit(view, square):
    """Areas of all lit footprints against rays traced by hand over the same faces."""
    faces, (d, _) = corner.trihedral_faces(1.0, square), far(*view)
    normals = [po.unit_normal(f) for f in faces]
    rng = np.random.default_rng(5)
    count, hits = 40_000, {}
    across = np.linalg.svd(d[None])[2][1:]
    start = 5 * d + rng.uniform(-1.5, 1.5, (count, 2)) @ across
    point, ray = start, np.tile(-d, (count, 1))
    order = np.zeros((count, 0), int)
    for _ in range(3):
        best, which = np.full(len(point), np.inf), np.full(len(point), -1)
        for f, (face, n) in enumerate(zip(faces, normals, strict=True)):
            t = -(point @ n) / (ray @ n)
            hit = point + t[:, None] * ray
            inside = t > 1e-9
            for i in range(len(face)):
                a, b = face[i], face[(i + 1) % len(face)]
                inside &= np.cross(b - a, hit - a) @ n > 0
            closer = inside & (t < best)
            best[closer], which[closer] = t[closer], f
        ok = which >= 0
        point, ray, order = point[ok] + best[ok, None] * ray[ok], ray[ok], np.column_stack([order[ok], which[ok]])
        n = np.array(normals)[which[ok]]
        ray = ray - 2 * np.sum(ray * n, axis=1)[:, None] * n
        for o in {tuple(row) for row in order}:
            hits[o] = int(np.sum(np.all(order == o, axis=1)))
    end = (d, np.inf)
    for o in corner.sequences(3, 3):
        exact = 0.0
        image = d
        for f in o[:-1]:
            image = image - 2 * (image @ normals[f]) * normals[f]
        for sign, part in corner.footprints(faces, o, end, end):
            exact += sign * corner.area(part, normals[o[-1]]) * (image @ normals[o[-1]])
        sampled, spread = hits.get(o, 0) * 9 / count, 9 * np.sqrt(hits.get(o, 0) + 1) / count
        assert abs(exact - sampled) < 5 * spread


def test_one_face_in_another_s_shadow_is_cut_out():
    """A small square in front of a great one leaves the plates' own waves, each where it is seen."""
    great, hole = po.rectangle(0.2, 0.2), po.rectangle(0.06, 0.1) + np.array([0, 0.02, 0])
    small = hole + np.array([0.03, 0, 0])
    s = corner.corner([great, small], K, far(0.0), max_bounces=1)
    by_hand = po.polygon_far(great, K, HEAD_ON) - po.polygon_far(hole, K, HEAD_ON) + po.polygon_far(small, K, HEAD_ON)
    assert np.allclose(s, by_hand, atol=1e-12)


@pytest.mark.parametrize("view", [(0.0, 0.0), (0.2, -0.1)])
def test_corner_from_very_far_is_far(view):
    for faces in (corner.dihedral_faces(0.05, 0.05), corner.trihedral_faces(0.05)):
        d, _ = far(*view)
        near, there = corner.corner(faces, K, (d, 1e5)), corner.corner(faces, K, (d, np.inf))
        assert np.allclose(near, there, atol=2e-4 * np.abs(there).max())


def test_moved_corner_keeps_its_rcs():
    faces = corner.trihedral_faces(0.1)
    shift = np.array([0.3, -0.2, 0.5])
    d, _ = view = far(0.2, 0.1)
    moved = corner.corner([f + shift for f in faces], K, view)
    assert np.allclose(moved, corner.corner(faces, K, view) * np.exp(2j * K * (d @ shift)), atol=1e-9)


def test_mesh_has_the_faces_and_looks_out_of_the_corner():
    for faces, area in ((corner.dihedral_faces(0.1, 0.3), 0.06), (corner.trihedral_faces(0.2), 0.06)):
        m = corner.mesh(faces)
        assert m.area == pytest.approx(area) and np.all(m.face_normals @ HEAD_ON > 0)
