"""All specular paths between two points by images over every sequence of flat faces: plain loops in float64."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from . import slab


@dataclass
class Face:
    """Convex planar face: corners (m, 3); surface(cos_i) -> (R_s, R_p) or, for thin layers, (R_s, R_p, T_s, T_p)."""

    corners: np.ndarray
    geometry: Callable = slab.pec
    body: str = ""
    lets_through: bool = False

    def __post_init__(self):
        self.corners = np.asarray(self.corners, float)
        a, b, c = self.corners[:3]
        n = np.cross(b - a, c - a)
        self.n = n / np.linalg.norm(n)


@dataclass
class Path:
    """One specular path: points from tx to rx, faces met, length [m], gain (2, 2)."""

    points: np.ndarray
    faces: tuple
    bodies: tuple
    length: float
    gain: np.ndarray


def box(low, high, geometry=slab.pec, body="box"):
    """Six faces of an axis-parallel box, normals outward."""
    corners = np.array(list(itertools.product(*zip(low, high, strict=True))))
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return [Face(corners[list(q)], geometry, body) for q in quads]


def ground(size=1e3, height=0.0, geometry=slab.pec, body="ground"):
    """Large horizontal square facing up."""
    s = size
    return [Face([[-s, -s, height], [s, -s, height], [s, s, height], [-s, s, height]], geometry, body)]


def _mirror(point, face):
    return point - 2 * ((point - face.corners[0]) @ face.n) * face.n


def _inside(point, face):
    count = len(face.corners)
    for i in range(count):
        a, b = face.corners[i], face.corners[(i + 1) % count]
        if np.cross(b - a, point - a) @ face.n < 0:
            return False
    return True


def _hit_triangle(start, ray, a, b, c):
    """Parameter of a ray's hit on a triangle (Moeller & Trumbore 1997), or None."""
    u, v = b - a, c - a
    p = np.cross(ray, v)
    det = u @ p
    if det == 0.0:
        return None
    s = start - a
    x = (s @ p) / det
    q = np.cross(s, u)
    y = (ray @ q) / det
    if x < 0 or y < 0 or x + y > 1:
        return None
    return (v @ q) / det


def _crossed(start, stop, faces, skip):
    """Faces that the open segment crosses, in order."""
    ray = stop - start
    met = []
    for f, face in enumerate(faces):
        if f in skip:
            continue
        for i in range(1, len(face.corners) - 1):
            t = _hit_triangle(start, ray, face.corners[0], face.corners[i], face.corners[i + 1])
            if t is not None and 1e-12 < t < 1 - 1e-12:
                met.append((t, f))
                break
    return [f for _, f in sorted(met)]


def _basis(travel):
    """(2, 3): theta-hat and phi-hat of a direction of travel."""
    flat = np.hypot(travel[0], travel[1])
    c, s = (travel[0] / flat, travel[1] / flat) if flat > 0 else (1.0, 0.0)
    return np.array([[c * travel[2], s * travel[2], -flat], [-s, c, 0.0]])


def _bounce(travel, face, through=False):
    """Return (new direction, 3 x 3 matrix of the field) at a face."""
    n = face.n if travel @ face.n < 0 else -face.n
    out = travel if through else travel - 2 * (travel @ n) * n
    s = np.cross(travel, n)
    if np.linalg.norm(s) < 1e-9:
        s = np.cross(n, [1.0, 0, 0] if abs(n[0]) < 0.7 else [0, 1.0, 0])
    s /= np.linalg.norm(s)
    both = face.geometry(abs(travel @ n))
    c_s, c_p = both[2:4] if through else both[:2]
    return out, c_s * np.outer(s, s) + c_p * np.outer(np.cross(s, out), np.cross(s, travel))


def _trace(order, tx, rx, faces):
    """Points of the path over faces `order`, or None where a mirror is missed."""
    images = [tx]
    for f in order:
        images.append(_mirror(images[-1], faces[f]))
    points, target = [rx], rx
    for f, image in zip(reversed(order), reversed(images[1:]), strict=True):
        face = faces[f]
        ray = target - image
        d = ray @ face.n
        if d == 0.0:
            return None
        t = ((face.corners[0] - image) @ face.n) / d
        if not 0 < t < 1:
            return None
        target = image + t * ray
        if not _inside(target, face):
            return None
        points.append(target)
    return np.array([*points, tx])[::-1]


def specular_paths(tx, rx, faces, frequency, max_bounces=3):
    """Every unblocked path of up to max_bounces reflections (layers also let through), line of sight included."""
    tx, rx = np.asarray(tx, float), np.asarray(rx, float)
    k = 2 * np.pi * frequency / 299_792_458.0
    found = []
    for bounces in range(max_bounces + 1):
        for order in itertools.product(range(len(faces)), repeat=bounces):
            if any(a == b for a, b in itertools.pairwise(order)):
                continue
            points = _trace(order, tx, rx, faces)
            path = None if points is None else _carry(points, order, faces, k)
            if path is not None:
                found.append(path)
    return sorted(found, key=lambda path: path.length)


def _carry(points, order, faces, k):
    """Field carried along points, or None where an opaque face stands in the way."""
    field, length = np.eye(3, dtype=complex), 0.0
    first = travel = None
    for leg in range(len(points) - 1):
        start, stop = points[leg], points[leg + 1]
        size = np.linalg.norm(stop - start)
        length += size
        travel = (stop - start) / size
        first = travel if first is None else first
        for f in _crossed(start, stop, faces, order[max(leg - 1, 0) : leg + 1]):
            if not faces[f].lets_through:
                return None
            field = _bounce(travel, faces[f], through=True)[1] @ field
        if leg < len(order):
            field = _bounce(travel, faces[order[leg]])[1] @ field
    jones = _basis(travel) @ field @ _basis(first).T
    gain = np.exp(-1j * k * length) / (2 * k * length) * jones
    return Path(points, tuple(order), tuple(faces[f].body for f in order), length, gain)
