"""Large meshes have the edges and pieces that small ones have, though other code finds them."""

from __future__ import annotations

import numpy as np
import trimesh

from raychan.geometry.grouping import connected, equal_rows
from raychan.world import pieces as module
from raychan.world.mesh import make_mesh
from raychan.world.pieces import edges, grouped, pieces
from raychan.world.point_in_body import in_plane_of


def test_counted_rows_are_in_the_order_of_sorted_ones() -> None:
    rng = np.random.default_rng(3)
    columns = rng.integers(0, 40, (3, 5000))
    order, run = equal_rows(columns.astype(np.int32), 40)
    expected = grouped(*columns)
    assert np.array_equal(order, expected[0])
    assert np.array_equal(run, expected[1])


def test_joined_pieces_are_those_of_the_graph() -> None:
    rng = np.random.default_rng(4)
    one, other = rng.integers(0, 3000, (2, 2000))
    assert np.array_equal(connected(one, other, 3000), pieces(one, other, 3000))


def test_the_way_to_find_edges_does_not_change_a_mesh(monkeypatch) -> None:
    ball = trimesh.creation.icosphere(subdivisions=3)
    # Doubled faces and a second piece, so that there is something to tell apart.
    faces = np.concatenate([ball.faces, ball.faces[:7, [1, 2, 0]], ball.faces + len(ball.vertices)])
    vertices = np.concatenate([ball.vertices, ball.vertices + np.array([3.0, 0.0, 0.0])])
    few = make_mesh(vertices, faces)
    monkeypatch.setattr(module, "_MANY", 1)
    many = make_mesh(vertices, faces)
    assert many.report == few.report
    assert many.report.duplicates == 7 and many.report.bodies == 2
    for name in ("vertices", "faces", "normals"):
        assert np.array_equal(getattr(many, name), getattr(few, name))
    assert np.array_equal(many.topology.pair, few.topology.pair)
    assert np.array_equal(edges(many.faces)[0], np.argsort(_key(many.faces), kind="stable"))


def test_a_point_in_the_plane_of_facets_is_found_among_the_rounded_planes() -> None:
    rng = np.random.default_rng(5)
    ball = trimesh.creation.icosphere(subdivisions=3)
    for shift in (0.0, 300.0):
        mesh = make_mesh(ball.vertices + shift, ball.faces)
        weights = rng.normal(size=(20, 3))
        corners = mesh.corners[rng.integers(0, len(mesh.faces), 20)]
        for point in np.einsum("ik,ikj->ij", weights / weights.sum(axis=1, keepdims=True), corners):
            assert in_plane_of(mesh.planes_near(point), point) == in_plane_of(mesh._planes_of(slice(None)), point)


def _key(faces: np.ndarray) -> np.ndarray:
    end = np.roll(faces, -1, axis=1)
    return (np.minimum(faces, end).astype(np.int64) * (faces.max() + 1) + np.maximum(faces, end)).ravel()
