"""Edges, equal rows and connected pieces of meshes, against sorting and a library's graphs."""

from __future__ import annotations

import numpy as np
import trimesh
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from raychan.world.meshes.mesh import make_mesh
from raychan.world.meshes.pieces import edges, grouped, pieces
from raychan.world.point_in_body import in_plane_of


def test_equal_rows_are_in_the_order_of_sorted_ones() -> None:
    columns = np.random.default_rng(3).integers(0, 40, (3, 5000))
    order, run = grouped(*columns)
    assert np.array_equal(order, np.lexsort(columns[::-1]))
    assert np.array_equal(run, np.unique(columns[:, order], axis=1, return_inverse=True)[1].ravel())


def test_of_no_rows_there_is_no_order() -> None:
    assert [len(x) for x in grouped(*np.zeros((2, 0), np.int64))] == [0, 0]
    assert len(pieces(*np.zeros((2, 0), np.int64), 0)) == 0


def test_joined_pieces_are_those_of_the_graph() -> None:
    one, other = np.random.default_rng(4).integers(0, 3000, (2, 2000))
    graph = coo_matrix((np.ones(len(one)), (one, other)), shape=(3000, 3000))
    assert np.array_equal(pieces(one, other, 3000), connected_components(graph, directed=False)[1])


def test_edges_of_a_mesh_with_doubled_faces_and_two_pieces_are_in_the_order_of_their_ends() -> None:
    ball = trimesh.creation.icosphere(subdivisions=3)
    faces = np.concatenate([ball.faces, ball.faces[:7, [1, 2, 0]], ball.faces + len(ball.vertices)])
    vertices = np.concatenate([ball.vertices, ball.vertices + np.array([3.0, 0.0, 0.0])])
    mesh = make_mesh(vertices, faces)
    assert mesh.report.duplicates == 7 and mesh.report.bodies == 2
    assert np.array_equal(edges(mesh.faces)[0], np.argsort(_key(mesh.faces), kind="stable"))


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
