"""Broken meshes end well: finite figures or an error that says what is wrong, and what was mended is told."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from support.broken_meshes import broken_mesh
from typer.testing import CliRunner

import raychan as rc
from raychan.cli import app
from raychan.geometry.edge_grid import grid_bounds
from raychan.run.cross_section.scattering import scattering
from raychan.run.cross_section.single_body import facets_of
from raychan.tracing.legs import Leg
from raychan.tracing.shadow_edges import longest_shadows, shadow_edges_of
from raychan.tracing.tubes import Refinement
from raychan.units import C0
from raychan.world.errors import SceneError
from raychan.world.geometry import Geometry
from raychan.world.mesh_files.mesh_io import SUFFIXES, from_trimesh, load
from raychan.world.meshes.mesh import make_mesh, smooth_normals

F = 77e9


@pytest.mark.parametrize("seed", range(300, 340))
def test_normals_of_a_broken_mesh_are_unit_vectors(seed):
    try:
        mesh = from_trimesh(broken_mesh(seed))
    except SceneError as e:
        assert e.allowed
        return
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=2), 1.0, atol=1e-9)
    assert np.isfinite(mesh.corners).all()


@pytest.mark.parametrize("seed", [3, 5, 6, 8, 12, 13, 14, 17])
def test_the_cross_section_of_a_broken_mesh_is_a_number(seed):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            found = rc.rcs(
                broken_mesh(seed), F, [0.0, 217.3], [0.0, 11.0], tolerance_db=3.0, max_rays=5000, max_bounces=2
            )
        except SceneError as e:
            assert e.allowed
            return
    assert np.isfinite(found.sigma).all() and (found.sigma >= 0.0).all() and np.isfinite(found.amplitude).all()
    # No figure is an error only where the launches tell nothing.
    assert not np.isinf(found.error_db).any() and (found.error_db[found.converged] >= 0.0).all()


def test_a_corner_at_which_a_surface_folds_back_on_itself_keeps_the_normals_of_its_facets():
    """Four facets about one point, of which two and two lie on each other: smoothed, their normals cancel."""
    v = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 1e-13], [0, 1, 1e-13]], float)
    normals = smooth_normals(v, np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]]), crease_deg=190.0)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=2), 1.0, atol=1e-12)


@pytest.mark.parametrize("size", [1e146, 1e9, 1e-9, 1e-200])
def test_a_mesh_of_a_size_that_no_radar_sees_is_an_error(size):
    box = trimesh.creation.box()
    with pytest.raises(SceneError, match="check unit and scale"):
        make_mesh(box.vertices * size, box.faces)


def test_faces_of_vertices_that_are_not_there_are_an_error():
    box = trimesh.creation.box()
    for wrong in (8, -1):
        faces = np.concatenate([box.faces, [[0, 1, wrong]]])
        with pytest.raises(SceneError, match="1 faces name vertices that are not there"):
            make_mesh(box.vertices, faces)


def test_a_vertex_of_no_face_changes_nothing():
    box = trimesh.creation.box()
    mesh = make_mesh(np.concatenate([box.vertices, [[1e30, 0, 0]]]), box.faces)
    assert mesh.report.watertight and mesh.report.size == (1.0, 1.0, 1.0)


def test_a_grid_of_edges_ignores_a_spike():
    rng = np.random.default_rng(1)
    middle = np.concatenate([rng.normal(size=(1000, 3)), [[3e4, 2e4, -1e4]]])
    low, high, cut_off = grid_bounds(middle, middle.min(axis=0), middle.max(axis=0))
    assert cut_off and np.ptp([low, high]) < 50.0
    same = grid_bounds(middle[:-1], middle[:-1].min(axis=0), middle[:-1].max(axis=0))
    assert not same[2] and (same[0] == middle[:-1].min(axis=0)).all()


def test_shadows_across_a_body_are_those_of_the_body_without_its_spike():
    """A speck far off, edge-on, cuts off the grid of directions: every shadow edge is found nevertheless."""
    bodies = [trimesh.creation.icosphere(subdivisions=3, radius=0.6), trimesh.creation.box((0.4, 0.5, 0.3))]
    bodies[1].apply_translation((2.0, 0.3, 0.1))
    speck = trimesh.Trimesh([[0, 9e3, 0], [1, 9e3, 0], [0, 9e3 + 1, 0]], [[0, 1, 2]], process=False)
    rng = np.random.default_rng(2)
    points = (
        rng.uniform(-0.8, 0.8, (400, 1, 3)) * (0, 1, 1) + rng.uniform(-0.15, 0.15, (400, 4, 3)) * (0, 1, 1) - (3, 0, 0)
    )
    points[:, 3] = points[:, :3].mean(axis=1)
    look = np.array([1.0, 0.0, 0.0])
    found = []
    for parts in (bodies, [*bodies, speck]):
        geometry = Geometry(facets_of(trimesh.util.concatenate(parts), "pec", F))
        facet = np.full(400, int(np.argmax(geometry.normal[: len(bodies[0].faces)] @ look)), np.int32)
        side, edges = np.zeros((400, 3)), shadow_edges_of(geometry, Leg(end=look, far=True))
        longest_shadows(points, facet, np.zeros(400), geometry.normal, geometry.smooth, geometry.touch, edges, side)
        found.append(side)
    assert (found[0] != 0.0).any()
    np.testing.assert_allclose(found[1], found[0], atol=1e-9)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_file_of_no_bytes_is_told_to_be_empty(suffix, tmp_path):
    file = tmp_path / f"car{suffix}"
    file.touch()
    with pytest.raises(SceneError, match=f"car{suffix}: the file is empty: 0 bytes; allowed: a valid {suffix}"):
        load(file)


def test_the_command_tells_what_was_mended_and_ends_well(tmp_path):
    box = trimesh.creation.box()
    file = tmp_path / "twice.ply"
    trimesh.Trimesh(box.vertices, np.concatenate([box.faces, box.faces[:3], [[0, 0, 1]]]), process=False).export(file)
    ran = CliRunner().invoke(app, ["rcs", str(file)])
    assert ran.exit_code == 0
    assert "1 faces of zero area dropped" in ran.output and "3 duplicate faces dropped" in ran.output


@pytest.mark.parametrize("argv", [["run", "{}", "--out", "out"], ["view", "{}", "--screenshot", "a.png"]])
def test_a_mesh_where_a_scene_is_wanted_is_told(argv, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "box.ply"
    trimesh.creation.box().export(file)
    ran = CliRunner().invoke(app, [word.format(file) for word in argv])
    assert ran.exit_code == 2 or isinstance(ran.exception, SceneError)
    assert "is a mesh, not a scene" in f"{ran.output} {ran.exception}"
    assert [p.name for p in tmp_path.iterdir()] == ["box.ply"]


def test_a_launch_that_its_budget_cut_short_says_so():
    geometry = Geometry(facets_of(trimesh.creation.icosphere(subdivisions=2, radius=0.5), "pec", F))
    leg = Leg(end=np.array([1.0, 0.0, 0.0]), far=True)
    fine = Refinement(wavenumber=2.0 * np.pi * F / C0, max_edge=0.02)
    scattering(geometry, leg, leg, F, 1, replace(fine, max_tubes=10_000_000))
    assert geometry.uncut == 0
    scattering(geometry, leg, leg, F, 1, replace(fine, max_tubes=1000))
    assert geometry.uncut > 0
