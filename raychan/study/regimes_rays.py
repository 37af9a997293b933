"""Regimes of rays: parallel mirrors, concave reflectors, near fields."""

from __future__ import annotations

from typing import Any

import numpy as np

from raychan.records import REFLECT
from raychan.run.rcs import rcs
from raychan.run.specular_paths import specular_paths
from raychan.study.regimes_base import (
    FREQUENCY,
    LAMBDA,
    Floats,
    K,
    Outcome,
    Regime,
    Row,
    at_most,
    plate_near,
    rectangle,
    same_db,
    sheet,
)
from raychan.world.body import Body
from raychan.world.material import Material
from raychan.world.meshes.mesh import Mesh, make_mesh
from raychan.world.scene import Scene
from raychan.world.shapes import build


def parallel_mirrors(quick: bool) -> Outcome:
    """Check two parallel mirrors: all images are found, no term exceeds free space, the last order has its share."""
    rows: list[Row] = []
    curves: dict[str, Any] = {}
    most = 6 if quick else 12
    gap, tx, rx = 1.0, np.array([0.0, 0.1, 0.0]), np.array([2.0, -0.2, 0.0])
    for label, material in (("conductor", Material(pec=True)), ("eps 6", Material(6.0))):
        tall = {"length": 2000.0, "width": 1.0, "height": 2000.0}
        bodies = [
            Body(name=n, shape="box", params=tall, position=(0.0, s * (0.5 * gap + 0.5), -1000.0), material=material)
            for n, s in (("left", 1.0), ("right", -1.0))
        ]
        p = specular_paths(Scene(bodies=bodies, frequency=FREQUENCY), tx, rx, most)
        order = (p.kind == REFLECT).sum(axis=1)
        rows.append(Row(f"{label}: paths", 2 * most + 1, len(p.length), 0, "paths", "closed form: images"))
        exact_length, exact_gain, exact_order = _images(gap, tx, rx, most, material)
        if len(p.length) == len(exact_length):
            rank = np.argsort(exact_length, kind="stable")
            off = np.abs(p.length - exact_length[rank]).max() * K
            rows.append(Row(f"{label}: lengths", 0.0, float(off), 1e-3, "rad", "closed form: images"))
            ratio = np.abs(p.gain[:, 0, 0]) / np.abs(exact_gain[rank])
            worst = float(np.abs(20 * np.log10(ratio)).max())
            rows.append(Row(f"{label}: gains", 0.0, worst, 1e-6, "dB", "closed form: images and Fresnel"))
        free = np.abs(p.gain[:, 0, 0]) * 4 * np.pi * p.length / LAMBDA
        rows.append(
            Row(f"{label}: strongest term over free space", 1.0, float(free.max()), 1e-12, "", "energy", bound=True)
        )
        seen = np.array([np.abs(p.gain[order == i, 0, 0]).sum() for i in range(most + 1)])
        exact = np.array([np.abs(exact_gain[exact_order == i]).sum() for i in range(most + 1)])
        curves[label] = np.stack([np.arange(most + 1), seen, exact])
    share = float(curves["eps 6"][1, -1] / curves["eps 6"][1].sum())
    bound = float(curves["eps 6"][2, -1] / curves["eps 6"][2].sum())
    rows.append(Row("eps 6: last order's share of the sum", bound, share, 1e-9, "", "closed form: images"))
    return Outcome(rows + _trough(), curves)


def _images(gap: float, tx: Floats, rx: Floats, most: int, material: Material) -> tuple[Floats, Floats, Any]:
    """Return lengths, gains and orders of all images between two mirrors, E along both planes' common line (s)."""
    lengths, gains, orders = [], [], []
    eps = material.eps(FREQUENCY)
    for n in range(-most, most + 1):
        y = n * gap + (-1) ** n * tx[1]
        length = float(np.hypot(rx[0] - tx[0], rx[1] - y))
        cosine = abs(rx[1] - y) / length
        root = np.sqrt(eps - (1 - cosine**2) + 0j)
        r = 1.0 if material.pec else abs((cosine - root) / (cosine + root))
        lengths.append(length)
        gains.append(LAMBDA / (4 * np.pi * length) * r ** abs(n))
        orders.append(abs(n))
    return np.array(lengths), np.array(gains), np.array(orders)


def _trough() -> list[Row]:
    """Return the check that the RCS of two facing plates no longer changes once all rays have left."""
    pair = sheet(
        rectangle((0.0, 0.05, -0.05), (0.2, 0, 0), (0, 0, 0.1)),
        rectangle((0.0, -0.05, -0.05), (0, 0, 0.1), (0.2, 0, 0)),
    )
    few, many = (rcs(pair, FREQUENCY, 37.0, tolerance_db=0.1, max_bounces=n).sigma for n in (4, 6))
    return [same_db("tubes between two plates: 6 against 4 bounces", float(many), float(few), 0.01, "limit: rays left")]


def dish(radius: float, half_angle: float, rings: int, sides: int) -> Mesh:
    """Return a concave spherical bowl about +x, vertex at the origin, exact normals facing the centre [m, rad]."""
    theta = np.linspace(0.0, half_angle, rings + 1)
    phi = np.arange(sides) * 2 * np.pi / sides
    t, p = np.meshgrid(theta[1:], phi, indexing="ij")
    grid = np.stack([1 - np.cos(t), np.sin(t) * np.cos(p), np.sin(t) * np.sin(p)], axis=-1).reshape(-1, 3)
    v = radius * np.concatenate([np.zeros((1, 3)), grid])
    j = np.arange(sides)
    nxt = (j + 1) % sides
    faces = [np.column_stack([0 * j, 1 + j, 1 + nxt])]
    for i in range(rings - 1):
        low, high = 1 + i * sides, 1 + (i + 1) * sides
        faces.append(np.column_stack([low + j, high + j, high + nxt]))
        faces.append(np.column_stack([low + j, high + nxt, low + nxt]))
    f = np.concatenate(faces)
    normals = (np.array([radius, 0.0, 0.0]) - v) / radius
    return make_mesh(v, f, normals=normals[f])


def concave(quick: bool) -> Outcome:
    """Check bowls seen from their focus and centre, where all rays meet, and a deep one over several bounces."""
    rows: list[Row] = []
    radius, half = 0.5, 0.2
    # Many sides: the phase resolves the difference between a rim of chords and a circle.
    bowl = dish(radius, half, 8, 96 if quick else 384)
    views = (("centre", 0.5), ("twice the radius", 1.0), ("half its focal length", 0.125), ("focus", 0.25))
    for name, d in views[: 2 if quick else 4]:
        r = rcs(bowl, FREQUENCY, 0.0, distance=d, tolerance_db=0.1, max_bounces=1)
        x, w = np.polynomial.legendre.leggauss(400)
        t, w = 0.5 * half * (1 + x), 0.5 * half * w
        to = np.stack([d - radius * (1 - np.cos(t)), -radius * np.sin(t)])
        length = np.hypot(*to)
        cosine = (to[0] * np.cos(t) - to[1] * np.sin(t)) / length
        e = (
            K
            / (2 * np.pi)
            * np.sum(w * 2 * np.pi * radius**2 * np.sin(t) * cosine / length**2 * np.exp(-2j * K * length))
        )
        exact = 4 * np.pi * d**4 * abs(e) ** 2
        rows.append(same_db(f"bowl from its {name}", float(r.sigma), exact, 0.1, "physical optics by a 1-D quadrature"))
    rings = (6, 9) if quick else (8, 12)
    # The same rim for both: only the facets between differ.
    deep = [rcs(dish(0.05, 1.3, n, 72), FREQUENCY, 0.0, tolerance_db=0.25, max_bounces=4) for n in rings]
    stated = [float(r.error_db) for r in deep]
    truth = "symmetry: two meshes of one bowl"
    one, two = (float(r.sigma) for r in deep)
    rows.append(same_db("deep bowl, 4 bounces, in stated error", two, one, sum(stated), truth))
    note = f"{max(int(r.rays) for r in deep)} rays"
    if max(stated) > 0.25:
        note += ": the ray budget ended; there are caustics between the bounces"
    rows.append(at_most("deep bowl: stated error, 0.25 asked", max(stated), 0.25, "dB", "tolerance asked", note))
    return Outcome(rows)


def near_field(quick: bool) -> Outcome:
    """Check plates seen from within their own near field, down to a few wavelengths."""
    rows = []
    cases = [(1.5, 25.0), (1.5, 12.0), (1.5, 3.0), (0.5, 1.0), (0.5, 0.3), (0.2, 0.1), (0.1, 0.02), (0.05, 0.005)]
    for width, d in cases[1:6] if quick else cases:
        plate = build("plate", {"width": width, "height": width})
        r = rcs(plate, FREQUENCY, 0.0, distance=d, tolerance_db=0.05, max_bounces=1)
        truth = "physical optics by quadrature"
        note = f"far field from {2 * width**2 / LAMBDA:.3g} m; {int(r.rays)} rays; stated {float(r.error_db):.3f} dB"
        rows.append(
            same_db(f"plate {width:g} m from {d:g} m", float(r.sigma), plate_near(width, width, d), 0.05, truth, note)
        )
    return Outcome(rows, {"distance": [d for _, d in cases], "off": [r.seen for r in rows]})


REGIMES = (
    Regime("parallel", "Parallel mirrors", parallel_mirrors),
    Regime("concave", "Concave reflectors and caustics", concave),
    Regime("near", "Target in the near field of the plate", near_field),
)
