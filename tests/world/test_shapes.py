"""Built-in shapes: closed, outward, of the size asked for, with the normals of the true surface."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from raychan.geometry.triangles import edge_curvatures
from raychan.world.errors import SceneError
from raychan.world.material import names
from raychan.world.meshes.halving import cubic_off
from raychan.world.shapes import SHAPES, build
from raychan.world.shapes.curve import End, arcs, half_outline
from raychan.world.shapes.piece import Assembly
from raychan.world.shapes.solid import capsule, ellipsoid, offset_solid, rounded_block

SHEETS = {"plate", "dihedral", "trihedral", "ground"}
VEHICLES = ("car", "suv", "van", "truck")


def flat_normals(mesh):
    c = mesh.corners
    n = np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0])
    return n / np.linalg.norm(n, axis=1, keepdims=True)


@pytest.mark.parametrize("name", sorted(set(SHAPES) - SHEETS))
def test_every_solid_is_closed_and_faces_outward(name):
    mesh = build(name)
    assert mesh.report.watertight and mesh.report.zero_area == mesh.report.duplicates == 0
    assert mesh.volume() > 0.0
    agreement = np.einsum("fij,fj->fi", mesh.normals, flat_normals(mesh))
    # Facets of a tight curve differ more from their corner normals; none may point the other way.
    assert agreement.min() > 0.6
    assert (mesh.areas[agreement.min(axis=1) < 0.95].sum() / mesh.areas.sum()) < 0.01


@pytest.mark.parametrize("name", sorted(SHAPES))
def test_unit_normals_known_materials_and_used_parts(name):
    mesh = build(name)
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=2), 1.0, atol=1e-12)
    assert set(mesh.part_materials) <= set(names())
    assert set(mesh.part) == set(range(len(mesh.part_names)))


@pytest.mark.parametrize("name", VEHICLES)
def test_vehicles_have_the_size_asked_for_and_stand_on_the_ground(name):
    size = {"length": 5.0, "width": 1.95, "height": 1.9}
    mesh = build(name, size if name != "truck" else {"length": 7.5, "width": 2.4, "height": 3.2})
    size = size if name != "truck" else {"length": 7.5, "width": 2.4, "height": 3.2}
    own = ~np.isin(mesh.part, [i for i, n in enumerate(mesh.part_names) if n.startswith("mirror")])
    low, high = (f(mesh.corners[own].reshape(-1, 3), axis=0) for f in (np.min, np.max))
    np.testing.assert_allclose(high - low, list(size.values()), rtol=1e-9)
    np.testing.assert_allclose([low[0] + high[0], low[1] + high[1], low[2]], 0.0, atol=1e-9)


@pytest.mark.parametrize("name", VEHICLES)
def test_vehicles_are_symmetric(name):
    c = build(name).corners.mean(axis=1)
    left, right = c[c[:, 1] > 1e-9], c[c[:, 1] < -1e-9]
    moments = [(s[:, 0].sum(), np.abs(s[:, 1]).sum(), s[:, 2].sum()) for s in (left, right)]
    # Caps are cut along one diagonal, so that single facets need not mirror each other.
    np.testing.assert_allclose(moments[0], moments[1], rtol=0.02)


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        (
            "car",
            {"tail", "rear_door_left", "front_door_right", "mirror_left", "tyre_front_left", "plate", "hood", "roof"},
        ),
        ("suv", {"tail", "window_rear", "windscreen", "tyre_rear_right", "seats"}),
        ("van", {"tail", "windscreen", "plate"}),
        ("truck", {"tail", "tyre_front_left", "tyre_rear_right", "cab", "plate", "lock_bars"}),
        ("pedestrian", {"head", "torso", "arm_left", "leg_right"}),
        ("lamp_post", {"pole", "arm", "luminaire"}),
    ],
)
def test_named_parts_exist(name, parts):
    assert parts <= set(build(name).part_names)


def test_parts_are_where_their_names_say():
    mesh = build("car")
    place = {n: mesh.corners[mesh.part == i].reshape(-1, 3).mean(axis=0) for i, n in enumerate(mesh.part_names)}
    assert place["tail"][0] < -2.0 < 2.0 < place["front"][0]
    assert place["tyre_front_left"][0] > 1.0 and place["tyre_front_left"][1] > 0.7
    assert place["mirror_right"][1] < -0.9 and place["rear_door_left"][0] < place["front_door_left"][0]
    assert place["roof"][2] > 1.2 and 0.5 < place["plate"][2] < 0.9


def test_door_seams_are_grooves_of_the_depth_asked_for():
    plan = half_outline(4.0, 1.8, End(3.0, 0.3), End(3.0, 0.3), 1e-6)
    section = arcs([(np.inf, 1.0)], 0.0, 1e-3)
    whole, cut = (_mesh(offset_solid(plan, section, g)) for g in ({}, {2.0: (0.01, 0.02)}))
    # Two trapezoids (mean width three quarters of the mouth) over a height of 1 m.
    assert whole.volume() - cut.volume() == pytest.approx(2 * 0.0075 * 0.02, rel=1e-3)
    assert cut.report.watertight


def _mesh(piece):
    made = Assembly()
    made.add("body", "pec", piece)
    return made.mesh()


def test_sphere_normals_are_radial_and_its_volume_is_known():
    mesh = build("sphere", {"radius": 0.5})
    np.testing.assert_allclose(mesh.normals, mesh.corners / 0.5, atol=1e-9)
    np.testing.assert_allclose(mesh.report.size, 1.0, atol=1e-12)
    assert mesh.volume() == pytest.approx(np.pi / 6.0, rel=3e-3)


def test_ellipsoid_normals_are_the_gradient():
    semi = np.array([0.1, 0.2, 0.3])
    mesh = _mesh(ellipsoid(tuple(semi)))
    gradient = mesh.corners / semi**2
    gradient /= np.linalg.norm(gradient, axis=2, keepdims=True)
    np.testing.assert_allclose(mesh.normals, gradient, atol=1e-9)


def test_capsule_surface_keeps_its_distance_from_the_axis():
    mesh = _mesh(capsule(np.zeros(3), np.array([0.3, 0.4, 1.2]), 0.1, 0.1))
    axis = np.array([0.3, 0.4, 1.2])
    t = np.clip(mesh.vertices @ axis / (axis @ axis), 0.0, 1.0)
    np.testing.assert_allclose(np.linalg.norm(mesh.vertices - t[:, None] * axis, axis=1), 0.1, atol=1e-12)


def test_rounded_block_surface_is_at_its_radius_from_the_inner_box():
    mesh = _mesh(rounded_block(1.0, 2.0, 0.6, 0.1))
    inner = np.array([0.4, 0.9, 0.2])
    p = mesh.vertices - [0.0, 0.0, 0.3]
    off = p - np.clip(p, -inner, inner)
    np.testing.assert_allclose(np.linalg.norm(off, axis=1), 0.1, atol=1e-12)
    c = mesh.corners - [0.0, 0.0, 0.3]
    np.testing.assert_allclose(mesh.normals * 0.1, c - np.clip(c, -inner, inner), atol=1e-12)


def test_finer_sag_brings_facets_to_the_surface():
    for sag in (2e-3, 0.5e-3):
        middle = build("sphere", {"max_sag": sag}).corners.mean(axis=1)
        assert 0.5 - np.linalg.norm(middle, axis=1).min() < 2.0 * sag


def test_bodywork_normals_agree_with_a_much_finer_tessellation():
    coarse, fine = build("car", {"max_sag": 2e-3}), build("car", {"max_sag": 5e-5})
    skin = ("tail", "rear_bumper", "boot", "floor", "quarter_left", "quarter_right")
    near = np.isin(fine.part, [fine.part_names.index(n) for n in skin])
    tail = coarse.part == coarse.part_names.index("tail")
    at = cKDTree(fine.corners[near].mean(axis=1)).query(coarse.corners[tail].reshape(-1, 3))[1]
    cosine = np.einsum("ij,ij->i", coarse.normals[tail].reshape(-1, 3), flat_normals(fine)[near][at])
    # Half a facet of the fine fillet turns by 2.3 degrees, of the coarse one by 15.
    assert np.degrees(np.arccos(cosine.min())) < 5.0


def test_corners_open_to_plus_x():
    for params in ({}, {"square": True}):
        mesh = build("trihedral", params)
        n = flat_normals(mesh)
        np.testing.assert_allclose(n[:, 0], 1.0 / np.sqrt(3.0), atol=1e-12)
        faces = np.unique(n.round(9), axis=0)
        np.testing.assert_allclose(faces @ faces.T, np.eye(3), atol=1e-8)
    np.testing.assert_allclose(flat_normals(build("dihedral"))[:, 0], 1.0 / np.sqrt(2.0), atol=1e-12)


@pytest.mark.parametrize(
    ("name", "params", "key"),
    [
        ("caar", {}, "shape"),
        ("car", {"lenght": 4.0}, "lenght"),
        ("car", {"length": -4.0}, "length"),
        ("car", {"length": "4 m"}, "length"),
        ("sphere", {"radius": 0.0}, "radius"),
        ("sphere", {"radius": float("nan")}, "radius"),
        ("car", {"length": 0.5}, "shape"),
        ("trihedral", {"square": "yes"}, "square"),
        ("lamp_post", {"height": 0.5, "radius": 2.0}, "height"),
        ("lamp_post", {"height": 0.36, "arm": 0.0}, "height"),
        ("lamp_post", {"radius": 2.08}, "radius"),
        ("truck", {"front_axle": 20.0}, "front_axle"),
        ("truck", {"front_axle": 2.7}, "front_axle"),
    ],
)
def test_bad_parameters_are_named(name, params, key):
    with pytest.raises(SceneError) as caught:
        build(name, params)
    assert caught.value.key == key


@pytest.mark.parametrize(
    ("name", "params"),
    [
        ("lamp_post", {"height": 0.52}),
        ("lamp_post", {"radius": 2.07}),
        ("bike_rack", {"max_sag": 0.1}),
        ("truck", {"front_axle": 2.73}),
        ("truck", {"front_axle": 7.51}),
    ],
)
def test_shapes_at_the_ends_of_what_is_allowed_stand_on_the_ground(name, params):
    mesh = build(name, params)
    assert abs(mesh.bounds[0][2]) < 1e-9
    if name == "truck":
        assert np.ptp(mesh.bounds[:, 0]) == pytest.approx(8.0)


def test_a_switch_is_true_or_false():
    with pytest.raises(SceneError, match="square: 'yes' is not possible; allowed: true or false"):
        build("trihedral", {"square": "yes"})


def test_nearest_shape_is_suggested():
    with pytest.raises(SceneError, match="did you mean 'car'"):
        build("carr")


def shared_area(one, other):
    """Return the area that two triangles (3, 2) share, by clipping the first along the sides of the second."""
    kept = list(one)
    for a, b in zip(other, np.roll(other, -1, axis=0), strict=True):
        inside = [(b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) for p in kept]
        clipped = []
        for i, (p, f) in enumerate(zip(kept, inside, strict=True)):
            q, g = kept[(i + 1) % len(kept)], inside[(i + 1) % len(kept)]
            clipped += ([p] if f >= 0.0 else []) + ([p + f / (f - g) * (q - p)] if f * g < 0.0 else [])
        kept = clipped
    x, y = np.array(kept).T if kept else np.zeros((2, 1))
    return 0.5 * abs(x @ np.roll(y, -1) - y @ np.roll(x, -1))


@pytest.mark.parametrize("name", sorted(set(SHAPES) - {"ground"}))
def test_no_two_faces_of_a_shape_lie_in_one_place(name):
    # Which of two such faces a ray meets is a matter of rounding: shadows on them never converge.
    c = build(name).corners
    n = flat_normals(build(name))
    height = np.einsum("fj,fj->f", n, c[:, 0])
    on_ground = (n[:, 2] < -0.999) & (np.abs(height) < 1e-6)
    for i, j in cKDTree(np.column_stack([n, height])).query_pairs(2e-5):
        if on_ground[i]:
            continue
        u = c[i, 1] - c[i, 0]
        axes = np.stack([u, np.cross(n[i], u)]) / np.linalg.norm(u)
        assert shared_area(c[i] @ axes.T, c[j] @ axes.T) < 1e-6, (i, j)


@pytest.mark.parametrize("name", ["car", "suv", "van"])
def test_both_sides_of_a_vehicle_are_cut_into_facets_alike(name):
    """But for cells across the middle, of which each diagonal is the other's image, and rounded edges of foam."""
    mesh = build(name)
    middle = np.ptp(np.sign(mesh.corners[:, :, 1].round(9)), axis=1) == 2.0
    foam = np.isin(mesh.part, [mesh.part_names.index(n) for n in ("seats", "cabin", "plate")])
    some = mesh.corners[~middle & ~foam].round(9)
    assert len(some) > 0.7 * len(mesh.faces)
    facets = [{tuple(sorted(map(tuple, f + 0.0))) for f in v.round(6)} for v in (some, some * [1.0, -1.0, 1.0])]
    assert facets[0] == facets[1]


@pytest.mark.parametrize("name", ["car", "suv", "van"])
def test_cells_are_cut_so_that_quadratic_facets_lie_nearest_to_cubic_ones(name):
    """Each pair of facets of a bent cell against the other diagonal."""
    mesh = build(name)
    skin = np.isin(mesh.part, [i for i, n in enumerate(mesh.part_names) if "door" in n or "window" in n])
    i = np.flatnonzero(skin[:-1] & skin[1:] & (mesh.faces[:-1, 0] == mesh.faces[1:, 0]))
    v, n = mesh.corners, mesh.normals

    def off(corners, normals):
        return cubic_off(corners, normals, edge_curvatures(corners, normals)[0])

    pair = i[mesh.faces[i, 2] == mesh.faces[i + 1, 1]]  # facets abc and acd
    assert len(pair) > 50
    quad, normals = (np.concatenate([x[pair], x[pair + 1][:, 2:]], axis=1) for x in (v, n))
    own = np.maximum(off(v[pair], n[pair]), off(v[pair + 1], n[pair + 1]))
    other = np.maximum(*(off(quad[:, c], normals[:, c]) for c in ([0, 1, 3], [1, 2, 3])))
    assert (own < 1.01 * other + 1e-8).all()
