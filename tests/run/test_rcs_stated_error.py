"""The stated error of rcs covers the true one, and is not far above it."""

from __future__ import annotations

import itertools

import numpy as np
import trimesh
from support.facets import quad
from support.targets import F, K, ball, db, sigma, slab_of, tube, view
from truth import corner, mie, po

from raychan.run.rcs import rcs
from raychan.world.material import Material
from raychan.world.meshes.mesh import make_mesh


def apart(a, b):
    """Whether two plates do not touch: one lies on one side of the other's plane."""
    sides = [(p - q[0]) @ np.cross(q[1] - q[0], q[2] - q[0]) for p, q in ((a, b), (b, a))]
    return any((s > 0).all() or (s < 0).all() for s in sides)


def plates_that_hide_each_other(rng):
    """Three rectangles turned and placed at random in a cube of 0.3 m, none through another."""
    while True:
        turns = [trimesh.transformations.random_rotation_matrix(rng.random(3))[:3, :3] for _ in range(3)]
        faces = [po.rectangle(*rng.uniform(0.05, 0.2, 2)) @ t.T + rng.uniform(-0.15, 0.15, 3) for t in turns]
        if all(apart(a, b) for a, b in itertools.combinations(faces, 2)):
            return faces


def random_case(rng, i):
    """Mesh, material, azimuth, elevation [deg], distance [m] and true sigma [m^2] of one of seven kinds of bodies, far
    or near; those with flat sides are small when near, where their reference takes its time."""
    near = rng.random() < 0.4
    d = float(rng.uniform(3.0, 20.0)) if near else np.inf
    az, el = rng.uniform(-40.0, 40.0, 2)
    kind, material = i % 7, "pec"
    if kind == 0:
        corners, geometry = po.rectangle(*rng.uniform(0.05, 0.12 if near else 0.3, 2)), None
        if rng.random() < 0.5:
            eps_r, thickness = float(rng.uniform(2.0, 8.0)), (None, 0.004)[rng.integers(2)]
            material = Material(eps_r=eps_r, sigma=float(rng.uniform(0.0, 2.0)), thickness=thickness)
            geometry = slab_of(material)
        mesh, look = quad(corners), view(az, el, d)
        s = (
            po.polygon(corners, K, look, geometry=geometry)
            if near
            else po.polygon_far(corners, K, look[0], None, geometry)
        )
    elif kind == 1:
        r = rng.uniform(0.03, 0.4)
        true = 4 * np.pi * abs(mie.backscatter_near(r, K, d)) ** 2 if near else mie.rcs(r, K)
        made = ball(r, int(rng.integers(3, 5)))
        mesh = make_mesh(made.vertices, made.faces, normals=np.asarray(made.vertices)[made.faces] / r)
        return mesh, material, az, el, d, true
    elif kind == 2:
        r, h, el = rng.uniform(0.03, 0.1), rng.uniform(0.05, 0.3), rng.uniform(-3.0, 3.0)
        made = tube(r, h, int(rng.choice([64, 128])))
        side = np.abs(made.face_normals[:, 2]) < 0.5
        out = np.where(side[:, None, None], made.triangles * [1.0, 1.0, 0.0] / r, made.face_normals[:, None])
        mesh, s = make_mesh(made.vertices, made.faces, normals=out), po.cylinder(r, h, K, view(az, el, d))
    elif kind == 3:
        a, el, az = rng.uniform(0.03, 0.05) if near else rng.uniform(0.05, 0.1), rng.uniform(-5.0, 5.0), 0.7 * az
        faces = corner.dihedral_faces(a, a * rng.uniform(0.5, 1.0))
        mesh, s = corner.mesh(faces), corner.corner(faces, K, view(az, el, d))
    elif kind == 4:
        faces, d, az, el = corner.trihedral_faces(rng.uniform(0.05, 0.3), rng.random() < 0.5), np.inf, az / 2, el / 2
        mesh, s = corner.mesh(faces), corner.corner(faces, K, view(az, el))
    elif kind == 5:
        mesh = trimesh.creation.box(rng.uniform(0.03, 0.1, 3) if near else rng.uniform(0.05, 0.3, 3))
        sides = np.asarray(mesh.triangles)
        far = sum(po.polygon_far(t, K, view(az, el)[0]) for t in sides)
        s = po.triangles(sides, K, view(az, el, d)) if near else far
    else:
        faces, d = plates_that_hide_each_other(rng), np.inf
        mesh, s = corner.mesh(faces), corner.corner(faces, K, view(az, el))
    return mesh, material, az, el, d, sigma(s)


def test_the_true_error_lies_within_the_stated_one_and_not_far_within(monkeypatch):
    """98 random cases, 95 % of them; the ratio where there is an error to speak of. All know their normals (what
    a mesh leaves open is judged in test_mesh_error), and where the truth is physical optics no wave creeps."""
    rng = np.random.default_rng(11)
    true, stated = [], []
    for i in range(98):
        mesh, material, az, el, d, exact = random_case(rng, i)
        # Physical optics is the truth here; nobody wants the error of creeping waves left out, so no argument does it.
        with monkeypatch.context() as m:
            if i % 7 != 1:
                m.setattr("raychan.run.cross_section.refinement.creeping", lambda *_: (0.0, 0.0))
            got = rcs(mesh, F, az, el, distance=d, material=material)
        true.append(abs(float(db(got.sigma / exact))))
        stated.append(float(got.error_db))
    e, s = np.array(true), np.array(stated)
    known = np.isfinite(s)
    assert known.mean() > 0.98
    told = known & (e > 1e-3)
    assert told.sum() > 28
    beyond = known & (e > s)
    assert beyond.sum() <= 0.05 * known.sum(), f"beyond: {np.round(np.column_stack([e, s])[beyond], 4)}"
    # The median was 3.9 until corners of footprints had fields of their own: true errors of near lossy plates fell by
    # up to a half, stated ones did not.
    assert np.median(s[told] / e[told]) <= 4.2
