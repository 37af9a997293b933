"""Edges of curved facets whose normals contradict them, as corners rounded by a file do on a fine mesh."""

from __future__ import annotations

import numpy as np
import pytest

from raychan.geometry.triangles import edge_curvatures


def middles(v, n):
    """Return the middles (m, 3, 3) of the curved edges of facets with corners and corner normals (m, 3, 3)."""
    return 0.5 * (v + np.roll(v, -1, axis=1)) - 0.25 * edge_curvatures(v, n)[0]


@pytest.mark.parametrize("edge", [0.02, 2e-3, 1.2e-3, 5e-4])
def test_edges_on_a_sphere_lie_on_it_whatever_single_precision_makes_of_its_corners(edge):
    """Radius 0.5 m: rounding moves corners by 3e-8 m, to which an edge of 1 mm rises by 2.5e-7 m."""
    rng = np.random.default_rng(1)
    out = rng.normal(size=(4000, 3))
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    v = 0.5 * out[:, None] + edge * rng.uniform(-1.0, 1.0, (4000, 3, 3))
    n = v / np.linalg.norm(v, axis=2, keepdims=True)
    v = (0.5 * n).astype(np.float32).astype(float)
    off = np.linalg.norm(middles(v, n), axis=2) - 0.5
    rise = np.linalg.norm(v - np.roll(v, -1, axis=1), axis=2) ** 2 / (8.0 * 0.5)
    # What rounds the corners rounds the middle, and curvature along an edge moves it by no more than it rises.
    assert (np.abs(off) < 6e-8 + 0.3 * rise * (edge / 0.5 + 1e-3)).all()


def test_an_edge_over_an_inflection_bends_as_both_ends_do_in_the_mean():
    """Z = x^3 from -0.3 to 1: the middle of the edge is that of the cubic through both ends with their slopes."""
    x = np.array([-0.3, 1.0, 0.35])
    v = np.stack([x, np.zeros(3), x**3], axis=1)
    v[2, 1] = 1.0
    slope = 3.0 * x**2
    n = np.stack([-slope, np.zeros(3), np.ones(3)], axis=1) / np.hypot(slope, 1.0)[:, None]
    n[2] = n[0] + n[1]
    n[2] /= np.linalg.norm(n[2])
    bent = middles(v[None], n[None])[0, 0]
    straight = 0.5 * (v[0] + v[1])
    assert abs(bent[2] - bent[0] ** 3) < 0.6 * abs(straight[2] - straight[0] ** 3)
    # Slopes that are alike at both ends bend it to neither side.
    even = np.broadcast_to([[[-0.2, 0.0, 1.0]]], (1, 3, 3)) / np.hypot(0.2, 1.0)
    assert np.abs(middles(v[None] * [1.0, 1.0, 0.0], even)[0, 0] - 0.5 * (v[0] + v[1]) * [1.0, 1.0, 0.0]).max() < 1e-12


def test_both_facets_of_an_edge_draw_it_alike():
    rng = np.random.default_rng(2)
    v, n = rng.normal(size=(500, 3, 3)), rng.normal([0.0, 0.0, 2.0], size=(500, 3, 3))
    n /= np.linalg.norm(n, axis=2, keepdims=True)
    forth, back = middles(v, n)[:, 0], middles(v[:, ::-1].copy(), n[:, ::-1].copy())[:, 1]
    assert np.abs(forth - back).max() < 1e-12
    bend = np.linalg.norm(edge_curvatures(v, n)[0][:, 0], axis=1)
    chord = np.linalg.norm(v[:, 1] - v[:, 0], axis=1)
    assert (bend <= chord * np.linalg.norm(n[:, 1] - n[:, 0], axis=1) * (1.0 + 1e-9)).all()
