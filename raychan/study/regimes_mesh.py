"""Regimes of meshes: far from the origin, tiny and huge facets, bad faces, finer meshes, another lattice of cuts."""

from __future__ import annotations

from typing import Any

import numpy as np

from raychan.channel.error import stated_error
from raychan.poses import rotation
from raychan.run.rcs import rcs
from raychan.study.regimes_base import (
    FREQUENCY,
    LAMBDA,
    Floats,
    Outcome,
    Regime,
    Row,
    amplitudes,
    at_most,
    far,
    geometry_of,
    moved,
    plate_far,
    rectangle,
    same_db,
    sheet,
)
from raychan.tracing.legs import Leg
from raychan.world.body import Body
from raychan.world.geometry import Geometry
from raychan.world.meshes.mesh import Mesh, make_mesh
from raychan.world.scene import Scene
from raychan.world.shapes import build

_TOLERANCE_DB = 0.25  # the default of `rcs`
_SIZES = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0, 1e1, 1e2)


def far_from_home(quick: bool) -> Outcome:
    """Move targets and radar together by 10 km, and turn them together: only rounding may change."""
    rows = []
    cases: tuple[tuple[str, dict[str, Any]], ...] = (
        ("trihedral", {"size": 0.1}),
        ("sphere", {"radius": 0.2}),
        ("dihedral", {"size": 0.2}),
    )
    shift = np.array([1e4, -1e4, 30.0])
    turn = rotation(1.0, 0.4, -0.7)
    for name, params in cases:
        facets = geometry_of(build(name, params)).facets
        end = np.array([12.0, 1.5, 0.8])
        here = _power(Geometry(facets), end, np.linalg.norm(end))
        there = _power(Geometry(moved(facets, np.eye(3), shift)), end + shift, np.linalg.norm(end + shift))
        turned = _power(Geometry(moved(facets, turn, np.zeros(3))), turn @ end, np.linalg.norm(end))
        both = _power(Geometry(moved(facets, turn, shift)), turn @ end + shift, np.linalg.norm(turn @ end + shift))
        # A turn moves the cuts, so that levels agree within the tolerance of the launch.
        rows.append(same_db(f"{name} moved by 14 km", there, here, 0.01, "symmetry: translation"))
        rows.append(same_db(f"{name} turned", turned, here, 0.25, "symmetry: rotation"))
        rows.append(same_db(f"{name} turned and moved", both, here, 0.25, "symmetry: motion"))
    return Outcome(rows)


def _power(geometry: Geometry, end: Floats, reach: Any) -> float:
    """Return the power over all polarisations from a near radar, which is the same for all choices of axes.

    `amplitudes` scales by the distance of the radar from the origin, once each way; that is taken out.
    """
    s = amplitudes(geometry, Leg(end=end), Leg(end=end), step=2)
    return float(np.linalg.norm(s) ** 2 / float(reach) ** 4)


def facet_sizes(quick: bool) -> Outcome:
    """Check facets of 1e-6 to 1e2 m: as whole targets, as strips in a plate, and a huge one seen from nearby."""
    rows: list[Row] = []
    plates, corners = [], []
    # Tubes of the default launch are at most 0.3 m; here they may be a quarter of the target.
    for size in _SIZES:
        edge = 0.25 * size
        s = amplitudes(
            geometry_of(build("plate", {"width": size, "height": size})), far(0), far(0), 1, 1, max_edge=edge
        )
        exact = 4 * np.pi * (size * size / LAMBDA) ** 2
        level = 4 * np.pi * abs(s[0, 0]) ** 2
        rows.append(same_db(f"plate of {size:g} m", level, exact, 0.05, "closed form: physical optics"))
        plates.append(rows[-1].seen)
    for size in _SIZES:
        edge = 0.25 * size
        corner = geometry_of(build("dihedral", {"size": size, "height": size}))
        s = amplitudes(corner, far(0), far(0), 1, 2, max_edge=edge, only=2)
        exact = 8 * np.pi * (size * size / LAMBDA) ** 2
        level, truth = 4 * np.pi * abs(s[0, 0]) ** 2, "closed form: 8 pi a2 b2 / lambda2"
        row = same_db(f"dihedral of {size:g} m, two bounces", level, exact, 0.1, truth)
        why = "the tracer's fixed lengths (start ahead of a surface, nearest hit) are no longer small"
        rows.append(row if row.passed else same_db(row.name, level, exact, 0.1, truth, why))
        corners.append(rows[-1].seen)
    r = rcs(build("dihedral", {"size": 3.0, "height": 3.0}), FREQUENCY, 0.0, max_rays=10_000)
    why = "max_rays does not limit the first two launches, whose tubes are at most 0.3 m"
    rows.append(
        at_most("dihedral of 3 m: rays, max_rays 10000", float(r.rays), 30_000, "rays", "the caller's bound", why)
    )
    for strip in _SIZES[:5]:
        cuts = [rectangle((0, -0.05 + y, -0.05), (0, w, 0), (0, 0, 0.1)) for y, w in _strips(strip)]
        for angle in (0.0, 20.0):
            r = rcs(sheet(*cuts), FREQUENCY, angle, tolerance_db=0.05, max_bounces=1)
            name = f"plate 0.1 m with strips of {strip:g} m, {angle:g} deg"
            rows.append(same_db(name, float(r.sigma), plate_far(0.1, 0.1, angle), 0.05, "closed form: physical optics"))
    near = Leg(end=np.array([15.0, 0.0, 0.0]))
    huge = geometry_of(build("plate", {"width": 30.0, "height": 30.0}))
    level = 4 * np.pi * abs(amplitudes(huge, near, near, 0, 1)[0, 0]) ** 2
    # Edge waves are about 1 / sqrt(k D) of the image, shared by four edges that are not in phase.
    rows.append(same_db("plate of 30 m from 15 m", level, np.pi * 15.0**2, 0.05, "limit: image (pi D2)"))
    return Outcome(rows, {"size": np.array(_SIZES), "plate": np.array(plates), "dihedral": np.array(corners)})


def _strips(width: float) -> list[tuple[float, float]]:
    """Return start and width [m] of pieces of 0.1 m, every other one narrow."""
    wide = (0.1 - 3 * width) / 4
    pieces, at = [], 0.0
    for i in range(7):
        w = wide if i % 2 == 0 else width
        pieces.append((at, w))
        at += w
    return pieces


def bad_faces(quick: bool) -> Outcome:
    """Put duplicate, flipped, zero-area and coplanar faces into good meshes."""
    rows: list[Row] = []
    rng = np.random.default_rng(3)
    for name, params in (("box", {"length": 0.2, "width": 0.1, "height": 0.1}), ("trihedral", {"size": 0.1})):
        clean = build(name, params)
        v, f = clean.vertices, clean.faces
        some = rng.choice(len(f), size=max(1, len(f) // 3), replace=False)
        flat = np.column_stack([f[some, 0], f[some, 1], f[some, 0]])
        middle = np.concatenate([v, v[f[some, 0]] * 0.5 + v[f[some, 1]] * 0.5])
        needles = np.column_stack([f[some, 0], len(v) + np.arange(len(some)), f[some, 1]])
        turned = f.copy()
        turned[some] = turned[some, ::-1]
        made = {
            "duplicate faces": (v, np.concatenate([f, f[some]])),
            "duplicates turned round": (v, np.concatenate([f, f[some, ::-1]])),
            "flipped faces": (v, turned),
            "faces with two corners alike": (v, np.concatenate([f, flat])),
            "needles without area": (middle, np.concatenate([f, needles])),
            "corners not shared": (v[f].reshape(-1, 3), np.arange(f.size).reshape(-1, 3)),
        }
        for az, el in ((10.0, 5.0),):
            good = rcs(make_mesh(v, f), FREQUENCY, az, el, tolerance_db=0.1)
            for what, (bad_v, bad_f) in made.items():
                r = rcs(make_mesh(bad_v, bad_f), FREQUENCY, az, el, tolerance_db=0.1)
                rows.append(
                    same_db(f"{name}: {what}", float(r.sigma), float(good.sigma), 0.1, "symmetry: the same surface")
                )
    return Outcome(rows + _coplanar())


def _coplanar() -> list[Row]:
    """Return checks of coincident and overlapping plates, which together are one plate."""
    corner, u, v = np.array([0, -0.05, -0.05]), np.array([0, 0.1, 0]), np.array([0, 0, 0.1])
    one = rectangle(corner, u, v)
    other = (one[0], np.array([[0, 1, 3], [1, 2, 3]]))
    small = rectangle(corner + 0.3 * (u + v), 0.4 * u, 0.4 * v)
    exact = plate_far(0.1, 0.1, 0.0)
    rows = []
    cause = "facets that overlap in one plane are each counted whole"
    for name, second in (("coincident plates, other diagonal", other), ("small plate upon a great one", small)):
        r = rcs(sheet(one, second, mend=False), FREQUENCY, 0.0, max_bounces=1)
        row = same_db(f"one body: {name}", float(r.sigma), exact, 0.01, "energy: what is behind is not lit")
        rows.append(row if row.passed else same_db(row.name, float(r.sigma), exact, 0.01, row.truth, cause))
        bodies = [Body(name=f"b{i}", mesh=sheet(p, mend=False)) for i, p in enumerate((one, second))]
        geometry = Geometry(Scene(bodies=bodies, frequency=FREQUENCY).facets(0.0))
        s = amplitudes(geometry, far(0.0), far(0.0), bounces=1)
        level = 4 * np.pi * abs(s[0, 0]) ** 2
        row = same_db(f"two bodies: {name}", level, exact, 0.01, "energy: what is behind is not lit")
        rows.append(row if row.passed else same_db(row.name, level, exact, 0.01, row.truth, cause))
    gap = (small[0] + [1e-3, 0, 0], small[1])
    r = rcs(sheet(one, gap, mend=False), FREQUENCY, 0.0, tolerance_db=0.05, max_bounces=1)
    k = 2 * np.pi / LAMBDA
    exact = 4 * np.pi * (abs(0.0084 + 0.0016 * np.exp(2j * k * 1e-3)) / LAMBDA) ** 2
    rows.append(
        same_db("small plate 1 mm before a great one", float(r.sigma), exact, 0.05, "closed form: shadow cut out")
    )
    return rows


def split_in_four(quick: bool) -> Outcome:
    """Cut every triangle of flat bodies in four: the surface is the same."""
    rows = []
    cases: tuple[tuple[str, dict[str, Any], float, float], ...] = (
        ("plate", {"width": 0.1, "height": 0.07}, 12.0, 5.0),
        ("dihedral", {"size": 0.1}, 10.0, 4.0),
        ("trihedral", {"size": 0.1}, 8.0, -6.0),
        ("box", {"length": 0.2, "width": 0.1, "height": 0.1}, 3.0, 2.0),
    )
    for name, params, az, el in cases:
        mesh = build(name, params)
        one = rcs(mesh, FREQUENCY, az, el, tolerance_db=0.02)
        four = rcs(_quartered(mesh), FREQUENCY, az, el, tolerance_db=0.02)
        note = f"stated error {float(one.error_db):.3f} and {float(four.error_db):.3f} dB"
        rows.append(same_db(f"{name} at 0.02 dB", float(four.sigma), float(one.sigma), 0.01, "symmetry: mesh", note))
    return Outcome(rows)


def _quartered(mesh: Mesh) -> Mesh:
    """Return a flat-faced mesh with every triangle cut in four by its edges' middles."""
    c = mesh.corners
    m = 0.5 * (c + np.roll(c, -1, axis=1))
    a, b, d = c[:, 0], c[:, 1], c[:, 2]
    parts = [np.stack(t, axis=1) for t in ((a, m[:, 0], m[:, 2]), (m[:, 0], b, m[:, 1]), (m[:, 2], m[:, 1], d))]
    parts.append(m)
    corners = np.concatenate(parts)
    n = np.tile(mesh.normals, (4, 1, 1))
    return make_mesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3), normals=n)


def lattice(quick: bool) -> Outcome:
    """Cut tubes off the middle of their edges: the converged RCS must not depend on where the cuts are."""
    rows = []
    cases: tuple[tuple[str, dict[str, Any], float, float, int], ...] = (
        ("sphere", {"radius": 0.2}, 20.0, 10.0, 3),
        ("dihedral", {"size": 0.1}, 12.0, 4.0, 3),
        ("trihedral", {"size": 0.1}, 8.0, -6.0, 3),
        ("cylinder", {"radius": 0.1, "height": 0.3}, 5.0, 0.0, 3),
        ("pedestrian", {}, 30.0, 0.0, 2),
    )
    for name, params, az, el, bounces in cases[: 3 if quick else 5]:
        geometry = geometry_of(build(name, params))
        level, stated = _settled(geometry, far(az, el), bounces, 0.0)
        for jitter in (0.13,) if name == "pedestrian" else (0.13, 0.3):
            other, its = _settled(geometry, far(az, el), bounces, jitter)
            # Where the ray budget ends before the tolerance is met, the stated errors of both lattices are allowed.
            allowed = _TOLERANCE_DB if max(stated, its) <= _TOLERANCE_DB else stated + its
            note = f"stated error {stated:.3f} and {its:.3f} dB; {geometry.rays} rays in all launches"
            rows.append(
                same_db(f"{name}, cuts {jitter:g} off the middle", other, level, allowed, "symmetry: lattice", note)
            )
    return Outcome(rows)


def _settled(geometry: Geometry, end: Leg, bounces: int, jitter: float) -> tuple[float, float]:
    """Return |S|^2 [m2] of VV and its stated error [dB], refined on one lattice until two launches agree within
    _TOLERANCE_DB or a million rays are cast."""
    before, level, stated, spent = 0j, 0j, 60.0, geometry.rays
    for step in range(6):
        level = complex(amplitudes(geometry, end, end, step, bounces, jitter)[0, 0])
        stated = stated_error(level, abs(level - before))
        if step and (stated <= _TOLERANCE_DB or geometry.rays - spent > 1_000_000):
            break
        before = level
    return abs(level) ** 2, stated


REGIMES = (
    Regime("far_from_home", "Scene moved by 10 km and turned", far_from_home),
    Regime("facet_sizes", "Facets of 1e-6 to 1e2 m", facet_sizes),
    Regime("bad_faces", "Duplicate, flipped, coplanar and zero-area faces", bad_faces),
    Regime("split", "Every triangle cut in four", split_in_four),
    Regime("lattice", "Another lattice of tubes", lattice),
)
