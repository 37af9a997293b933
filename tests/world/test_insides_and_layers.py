"""What a wave can enter has an inside; a thing drawn as one body, or as several, is the same thing."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from support.facets import box, facets, quad
from support.points import no_points
from truth import slab

import raychan as rc
from raychan.records import HALF_SPACE, LAYER, PEC, Facets
from raychan.run.solver import solve
from raychan.run.specular_paths import jones, specular_routes
from raychan.tracing.settings import refinement
from raychan.units import C0
from raychan.world.backed_layers import backed
from raychan.world.geometry import Geometry, geometry_of

F = 77e9
K = 2 * np.pi * F / C0
GLASS, THICK = 6.27 - 0.35j, 4e-3
ROWS = {
    "glass": (LAYER, GLASS, THICK, 0.0),
    "thin": (LAYER, 2.5 - 0.01j, 3e-3, 0.0),
    "metal": (PEC, 1.0, 0.0, 0.0),
    "stone": (HALF_SPACE, 5.24 - 0.31j, 0.0, 0.0),
}
SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def split(sheets):
    """Facets of sheets (mesh, material), a body each."""
    return facets([m for m, _ in sheets], [ROWS[name] for _, name in sheets])


def joined(f: Facets) -> Facets:
    """Return the same facets as parts of one body."""
    one = {name: getattr(f, name)[:1] for name in ("role", "origin", "velocity", "spin")}
    names = tuple(f"part{i}" for i in range(len(f.role)))
    return f.replace(body=0 * f.body, part=f.body, body_names=("all",), part_names=names, **one)


def walls(size, at=(0.0, 0.0, 0.0)):
    """Return the six sides of a box as quads, each facing outward: the first looks to -x."""
    a, b, c = 0.5 * np.asarray(size, float)
    p = np.array([[x, y, z] for x in (-a, a) for y in (-b, b) for z in (-c, c)]) + at
    return [quad(p[list(side)]) for side in SIDES]


def paths(f, bounces, tolerance=0.5, jitter=0.0, end=(0.0, 0.0, 0.0)):
    field = lambda d: np.broadcast_to([0.0, 0.0, 1.0], d.shape)  # noqa: E731
    radar = SimpleNamespace(position=np.array(end), velocity=np.zeros(3), tx_field=field, rx_field=field)
    return solve(f, no_points(), radar, F, refinement(F, tolerance, layers=4, jitter=jitter), bounces)[0]


def profile(p, ranges, width=0.15):
    """Amplitudes at ranges of a receiver whose cells are Gaussians."""
    away = (p.range[None] - ranges[:, None]) / width
    return np.exp(-(away**2)) @ p.amplitude


def at_range(p, distance, width=0.1):
    return p.amplitude[np.abs(p.range - distance) < width].sum()


@pytest.mark.parametrize("back", ["glass", "metal"])
@pytest.mark.parametrize("one", [True, False])
def test_a_glass_box_returns_its_front_and_through_it_its_back(back, one):
    near, deep, size = 9.0, 1.2, 0.4
    sides = walls((deep, size, size), (near + 0.5 * deep, 0.0, 0.0))
    f = split([(m, back if i == 1 else "glass") for i, m in enumerate(sides)])
    p = paths(joined(f) if one else f, 1)
    alone = [paths(split([(sides[i], name)]), 1) for i, name in ((0, "glass"), (1, back))]
    _, _, t_s, _ = slab.layer(1.0, GLASS, THICK, K)
    for distance, alike, factor in ((near, alone[0], 1.0), (near + deep, alone[1], t_s**2)):
        wanted = at_range(alike, distance) * factor
        assert abs(at_range(p, distance) / wanted - 1.0) < 0.01


def test_two_mirrors_at_right_angles_return_once_whether_of_one_body_or_two():
    half, low = 0.7, np.array([8.0, 0.0, -0.5])
    one = quad(low + np.array([[0, 0, 0], [0, 0, 1], [-half, half, 1], [-half, half, 0]]))
    two = quad(low + np.array([[0, 0, 0], [-half, -half, 0], [-half, -half, 1], [0, 0, 1]]))
    f = split([(one, "metal"), (two, "metal")])
    a, b = (at_range(paths(x, 2), 8.0, 0.3) for x in (joined(f), f))
    assert abs(b / a - 1.0) < 0.002


def random_sheets(rng):
    """Sides of a box, of an L, or of a prism, each of some material, and perhaps a plate within or before it."""
    turn = trimesh.transformations.euler_matrix(*rng.uniform(-0.15, 0.15, 2), rng.uniform(-np.pi, np.pi))[:3, :3]
    at = np.array([rng.uniform(5.0, 7.0), *rng.uniform(-0.4, 0.4, 2)])
    n, tall = int(rng.integers(3, 7)), rng.uniform(0.3, 0.5)
    angle = 2.0 * np.pi * (np.arange(n) + rng.uniform()) / n
    ring = rng.uniform(0.4, 0.6) * np.column_stack([np.cos(angle), np.sin(angle)])
    low, high = (np.column_stack([ring, np.full(n, z)]) for z in (-tall, tall))
    sides = [np.array([low[i], low[i - n + 1], high[i - n + 1], high[i]]) for i in range(n)]
    plate = 0.2 * np.array([[0, -1, -1], [0, -1, 1], [0, 1, 1], [0, 1, -1]]) + rng.uniform(-0.1, 0.1, 3)
    kinds = rng.choice(list(ROWS), n + 3, p=[0.5, 0.15, 0.25, 0.1])
    meshes = [quad(p @ turn.T + at) for p in [*sides, plate]]
    for cap, order in ((low, -1), (high, 1)):
        fan = np.array([[0, i, i + 1][::order] for i in range(1, n - 1)])
        meshes.append(trimesh.Trimesh(cap @ turn.T + at, fan, process=False))
    return list(zip(meshes, kinds, strict=True))


@pytest.mark.parametrize("seed", range(6))
def test_random_things_of_panes_and_metal_are_the_same_joined_or_split(seed):
    f = split(random_sheets(np.random.default_rng(seed)))
    ranges = np.arange(4.0, 9.0, 0.1)
    one, several = (profile(paths(x, 2), ranges) for x in (joined(f), f))
    coarse = profile(paths(f, 2, 1.5, 0.13), ranges)
    strong = np.abs(one) > 1e-2 * np.abs(one).max()
    off = np.abs(one - several)[strong]
    assert (off <= 2.0 * np.abs(several - coarse)[strong] + 0.01 * np.abs(one)[strong]).all()


def test_what_nothing_can_enter_keeps_one_side():
    shell, inner = walls((2.0, 2.0, 2.0)), box((-0.3, -0.3, -0.3), (0.3, 0.3, 0.3))
    sheets = [(m, "glass" if i == 1 else "metal") for i, m in enumerate(shell)] + [(inner, "metal")]
    geometry = Geometry(joined(split(sheets)))
    np.testing.assert_array_equal(geometry.both_sides, geometry.facets.part < 6)
    doubled = trimesh.util.concatenate([shell[0], trimesh.Trimesh(shell[0].vertices, shell[0].faces[:, ::-1])])
    assert Geometry(facets([doubled])).both_sides.all()
    assert not Geometry(facets([inner])).both_sides.any()


def test_the_cabin_of_a_car_has_two_sides_and_its_sheet_metal_one():
    geometry = geometry_of(rc.Scene(bodies=[rc.Body(name="car", shape="car")]))
    f = geometry.facets
    of = {name: geometry.both_sides[f.part == i] for i, name in enumerate(f.part_names)}
    assert of["roof"].all() and of["windscreen"].all() and of["pillars"].all()
    assert not any(of[name].any() for name in ("tail", "hood", "floor", "seats", "plate", "rim_front_left"))


def test_bodies_that_move_as_one_hang_together_where_they_touch():
    f = split([(m, "glass") for m in walls((1.0, 1.4, 1.2))])
    assert set(Geometry(f).piece) == {0}
    moving = f.replace(velocity=f.velocity + np.where(np.arange(6)[:, None] == 3, [1.0, 0.0, 0.0], 0.0))
    piece = Geometry(moving).piece
    assert len(set(piece)) == 2
    assert set(moving.body[piece == piece[moving.body == 3][0]]) == {3}


@pytest.mark.parametrize("turned", [0, 1])
@pytest.mark.parametrize("one", [True, False])
def test_a_pane_upon_metal_neither_hides_it_nor_opens_it(one, turned):
    at = np.array([7.0, 0.0, 0.0])
    block = walls((1.0, 0.6, 0.6), at)
    pane = np.roll(block[0].vertices, turned, axis=0)
    metal = [(m, "metal") for m in block]
    pair = split([*metal, (quad(pane), "glass")])
    alone, f = split(metal), joined(pair) if one else pair
    a, b = (paths(x, 2) for x in (alone, f))
    assert abs(at_range(b, 6.5) / at_range(a, 6.5) - 1.0) < 1e-3
    behind = 0.5 * C0 * b.delay > 6.7
    assert np.abs(b.amplitude[behind]).sum() < 1e-6 * abs(at_range(a, 6.5))


def test_only_layers_that_lie_upon_something_opaque_are_backed():
    wall = quad([[5, -1, -1], [5, -1, 1], [5, 1, 1], [5, 1, -1]])
    panes = [quad(wall.vertices * s + d) for s, d in ((0.3, [3.5, 0, 0]), (1.0, [0.01, 0, 0]), (1.0, [0, 5, 0]))]
    f = split([(wall, "metal"), *((p, "glass") for p in panes)])
    s = Geometry(f)
    found = backed(f.vertices, s.normal, s.area, s.is_layer, s.touch)
    np.testing.assert_array_equal(found, f.body == 1)


@pytest.mark.parametrize("one", [True, False])
def test_a_path_passes_a_pane_and_comes_back_from_inside_by_the_slab_formula(one):
    f = split([(m, "glass") for m in walls((1.0, 1.4, 1.2), (5.0, 0.0, 0.0))])
    f = joined(f) if one else f
    tx, rx = np.array([0.0, 0.1, 0.0]), np.array([0.5, -0.2, 0.1])
    routes = specular_routes(Geometry(f), tx, rx, 1, 2)
    gains = jones(routes, f, F)
    image = np.array([11.0 - rx[0], rx[1], rx[2]])
    length = float(np.linalg.norm(image - tx))
    at = np.flatnonzero(np.abs(routes.length - length) < 1e-9)
    assert len(at) == 1
    cosine = (image - tx)[0] / length
    r_s, r_p, t_s, t_p = slab.layer(cosine, GLASS, THICK, K)
    wanted = np.array([abs(r_s * t_s**2), abs(r_p * t_p**2)]) * C0 / F / (4 * np.pi * length)
    # Their planes of incidence are one plane: singular values are those of s and p.
    found = np.linalg.svd(gains[at[0]], compute_uv=False)
    np.testing.assert_allclose(np.sort(found), np.sort(wanted), rtol=1e-9)


@pytest.mark.parametrize("deep", [0.3, 0.3005, 0.301])
def test_the_rcs_of_a_glass_box_is_the_series_of_its_panes(deep):
    glass = rc.Material(6.31, 0.0, thickness=THICK)
    sigma = rc.rcs(trimesh.creation.box(extents=(deep, 0.2, 0.3)), F, 0.0, material=glass, max_bounces=3).sigma
    r, _, t, _ = slab.layer(1.0, 6.31 + 0j, THICK, K)
    # The front; through it the back; and once more to and fro between the panes.
    phases = np.exp(1j * K * deep * np.array([1.0, -1.0, -3.0]))
    field = np.array([r, t**2 * r, t**2 * r**3]) @ phases * 0.06 * K / (2.0 * np.pi)
    assert 10.0 * np.log10(sigma / (4.0 * np.pi * abs(field) ** 2)) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("most", [1, 3, 5, 7, 9])
def test_a_box_of_panes_rings_as_often_as_bounces_are_allowed(most):
    """R + sum of T^2 R^(2n+1) exp(-2jkL(n+1)): each turn between the panes takes two bounces more."""
    length, side = 0.5004, (0.3, 0.2)
    pane = rc.Material(eps_r=20.0, sigma=0.2, thickness=0.0041)
    found = rc.rcs(trimesh.creation.box((length, *side)), 77e9, 0.0, material=pane, max_bounces=most, tolerance_db=0.05)
    k = 2.0 * np.pi * 77e9 / 299_792_458.0
    r, _, t, _ = slab.layer(1.0, 20.0 - 0.2j / (2 * np.pi * 77e9 * 8.8541878128e-12), 0.0041, k)
    turns = sum(t**2 * r ** (2 * n + 1) * np.exp(-2j * k * length * (n + 1)) for n in range((most + 1) // 2))
    exact = 4.0 * np.pi * abs(side[0] * side[1] * k / (2.0 * np.pi) * (r + turns)) ** 2
    assert 10 * np.log10(found.sigma / exact) == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize("yaw", [0.0, 30.0])
def test_a_curved_body_cut_into_two_at_any_triangles_is_the_same_surface(yaw):
    whole = trimesh.creation.cylinder(radius=0.4, height=1.0, sections=48)
    first = np.random.default_rng(7).random(len(whole.faces)) < 0.5
    parts = [trimesh.Trimesh(whole.vertices, whole.faces[rows]) for rows in (first, ~first)]

    def corners(*meshes):
        place = {"position": (6.0, 0.5, 0.0), "yaw_deg": yaw, "material": "pec"}
        bodies = [rc.Body(name=f"b{i}", mesh=m, **place) for i, m in enumerate(meshes)]
        f = rc.Scene(bodies=bodies, frequency=77e9).facets()
        order = np.lexsort(f.vertices.mean(axis=1).round(6).T)
        return f.vertices[order].mean(axis=1), f.normals[order].mean(axis=1)

    one, two = corners(whole), corners(*parts)
    side = np.abs(one[0][:, 2]) < 0.4
    level = np.abs(two[0][:, 2]) < 0.4
    assert side.sum() == level.sum() == 96
    # Where the cut runs along a quad's diagonal it may be halved the other way.
    radial = (two[0] - [6.0, 0.5, 0.0])[level, :2]
    radial /= np.linalg.norm(radial, axis=1, keepdims=True)
    assert (np.einsum("ij,ij->i", radial, two[1][level, :2]) > 0.995).all()
