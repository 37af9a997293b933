"""The references held against closed forms and against each other, before anything is held against them."""

from __future__ import annotations

import miepython
import numpy as np
import pytest

from truth import corner, mie, paths, po, slab, tworay

C0 = 299_792_458.0
K = 2 * np.pi * 77e9 / C0
LAM = C0 / 77e9
HEAD_ON = po.direction(0.0)


def sigma(s):
    return 4 * np.pi * np.abs(s) ** 2


def far(azimuth, elevation=0.0):
    return po.direction(azimuth, elevation), np.inf


def test_small_conducting_sphere_is_rayleigh():
    x = 0.02
    assert mie.rcs(1.0, x) == pytest.approx(9 * np.pi * x**4, rel=2e-3)


@pytest.mark.parametrize("ka", [200.0, 1000.0])
def test_large_conducting_sphere_is_pi_a_squared(ka):
    assert mie.rcs(1.0, ka) == pytest.approx(np.pi, rel=1e-3)
    # amplitude -(a/2) exp(2jka), corrected by O(1/ka)
    assert abs(mie.backscatter(1.0, ka) + 0.5 * np.exp(2j * ka)) < 1.0 / ka


@pytest.mark.parametrize("eps", [2.5, 2.5 - 0.1j, 5.24 - 0.3j])
@pytest.mark.parametrize("x", [0.5, 16.1, 300.0])
def test_dielectric_sphere_is_miepythons(eps, x):
    peer = miepython.efficiencies_mx(np.sqrt(complex(eps)), x)[2]
    assert mie.rcs(1.0, x, eps) / np.pi == pytest.approx(peer, rel=1e-5)


@pytest.mark.parametrize("eps", [None, 3.0 - 0.2j])
def test_sphere_angles_end_in_backscatter_and_optical_theorem(eps):
    k, a = 25.0, 1.0
    back = mie.amplitudes(a, k, np.pi, eps)
    assert back[0] == pytest.approx(mie.backscatter(a, k, eps)) and back[1] == pytest.approx(-back[0])
    mu, w = np.polynomial.legendre.leggauss(200)
    scattered = np.pi * np.sum(w * sum(np.abs(s) ** 2 for s in mie.amplitudes(a, k, np.arccos(mu), eps)))
    extinct = -4 * np.pi / k * mie.amplitudes(a, k, 0.0, eps)[0][0].imag
    if eps is None:
        assert scattered == pytest.approx(extinct, rel=1e-9)
    else:
        assert 0 < scattered < extinct


@pytest.mark.parametrize("distance", [1.0, 3.0, 12.0])
def test_near_sphere_is_geometrical_optics(distance):
    """Image in a convex mirror: sigma = pi a^2 (D/(D - a))^2 with unit field at 1 m and D to the centre."""
    exact = sigma(mie.backscatter_near(0.3, K, distance))
    assert exact == pytest.approx(np.pi * 0.09 * (distance / (distance - 0.3)) ** 2, rel=1e-3)


def test_near_sphere_from_very_far_is_far():
    assert mie.backscatter_near(0.05, 100.0, 1e5) == pytest.approx(mie.backscatter(0.05, 100.0), rel=1e-3)


def test_half_space_is_fresnel_and_brewster():
    c = np.linspace(0.01, 1, 50)
    eps = 5.24 - 0.4j
    root = np.sqrt(eps - 1 + c**2)
    r_s, r_p = slab.half_space(c, eps)
    assert np.allclose(r_s, (c - root) / (c + root)) and np.allclose(r_p, (eps * c - root) / (eps * c + root))
    assert abs(slab.half_space(1 / np.sqrt(1 + 4.0), 4.0)[1]) < 1e-15


def test_layers_conserve_energy_and_half_wave_windows_vanish():
    c = np.linspace(0.05, 1, 50)
    r_s, r_p, t_s, t_p = slab.layer(c, 6.3, 0.004, K)
    for r, t in ((r_s, t_s), (r_p, t_p)):
        assert np.allclose(np.abs(r) ** 2 + np.abs(t) ** 2, 1)
    assert abs(slab.layer(1.0, 4.0, LAM / 4, K)[0]) < 1e-12


def test_split_layer_and_thick_lossy_layer():
    c = 0.6
    whole = slab.stack(c, [(3 - 0.1j, 0.005)], K)
    assert np.allclose(whole, slab.stack(c, [(3 - 0.1j, 0.002), (3 - 0.1j, 0.003)], K))
    assert np.allclose(slab.stack(c, [(3 - 0.5j, 0.1)], K)[:2], slab.half_space(c, 3 - 0.5j))
    assert np.allclose(slab.stack(c, [(1.0, 0.01)], K)[:2], 0)


@pytest.mark.parametrize("end", [(0.0, 0.0), (0.3, 0.2), (-0.9, 0.4)])
def test_plate_quadrature_is_sinc_is_gordon(end):
    plate, view = po.rectangle(0.1, 0.07), far(*end)
    closed = po.rectangle_far(0.1, 0.07, K, view[0])
    scale = 1e-9 * K * 0.007
    assert np.allclose(po.polygon(plate, K, view), closed, atol=scale)
    assert np.allclose(po.polygon_far(plate, K, view[0]), closed, atol=scale)


def test_plate_peak_is_four_pi_area_squared_over_wavelength_squared():
    peak = sigma(po.rectangle_far(0.3, 0.2, K, HEAD_ON)[0, 0])
    assert peak == pytest.approx(4 * np.pi * 0.06**2 / LAM**2)


@pytest.mark.parametrize("form", ["classic", "huygens"])
def test_bistatic_plate_in_a_principal_plane_is_the_textbooks(form):
    ti, ts, a, b = 0.5, -0.2, 0.1, 0.07
    s = po.rectangle_far(a, b, K, po.direction(ti), po.direction(ts), form=form)
    x = K * a * (np.sin(ti) + np.sin(ts)) / 2
    shape = 4 * np.pi * (a * b / LAM) ** 2 * (np.sin(x) / x) ** 2
    both = 0.5 * (np.cos(ti) + np.cos(ts))
    v, h = (np.cos(ti), np.cos(ts)) if form == "classic" else (both, both)
    assert sigma(s[0, 0]) == pytest.approx(shape * v**2) and sigma(s[1, 1]) == pytest.approx(shape * h**2)
    assert abs(s[0, 1]) < 1e-12 and abs(s[1, 0]) < 1e-12


@pytest.mark.parametrize("distances", [(3.0, 3.0), (5.0, 8.0), (np.inf, np.inf)])
def test_bistatic_plate_is_reciprocal(distances):
    a, b = (po.direction(0.4, -0.1), distances[0]), (po.direction(-0.3, 0.5), distances[1])
    plate = po.rectangle(0.06, 0.05)
    assert np.allclose(po.polygon(plate, K, a, b), po.polygon(plate, K, b, a).T, rtol=1e-6, atol=1e-12)


def test_all_currents_agree_where_the_radar_is_one():
    view = (po.direction(0.3, 0.2), 2.0)
    plate = po.rectangle(0.05, 0.04)
    quick = po.polygon(plate, K, view)
    for form in ("classic", "huygens", "reciprocal"):
        assert np.allclose(po.polygon(plate, K, view, view, form=form), quick, atol=1e-9)


@pytest.mark.parametrize(("distance", "radius"), [(3.0, 0.5), (1.0, 0.3)])
def test_disc_nearby_is_its_image_less_its_edge_wave(distance, radius):
    """On the axis the integral of exp(-2jkr)/r^2 dr is closed but for O(1/kD): S = -D/2 (1 - (D/r_e)^2 exp(..))."""
    edge = np.hypot(distance, radius)
    exact = -distance / 2 * (1 - (distance / edge) ** 2 * np.exp(-2j * K * (edge - distance)))
    assert abs(po.disc(radius, K, (HEAD_ON, distance))[0, 0] - exact) < 3 / K


def test_plate_from_very_far_is_far_and_triangles_add_up():
    plate, d = po.rectangle(0.05, 0.08), po.direction(0.1, 0.2)
    closed = po.rectangle_far(0.05, 0.08, K, d)
    assert np.allclose(po.polygon(plate, K, (d, 1e6)), closed, atol=1e-5)
    halves = np.array([plate[[0, 1, 2]], plate[[0, 2, 3]]])
    near = (d, 2.0)
    assert np.allclose(po.triangles(halves, K, near), po.polygon(plate, K, near), atol=1e-9)


def test_polygon_integral_without_phase_is_its_area():
    corners = corner.trihedral_faces(0.3)[0]
    for g in (np.zeros(3), 1e-5 * np.ones(3), 3e-4 * np.ones(3)):
        assert po.fourier(corners, g) == pytest.approx(0.045, rel=1e-3)


def test_disc_quadrature_is_bessel():
    d = po.direction(0.2, -0.1)
    assert np.allclose(po.disc(0.04, K, (d, np.inf)), po.disc_far(0.04, K, d), atol=1e-9)


def test_cylinder_broadside_is_stationary_phase_and_tilted_is_its_sinc():
    a, h = 0.1, 0.2
    broad = sigma(po.cylinder(a, h, K, far(0.3))[0, 0])
    assert broad == pytest.approx(K * a * h**2, rel=2e-2)
    t = 0.01
    tilted = sigma(po.cylinder(a, h, K, far(0.3, t), caps=False)[0, 0])
    assert tilted / broad == pytest.approx(np.sinc(K * h * np.sin(t) / np.pi) ** 2, rel=2e-2)


def test_cylinder_end_on_is_its_disc():
    s = po.cylinder(0.05, 0.1, K, (np.array([0, 0, 1.0]), np.inf))
    assert sigma(s[0, 0]) == pytest.approx(4 * np.pi * (np.pi * 0.0025) ** 2 / LAM**2, rel=1e-6)


def test_dielectric_plate_at_normal_incidence_is_weaker_by_its_reflection():
    plate, view = po.rectangle(0.05, 0.05), (HEAD_ON, np.inf)
    pec = po.polygon_far(plate, K, HEAD_ON)
    glass = po.polygon(plate, K, view, view, geometry=lambda c: slab.layer(c, 6.3 - 0.2j, 0.005, K)[:2])
    r = slab.layer(1.0, 6.3 - 0.2j, 0.005, K)[0]
    assert np.allclose(glass, -r * pec, atol=1e-9)


def test_conductor_by_its_coefficients_is_the_conductor():
    plate, a, b = po.rectangle(0.05, 0.03), (po.direction(0.4, 0.3), 4.0), (po.direction(-0.1, 0.6), 7.0)
    assert np.allclose(po.polygon(plate, K, a, b, geometry=slab.pec), po.polygon(plate, K, a, b), atol=1e-12)


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


def test_line_of_sight_is_friis_with_identity_jones():
    (path,) = paths.specular_paths((0, 0, 1), (30, 7, 3), [], 77e9)
    assert np.allclose(path.gain, tworay.friis(path.length, K) * np.eye(2))
    assert np.abs(path.gain[0, 0]) == pytest.approx(LAM / (4 * np.pi * path.length))


@pytest.mark.parametrize("eps", [None, 5.24 - 0.32j, 3.0])
@pytest.mark.parametrize("yaw", [0.0, 0.7])
def test_ground_by_images_is_the_two_ray_form(eps, yaw):
    geometry = slab.pec if eps is None else lambda c: slab.half_space(c, eps)
    d, h1, h2 = 40.0, 0.6, 1.4
    rx = (d * np.cos(yaw), d * np.sin(yaw), h2)
    direct, bounced = paths.specular_paths((0, 0, h1), rx, paths.ground(geometry=geometry), 77e9)
    (va, vb), (ha, hb) = tworay.two_ray(d, h1, h2, K, eps)
    assert np.allclose(direct.gain, np.diag([va, ha]), atol=1e-12)
    assert np.allclose(bounced.gain, np.diag([vb, hb]), atol=1e-12)


def test_radar_gain_squared_is_the_radar_equation():
    power = abs(tworay.radar_gain(20.0, 20.0, 3.0, K)) ** 2
    assert power == pytest.approx(tworay.radar_power(20.0, 3.0, LAM))


def room():
    walls = paths.box((-2, -3, 0), (4, 2, 3), lambda c: slab.half_space(c, 4.0 - 0.3j), "room")
    return walls + paths.box((0.5, -0.5, 0.01), (1.5, 0.5, 1.2), body="crate")


def test_empty_shoebox_has_one_path_for_every_image():
    """A rectangular room has 1, 6, 18, 38 images of order 0 to 3 (|i| + |j| + |l| = order), all seen."""
    walls = paths.box((-2, -3, 0), (4, 2, 3), body="room")
    found = paths.specular_paths((0.31, 0.23, 1.17), (1.73, -1.29, 2.11), walls, 77e9)
    unique = {round(p.length, 9) for p in found}
    # orders of the same walls give one path each where only one order is geometrically met
    assert [len({round(p.length, 9) for p in found if len(p.faces) == m}) for m in range(4)] == [1, 6, 18, 38]
    assert len(found) == len(unique) == 63


def test_exchange_of_ends_transposes_the_gains():
    tx, rx, frequency = (-1.03, -1.31, 1.07), (2.91, 0.87, 0.83), 77e9
    there = paths.specular_paths(tx, rx, room(), frequency)
    back = paths.specular_paths(rx, tx, room(), frequency)
    assert len(there) == len(back) > 10
    # phi-hat turns its sign with the direction of travel, theta-hat does not
    turn = np.diag([1.0, -1.0])
    for a, b in zip(there, back, strict=True):
        assert a.length == pytest.approx(b.length, rel=1e-12)
        assert np.allclose(a.gain, turn @ b.gain.T @ turn, atol=1e-12)


def test_crate_blocks_line_of_sight_and_layer_lets_it_through():
    tx, rx = (-1.0, 0.0, 0.6), (3.0, 0.1, 0.6)
    assert paths.specular_paths(tx, rx, room(), 77e9, max_bounces=0) == []
    pane = [
        paths.Face([[0, -1, 0], [0, 1, 0], [0, 1, 2], [0, -1, 2]], lambda c: slab.layer(c, 6.3, 0.005, K), "pane", True)
    ]
    (path,) = paths.specular_paths((-1, 0, 1), (1, 0, 1), pane, 77e9, max_bounces=0)
    assert np.allclose(path.gain, tworay.friis(2.0, K) * slab.layer(1.0, 6.3, 0.005, K)[2] * np.eye(2))


def test_right_angle_of_mirrors_returns_with_turned_polarisation():
    """Two conducting walls at a right angle: the double bounce at 45 degrees of roll swaps V and H."""
    c = np.sqrt(0.5)
    faces = [
        paths.Face(f @ np.array([[1, 0, 0], [0, c, -c], [0, c, c]]).T, body="wall") for f in corner.dihedral_faces(5, 9)
    ]
    double = [p for p in paths.specular_paths((6, 0.1, 0.0), (6, -0.1, 0.05), faces, 77e9) if len(p.faces) == 2]
    assert len(double) >= 1
    for p in double:
        cross, co = abs(p.gain[0, 1]), abs(p.gain[0, 0])
        assert cross == pytest.approx(LAM / (4 * np.pi * p.length), rel=1e-2) and co < 0.05 * cross
