"""Finely tessellated smooth surfaces are simplified within the limits asked for, and nothing else is."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from support.fine_surfaces import ball, ellipsoid, half_ball, off_ball, off_torus, on_patches, torus

import raychan as rc
from raychan.geometry.triangles import edge_curvatures
from raychan.parallel import run_pair
from raychan.units import C0
from raychan.world.geometry import geometry_of
from raychan.world.meshes.mesh import make_mesh
from raychan.world.meshes.simplify import simplify
from raychan.world.meshes.surface_check import Check
from raychan.world.near_surfaces import near_surfaces
from raychan.world.simplified import limits_of, traced_alone, traced_mesh, traced_scene

F = 24e9
K = 2.0 * np.pi * F / C0


def simplified(mesh, tolerance_db=0.5):
    """Return a mesh simplified as one that hides nothing, by fewer facets than among others."""
    limits = limits_of(K, tolerance_db, float(np.linalg.norm(np.ptp(mesh.bounds, axis=0))))
    simple = simplify(mesh, limits._replace(sag=C0 / F / 8.0), np.zeros(len(mesh.faces), bool))
    assert simple is not None
    return simple[0]


@pytest.mark.parametrize(("name", "tolerance"), [("ball", 0.15), ("ball", 0.5), ("torus", 0.5), ("torus", 1.0)])
def test_every_point_of_the_simplified_surface_is_as_near_to_the_body_as_the_tolerance_asks_for(name, tolerance):
    """The distance is the closed form of the body itself; that of the whole mesh's curved facets comes on top."""
    mesh, off = (ball(), off_ball) if name == "ball" else (torus(), off_torus)
    found, rng = simplified(mesh, tolerance), np.random.default_rng(1)
    limits = limits_of(K, tolerance, float(np.linalg.norm(np.ptp(mesh.bounds, axis=0))))
    assert len(found.mesh.faces) < 0.5 * len(mesh.faces)
    assert 0.0 < found.deviation <= limits.deviation
    own = off(on_patches(mesh, 3, rng)).max()
    assert off(on_patches(found.mesh, 40, rng)).max() <= found.deviation + own


@pytest.mark.parametrize("mesh", [ball(known=False), torus(), ellipsoid()], ids=["ball", "torus", "ellipsoid"])
def test_vertices_that_stay_keep_place_and_normal_and_the_surface_stays_closed(mesh):
    found = simplified(mesh)
    coarse = found.mesh
    assert np.array_equal(coarse.corners.reshape(-1, 3), mesh.corners.reshape(-1, 3)[found.corner.ravel()])
    assert np.array_equal(coarse.normals.reshape(-1, 3), mesh.normals.reshape(-1, 3)[found.corner.ravel()])
    euler = [len(m.vertices) - len(m.faces) // 2 for m in (mesh, coarse)]
    assert euler[0] == euler[1]
    assert len(coarse.topology.rim) == 0
    assert len(np.unique(coarse.topology.piece)) == 1
    assert coarse.volume() == pytest.approx(mesh.volume(), rel=0.03)


def test_flat_facets_lie_no_deeper_under_the_body_than_shadows_may_move():
    """Edges by the limit, middles of equilateral facets by 4/3 of it."""
    found, rng = traced_mesh(ball(6), K, 1.0), np.random.default_rng(2)
    share = rng.dirichlet(np.ones(3), (len(found.mesh.faces), 20))
    assert found.sag == limits_of(K, 1.0, np.sqrt(3.0)).sag < C0 / F / 8.0
    assert off_ball(np.einsum("fpk,fkc->fpc", share, found.mesh.corners).reshape(-1, 3)).max() < 1.6 * found.sag


def test_a_convex_body_alone_needs_fewer_facets_since_it_hides_nothing():
    mesh = ball(6)
    alone, among = traced_alone(mesh, K, 1.0), traced_mesh(mesh, K, 1.0)
    assert alone.merged is not None and alone.merged.shadow == 0.0
    assert len(alone.mesh.faces) < 0.7 * len(among.mesh.faces)


def test_finer_meshes_of_one_body_end_at_about_the_same_number_of_facets():
    few, many = (len(simplified(ball(n)).mesh.faces) for n in (5, 6))
    assert 0.7 < many / few < 1.3


def hard_edges(mesh):
    """Return the edges, by their ends, where the part changes or corner normals differ."""
    pair, part = mesh.topology.pair, mesh.part
    a, b = pair.T
    v, n = mesh.corners.reshape(-1, 3), mesh.normals.reshape(-1, 3)
    after = a - a % 3 + (a + 1) % 3
    back = b - b % 3 + (b + 1) % 3
    hard = (part[a // 3] != part[b // 3]) | (np.abs(n[a] - n[back]).max(axis=1) > 1e-2)
    ends = np.stack([v[a], v[after]], axis=1)[hard]
    return {tuple(map(tuple, np.round(sorted(e.tolist()), 9))) for e in ends}


def test_no_edge_of_a_part_or_of_the_body_goes():
    cut = ball(part=lambda centre: (centre[:, 2] > 0.31).astype(np.int32), part_names=("low", "high"))
    lid = half_ball()
    for mesh in (cut, lid):
        found = simplified(mesh)
        assert len(hard_edges(mesh)) > 100
        assert hard_edges(found.mesh) == hard_edges(mesh)
        for part in np.unique(mesh.part):
            assert found.mesh.areas[found.mesh.part == part].sum() == pytest.approx(
                mesh.areas[mesh.part == part].sum(), rel=0.03
            )


def test_open_surfaces_keep_their_boundary():
    whole = ball(6)
    top = whole.faces[(whole.vertices[whole.faces][:, :, 2] > -1e-9).all(axis=1)]
    bowl = make_mesh(whole.vertices, top, normals=whole.vertices[top] / 0.5)
    found = simplified(bowl)
    lengths = [np.linalg.norm(np.diff(m.corners.reshape(-1, 3)[ends_of(m)], axis=1)) for m in (bowl, found.mesh)]
    assert len(found.mesh.topology.rim) == len(bowl.topology.rim)
    assert lengths[0] == pytest.approx(lengths[1], rel=1e-12)


def ends_of(mesh):
    rim = np.sort(mesh.topology.rim)
    return np.stack([rim, rim - rim % 3 + (rim + 1) % 3], axis=1)


def test_a_surface_with_normals_that_contradict_it_stays_as_it_is():
    """By half a degree, at random: what its curved surface is is not known."""
    good, rng = ball(), np.random.default_rng(3)
    turned = good.vertices / 0.5 + rng.normal(0.0, np.radians(0.5), good.vertices.shape)
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    assert traced_mesh(make_mesh(good.vertices, good.faces, normals=turned[good.faces]), K, 0.5) is None


def test_facets_whose_folds_may_be_edges_stay_as_they_are():
    """The hull of random points on a sphere: no regular tessellation."""
    points = np.random.default_rng(4).normal(size=(11_000, 3))
    hull = trimesh.convex.convex_hull(0.5 * points / np.linalg.norm(points, axis=1, keepdims=True))
    mesh = make_mesh(hull.vertices, hull.faces)
    assert len(mesh.faces) > 20_000
    assert traced_mesh(mesh, K, 0.5) is None


def test_fixed_facets_stay():
    mesh = ball()
    fixed = mesh.corners[:, :, 0].mean(axis=1) > 0.3
    found = simplify(mesh, limits_of(K, 0.5, 1.0)._replace(sag=C0 / F / 8.0), fixed)
    assert found is not None
    kept = {tuple(c.ravel()) for c in np.sort(found[0].mesh.corners, axis=1)}
    assert {tuple(c.ravel()) for c in np.sort(mesh.corners[fixed], axis=1)} <= kept


def test_one_thread_and_two_simplify_alike():
    two = simplify(torus(), limits_of(K, 0.5, 1.3), np.zeros(57_600, bool))
    one, _ = run_pair(lambda: simplify(torus(), limits_of(K, 0.5, 1.3), np.zeros(57_600, bool)), wait)
    assert one is not None and two is not None
    assert np.array_equal(one[0].corner, two[0].corner)
    assert one[0].deviation == two[0].deviation


def wait():
    """Last as long as it takes to simplify, so that the other of a pair has one thread only."""
    import time

    time.sleep(5.0)


@pytest.mark.parametrize(("gap", "apart"), [(0.2e-3, False), (20e-3, True)])
def test_skins_of_a_thin_sheet_do_not_cross(gap, apart):
    """Flat facets lie up to 0.7 mm under their curved ones at 1 dB and 24 GHz: skins 0.2 mm apart stay as they are."""
    outer = ball(6)
    n, unit = len(outer.vertices), outer.vertices / 0.5
    faces = np.concatenate([outer.faces, outer.faces[:, ::-1] + n])
    both = np.concatenate([unit, -unit])
    mesh = make_mesh(np.concatenate([outer.vertices, (0.5 - gap) * unit]), faces, normals=both[faces])
    found = traced_mesh(mesh, K, 1.0)
    assert (found is not None) == apart
    if found is not None:
        assert not near_surfaces(found.mesh, 0.5 * found.sag).any()


def test_scenes_that_come_with_raychan_are_traced_as_they_are():
    for name in ("urban", "living_street", "occluded_pedestrian"):
        scene = rc.Scene.load(name)
        assert traced_scene(scene, None) == (scene, None)


def test_meshes_that_are_not_simplified_are_traced_as_they_are():
    small, large = ball(4), ball()
    assert traced_alone(small, K, 0.5).mesh is small
    assert traced_alone(large, K, None).mesh is large
    assert traced_alone(large, K, 0.5).mesh is not large
    # No finer than shadows ask for at 0.1 dB.
    assert traced_mesh(large, K, 0.1) is None
    scene = rc.Scene(bodies=[rc.Body(name="ball", mesh=large)], frequency=F, model={"simplify": False})
    assert geometry_of(scene).merged is None


def test_a_moving_body_is_simplified_once():
    body = rc.Body(name="ball", mesh=ball(6), position=(5, 0, 0), velocity=(1, 0, 0))
    scene = rc.Scene(bodies=[body], frequency=F, model={"tolerance_db": 1.0})
    meshes = [traced_scene(s, None)[0].bodies[0].geometry for s in (scene, scene.at(0.1), scene.at(0.2))]
    assert meshes[0] is meshes[1] is meshes[2]
    assert scene.bodies[0].geometry is not meshes[0]
    assert geometry_of(scene) is geometry_of(scene)
    assert str(geometry_of(scene).merged).startswith("81,920 facets merged into ")


@pytest.mark.parametrize("turn", [0.02, 0.1, 0.3])
def test_a_curved_edge_over_a_chord_of_a_circle_is_off_by_length_times_turn_cubed_over_128(turn):
    """What edges of a simplified mesh are limited by before any point is checked."""
    ends = np.array([[np.cos(t), np.sin(t), 0.0] for t in (-0.5 * turn, 0.5 * turn)])
    v = np.vstack([ends, [1.0, 0.0, turn]])
    edge = edge_curvatures(v[None], np.vstack([ends, ends.mean(axis=0)])[None])[0][0, 0]
    middle = ends.mean(axis=0) - 0.25 * edge
    length, off = np.linalg.norm(ends[1] - ends[0]), abs(np.linalg.norm(middle) - 1.0)
    assert off == pytest.approx(length * turn**3 / 128.0, rel=0.03)


def test_a_balls_rounds_of_removals_need_no_redo(monkeypatch):
    """Edges that would fail the check do not come."""
    checks, real = [], Check.__call__

    def counted(check, net, heir, limits):
        off, most = real(check, net, heir, limits)
        checks.append(most)
        return off, most

    monkeypatch.setattr(Check, "__call__", counted)
    found = simplified(ball(6), 0.15)
    assert max(checks) <= 1.0
    assert len(found.mesh.faces) < 0.25 * 81_920
