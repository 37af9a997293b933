"""Corner reflectors: geometrical optics over every ordered sequence of faces, physical optics on the last.

The lit footprint on the last face is an exact convex polygon: earlier faces, unfolded over the mirrors, are projected
from the image of the source onto it and clipped (Sutherland & Hodgman 1974); shadows cast by other faces on any leg
are cut off. Far field: Gordon's polygon integral. Near: dense quadrature.
Faces conduct perfectly and reflect on both sides.
"""

from __future__ import annotations

import itertools

import numpy as np

from . import po

TINY = 1e-12


def dihedral_faces(a, b):
    """Two faces a x b at +-45 degrees meeting in the z axis (length b), open towards +x."""
    c, z = a / np.sqrt(2), b / 2
    left = np.array([[0, 0, -z], [c, c, -z], [c, c, z], [0, 0, z]])
    right = np.array([[0, 0, -z], [0, 0, z], [c, -c, z], [c, -c, -z]])
    return [left, right]


def trihedral_faces(a, square=False):
    """Three faces with legs a meeting at the origin, boresight +x, one edge in the plane y = 0 pointing up."""
    x, y, z = np.eye(3)
    boresight = np.ones(3) / np.sqrt(3)
    up = z - (z @ boresight) * boresight
    up /= np.linalg.norm(up)
    turn = np.array([boresight, np.cross(up, boresight), up])
    faces = []
    for p, q in ((x, y), (y, z), (z, x)):
        corners = [0 * p, a * p, a * (p + q), a * q] if square else [0 * p, a * p, a * q]
        faces.append(np.array(corners) @ turn.T)
    return faces


def mesh(faces):
    """trimesh.Trimesh of precisely these faces, normals towards the open side."""
    import trimesh

    vertices, triangles = [], []
    for f in faces:
        first = len(vertices)
        vertices += list(f)
        triangles += [(first, first + i, first + i + 1) for i in range(1, len(f) - 1)]
    return trimesh.Trimesh(np.array(vertices), np.array(triangles), process=False)


class Plane:
    """Mirror plane of a face."""

    def __init__(self, face):
        self.n = po.unit_normal(face)
        self.p = face[0]

    def mirror(self, points):
        """Return the mirror images of points (..., 3)."""
        return points - 2 * ((points - self.p) @ self.n)[..., None] * self.n

    def side(self, homogeneous):
        """Return the height of (x, y, z, w) over the plane; w = 0 is a direction."""
        return self.n @ homogeneous[:3] - homogeneous[3] * (self.n @ self.p)

    def image(self, homogeneous):
        """Return the mirror image of (x, y, z, w)."""
        return np.append(homogeneous[:3] - 2 * self.side(homogeneous) * self.n, homogeneous[3])


def keep(polygon, plane, sign):
    """Part of a convex polygon on one side of a plane."""
    out = []
    if len(polygon) == 0:
        return polygon
    s = sign * ((polygon - plane.p) @ plane.n)
    for i in range(len(polygon)):
        j = (i + 1) % len(polygon)
        if s[i] >= 0:
            out.append(polygon[i])
        if (s[i] > 0 > s[j]) or (s[i] < 0 < s[j]):
            out.append(polygon[i] + (polygon[j] - polygon[i]) * s[i] / (s[i] - s[j]))
    return np.array(out) if len(out) >= 3 else np.zeros((0, 3))


def project(polygon, source, plane):
    """Shadow of a polygon on a plane; source homogeneous (x y z w), w = 0 a direction."""
    h = np.column_stack([polygon, np.ones(len(polygon))])
    s = plane.side(source)
    p = np.array([plane.side(v) for v in h])
    shadow = s * h - p[:, None] * source
    return shadow[:, :3] / shadow[:, 3:]


def intersect(subject, clipper, n):
    """Intersection of two convex coplanar polygons, counter-clockwise about n."""
    if len(clipper) < 3:
        return np.zeros((0, 3))
    if np.sum(np.cross(clipper, np.roll(clipper, -1, axis=0)), axis=0) @ n < 0:
        clipper = clipper[::-1]
    for i in range(len(clipper)):
        edge = clipper[(i + 1) % len(clipper)] - clipper[i]
        if np.linalg.norm(edge) < TINY or len(subject) == 0:
            continue
        wall = object.__new__(Plane)
        wall.n, wall.p = np.cross(n, edge), clipper[i]
        subject = keep(subject, wall, 1.0)
    return subject


def area(polygon, n):
    """Signed area about n."""
    return 0.0 if len(polygon) < 3 else 0.5 * np.sum(np.cross(polygon, np.roll(polygon, -1, axis=0)), axis=0) @ n


def homogeneous(end):
    """Radar end as a homogeneous point."""
    to_end, distance = np.asarray(end[0], float), float(end[1])
    return np.append(to_end, 0.0) if np.isinf(distance) else np.append(distance * to_end, 1.0)


def footprints(faces, order, tx, rx):
    """Signed convex polygons [(sign, corners)] whose sum is the lit and seen part of the last face of `order`."""
    planes = [Plane(f) for f in faces]
    last = planes[order[-1]]
    source = homogeneous(tx)
    for f in order[:-1]:
        if abs(planes[f].side(source)) < TINY:
            return []
        source = planes[f].image(source)
    facing = last.side(source)
    if facing * last.side(homogeneous(rx)) <= TINY**2:
        return []
    n = last.n * np.sign(facing)

    def unfold(points, leg):
        for f in order[leg:-1]:
            points = planes[f].mirror(points)
        return points

    def before(points, leg, sign):
        """Clip to the source's side (sign +1) or far side (-1) of the unfolded face that ends a leg."""
        wall = Plane(unfold(faces[order[leg]], leg))
        return keep(points, wall, sign * np.sign(wall.side(source)))

    lit, holes = faces[order[-1]], []
    if area(lit, n) < 0:
        lit = lit[::-1]
    for leg in range(len(order)):
        window = unfold(faces[order[leg]], leg)
        if leg:
            window = before(window, leg - 1, -1.0)
        if len(window) < 3 or abs(last.side(source)) < TINY:
            return []
        lit = intersect(lit, window if leg == len(order) - 1 else project(window, source, last), n)
        for b in range(len(faces)):
            if b in (order[leg], order[leg - 1] if leg else -1):
                continue
            shade = before(unfold(faces[b], leg), leg, 1.0)
            if leg:
                shade = before(shade, leg - 1, -1.0)
            if len(shade) >= 3:
                holes.append(project(shade, source, last))
    for b in range(len(faces)):
        shade = keep(faces[b], last, np.sign(facing)) if b != order[-1] else np.zeros((0, 3))
        if len(shade) >= 3:
            holes.append(project(shade, homogeneous(rx), last))
    return minus(lit, holes, n)


def minus(polygon, holes, n):
    """Polygon without the union of holes, as signed convex polygons that do not overlap."""
    smallest = 1e-14 * max(area(polygon, n), TINY)
    parts = [polygon] if area(polygon, n) > smallest else []
    for hole in holes:
        if abs(area(hole, n)) > smallest:
            parts = [cut for part in parts for cut in beside(part, hole, n) if area(cut, n) > smallest]
    return [(1.0, part) for part in parts]


def beside(polygon, hole, n):
    """Convex parts of a convex polygon outside of a convex hole, one beyond each of its edges."""
    hole = hole if area(hole, n) > 0 else hole[::-1]
    for i in range(len(hole)):
        edge = hole[(i + 1) % len(hole)] - hole[i]
        if np.linalg.norm(edge) >= TINY and len(polygon):
            wall = object.__new__(Plane)
            wall.n, wall.p = np.cross(n, edge), hole[i]
            yield keep(polygon, wall, -1.0)
            polygon = keep(polygon, wall, 1.0)


def sequences(count, max_bounces):
    """All orders of faces without immediate repeats."""
    for m in range(1, max_bounces + 1):
        for order in itertools.product(range(count), repeat=m):
            if all(a != b for a, b in itertools.pairwise(order)):
                yield order


def _last_face(part, n, order, planes, k, tx, rx, form):
    """S (2, 2) of one convex footprint."""
    turn, offset = np.eye(3), np.zeros(3)
    for f in order[:-1]:
        turn, offset = turn - 2 * np.outer(planes[f].n, planes[f].n @ turn), planes[f].mirror(offset)
    flip = (-1.0) ** (len(order) - 1)
    if np.isinf(tx[1]) and np.isinf(rx[1]):
        # the image of the plane wave: direction turned, phase kept at the mirrored origin
        image = turn @ tx[0]
        phase = np.exp(-1j * k * (image @ offset))
        e_in, e_out = flip * po.polarisations(-tx[0]) @ turn.T, po.polarisations(-rx[0])
        pairs = [[po.coupling(n, -image, e_in[b], -rx[0], e_out[a], None, form) for b in (0, 1)] for a in (0, 1)]
        return np.array(pairs) * (-1j * k / (4 * np.pi)) * phase * po.fourier(part, k * (image + rx[0]), n)

    def samples(points, weights):
        k_tx, a_in, l_in = po.wave((points - offset) @ turn, tx)
        k_in, e_in = k_tx @ turn.T, flip * po.polarisations(k_tx) @ turn.T
        k_out, a_out, l_out = po.wave(points, rx)
        e_out = po.polarisations(k_out)
        field = weights * a_in * a_out * np.exp(-1j * k * (l_in + l_out))
        normals = np.broadcast_to(n, points.shape)
        pairs = [
            [np.sum(field * po.coupling(normals, k_in, e_in[b], k_out, e_out[a], None, form)) for b in (0, 1)]
            for a in (0, 1)
        ]
        return -1j * k / (4 * np.pi) * np.array(pairs)

    def cached(finer):
        total = np.zeros((2, 2), complex)
        # the image end bounds the phase slope as the true one does
        turned = po_image(tx, turn, offset)
        for i in range(1, len(part) - 1):
            patch = part[0], part[i] - part[0], part[i + 1] - part[0]
            if np.linalg.norm(np.cross(patch[1], patch[2])) < TINY**2:
                continue
            for points, weights in po.patch_nodes(*patch, k, [turned, rx], finer, True):
                total = total + samples(points, weights)
        return total, k * area(part, n)

    return po.converged(cached, 1e-6)


def po_image(end, turn, offset):
    """Return an end seen in the mirrors, as (direction, distance) from the origin."""
    if np.isinf(end[1]):
        return turn @ end[0], np.inf
    place = turn @ (end[0] * end[1]) + offset
    return place / np.linalg.norm(place), np.linalg.norm(place)


def corner(faces, k, tx, rx=None, max_bounces=3, form="huygens", orders=None):
    """S (2, 2) [m] of conducting faces (list of convex (m, 3)) up to max_bounces, or of the given orders only."""
    rx = tx if rx is None else rx
    planes = [Plane(f) for f in faces]
    total = np.zeros((2, 2), complex)
    for order in orders if orders is not None else sequences(len(faces), max_bounces):
        facing = planes[order[-1]].side(homogeneous(rx))
        n = planes[order[-1]].n * np.sign(facing)
        for sign, part in footprints(faces, order, tx, rx):
            total = total + sign * _last_face(part, n, order, planes, k, tx, rx, form)
    return total
