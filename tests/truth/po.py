"""Physical optics by dense quadrature and in closed form (Balanis, Advanced EE, 2012, ch. 7 and 11).

Canonical plates and discs lie in the plane x = 0 and face +x; a cylinder's axis is z. The default currents are those of
the reflected field, J = n x H_r and M = -n x E_r (reciprocal for conductors); form="classic" is J = 2 n x H_i.
V and H are theta-hat and phi-hat of the direction in which each end's wave travels towards the point of the target.
"""

from __future__ import annotations

import numpy as np
from scipy.special import j1

NODES, CYCLES = 20, 4.0
"""Gauss-Legendre nodes in each panel, and cycles of phase that a panel may hold."""


def direction(azimuth, elevation=0.0):
    """Return the unit vector of azimuth and elevation [rad]."""
    return np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])


def polarisations(travel):
    """(2, ..., 3): theta-hat and phi-hat of directions of travel (..., 3)."""
    flat = np.hypot(travel[..., 0], travel[..., 1])
    safe = np.where(flat > 0, flat, 1.0)
    c, s = np.where(flat > 0, travel[..., 0] / safe, 1.0), travel[..., 1] / safe
    theta = np.stack([c * travel[..., 2], s * travel[..., 2], -flat], axis=-1)
    return np.stack([theta, np.stack([-s, c, np.zeros_like(c)], axis=-1)])


def wave(points, end):
    """Direction of travel, amplitude D/r and excess length r - D of an end's wave at points (n, 3)."""
    to_end, distance = np.asarray(end[0], float), float(end[1])
    if np.isinf(distance):
        return np.broadcast_to(-to_end, points.shape), np.ones(len(points)), -points @ to_end
    ray = points - distance * to_end
    r = np.sqrt(np.sum(ray**2, axis=1))
    excess = (np.sum(points**2, axis=1) - 2 * distance * points @ to_end) / (r + distance)
    return ray / r[:, None], distance / r, excess


def dots(a, b):
    """Dot products along the last axis."""
    return np.sum(a * b, axis=-1)


def reflected(e, k_in, n, geometry):
    """(E_r, eta H_r) of fields e (..., 3) at planes of normal n; surface(cos_i) -> (R_s, R_p), None a conductor."""
    k_out = k_in - 2 * dots(k_in, n)[..., None] * n
    if geometry is None:
        e_r = -e + 2 * dots(e, n)[..., None] * n
    else:
        s = np.cross(k_in, n)
        size = np.linalg.norm(s, axis=-1, keepdims=True)
        other = np.cross(n, np.where(np.abs(n[..., :1]) < 0.7, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]))
        s = np.where(size > 1e-9, s / np.maximum(size, 1e-30), other / np.linalg.norm(other, axis=-1, keepdims=True))
        r_s, r_p = geometry(-dots(k_in, n))
        e_r = (r_s * dots(e, s))[..., None] * s + (r_p * dots(e, np.cross(s, k_in)))[..., None] * np.cross(s, k_out)
    return e_r, np.cross(k_out, e_r)


def coupling(n, k_in, e_in, k_out, e_out, geometry=None, form="huygens"):
    """Reaction per unit area of the surface's currents with the receiver's would-be wave (e_out along k_out)."""
    if form == "reciprocal":
        there = coupling(n, k_in, e_in, k_out, e_out, geometry)
        return 0.5 * (there + coupling(n, k_out, e_out, k_in, e_in, geometry))
    if form == "classic":
        return dots(e_out, 2 * np.cross(n, np.cross(k_in, e_in)))
    e_r, h_r = reflected(e_in, k_in, n, geometry)
    return dots(e_out, np.cross(n, h_r)) + dots(np.cross(k_out, e_out), np.cross(n, e_r))


def amplitude(points, normals, weights, k, tx, rx=None, geometry=None, form="huygens"):
    """S (2, 2) [m] of surface samples (n, 3) with area weights, all taken as lit and seen."""
    k_in, a_in, l_in = wave(points, tx)
    if rx is None and geometry is None:
        # both ends in one place: the currents couple like to like, with 2 cos(theta_i) in every form
        lone = np.sum(-2 * dots(k_in, normals) * weights * a_in**2 * np.exp(-2j * k * l_in))
        return -1j * k / (4 * np.pi) * lone * np.eye(2)
    k_out, a_out, l_out = wave(points, tx if rx is None else rx)
    e_in, e_out = polarisations(k_in), polarisations(k_out)
    field = weights * a_in * a_out * np.exp(-1j * k * (l_in + l_out))
    n = np.broadcast_to(normals, points.shape)
    pairs = [
        [np.sum(field * coupling(n, k_in, e_in[b], k_out, e_out[a], geometry, form)) for b in (0, 1)] for a in (0, 1)
    ]
    return -1j * k / (4 * np.pi) * np.array(pairs)


def line(panels):
    """Composite Gauss-Legendre nodes and weights on [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(NODES)
    start = np.arange(panels)[:, None]
    return ((start + 0.5 + 0.5 * x) / panels).ravel(), np.tile(0.5 * w / panels, panels)


def _panels(edge, corners, k, ends, finer):
    """Panels along an edge so that none holds more than CYCLES of two-way phase."""
    slopes = sum(wave(corners, end)[0] @ edge for end in ends)
    return int(np.ceil(finer * (1.3 * np.max(np.abs(slopes)) * k / (2 * np.pi) / CYCLES + 1)))


def converged(cached, rtol):
    """Value of once(finer) that a grid half again as fine confirms; ArithmeticError otherwise."""
    coarse, scale = cached(1.0)
    fine, _ = cached(1.5)
    if np.max(np.abs(fine - coarse)) > rtol * max(np.max(np.abs(fine)), 1e-6 * scale):
        raise ArithmeticError("quadrature has not converged")
    return fine


def patch_nodes(corner, u, v, k, ends, finer, triangle):
    """Yield chunks (points, weights) over a parallelogram (or triangle corner, corner+u, corner+v)."""
    corners = corner + np.array([0 * u, u, v, u + v])[: 3 if triangle else 4]
    along = [[u, v], [v - u]] if triangle else [[u], [v]]
    (s, ws), (t, wt) = (line(max(_panels(e, corners, k, ends, finer) for e in edges)) for edges in along)
    area = np.linalg.norm(np.cross(u, v))
    step = max(1, 200_000 // t.size)
    for i in range(0, s.size, step):
        si, wi = s[i : i + step, None, None], ws[i : i + step, None]
        cross = si * t[:, None] * (v - u) if triangle else t[:, None] * v
        weights = area * wi * wt * (si[..., 0] if triangle else 1.0)
        yield (corner + si * u + cross).reshape(-1, 3), weights.ravel()


def polygon(corners, k, tx, rx=None, geometry=None, form="huygens", rtol=1e-7):
    """S (2, 2) of a convex planar polygon (m, 3), counter-clockwise seen from its face; zero from behind."""
    p = np.asarray(corners, float)
    ends = [tx, tx if rx is None else rx]
    normal = unit_normal(p)
    if any(side(p[0], normal, end) <= 0 for end in ends):
        return np.zeros((2, 2), complex)
    square = len(p) == 4 and np.allclose(p[0] + p[2], p[1] + p[3], atol=1e-12)
    patches = (
        [(p[0], p[1] - p[0], p[3] - p[0])]
        if square
        else [(p[0], p[i] - p[0], p[i + 1] - p[0]) for i in range(1, len(p) - 1)]
    )

    def cached(finer):
        total, area = np.zeros((2, 2), complex), 0.0
        for patch in patches:
            for points, weights in patch_nodes(*patch, k, ends, finer, not square):
                total = total + amplitude(points, normal, weights, k, tx, rx, geometry, form)
                area += weights.sum()
        return total, area * k

    return converged(cached, rtol)


def triangles(corners, k, tx, rx=None, geometry=None, form="huygens", rtol=1e-7):
    """S (2, 2) of triangles (n, 3, 3) without shadowing: those that both ends see from the front."""
    return sum((polygon(t, k, tx, rx, geometry, form, rtol) for t in corners), np.zeros((2, 2), complex))


def unit_normal(p):
    """Return the unit normal of a planar polygon."""
    n = np.sum(np.cross(p, np.roll(p, -1, axis=0)), axis=0)
    return n / np.linalg.norm(n)


def side(point, normal, end):
    """Positive where the end sees the front of a plane."""
    to_end, distance = np.asarray(end[0], float), float(end[1])
    return normal @ (to_end if np.isinf(distance) else distance * to_end - point)


def fourier(corners, g, n=None):
    """Integral of exp(j g.P) over a planar polygon (m, 3) (Gordon 1975, by the divergence theorem); n its unit normal,
    which a sliver's corners do not tell."""
    p = np.asarray(corners, float)
    n = unit_normal(p) if n is None else n
    nxt = np.roll(p, -1, axis=0)
    w = g - (g @ n) * n
    size = w @ w
    if np.sqrt(size) * np.ptp(p, axis=0).max() < 1e-4:
        total = 0j
        for i in range(1, len(p) - 1):
            a, b, c = p[0], p[i], p[i + 1]
            mids = np.array([a + b, b + c, c + a]) / 2
            total += 0.5 * (np.cross(b - a, c - a) @ n) * np.mean(np.exp(1j * mids @ g))
        return total
    edge, middle = nxt - p, (p + nxt) / 2
    terms = (np.cross(edge, n) @ w) * np.exp(1j * middle @ g) * np.sinc(edge @ w / (2 * np.pi))
    return terms.sum() / (1j * size)


def polygon_far(corners, k, tx, rx=None, geometry=None, form="huygens"):
    """S (2, 2) of a planar polygon in the far field: vector factor times exact Fourier integral."""
    p = np.asarray(corners, float)
    rx = tx if rx is None else rx
    normal = unit_normal(p)
    if normal @ tx <= 0 or normal @ rx <= 0:
        return np.zeros((2, 2), complex)
    return vector_factor(normal, tx, rx, geometry, form) * (-1j * k / (4 * np.pi)) * fourier(p, k * (tx + rx))


def vector_factor(normal, tx, rx, geometry=None, form="huygens"):
    """(2, 2) coupling per unit area of plane waves of directions tx, rx (towards the ends)."""
    e_in, e_out = polarisations(-tx), polarisations(-rx)
    return np.array([[coupling(normal, -tx, e_in[b], -rx, e_out[a], geometry, form) for b in (0, 1)] for a in (0, 1)])


def rectangle(width, height):
    """Corners of the canonical plate: width along y, height along z, facing +x."""
    y, z = width / 2, height / 2
    return np.array([[0, -y, -z], [0, y, -z], [0, y, z], [0, -y, z]])


def rectangle_far(width, height, k, tx, rx=None, geometry=None, form="huygens"):
    """S (2, 2) of the canonical plate in the far field: one sinc an axis (Balanis eq. 11-37)."""
    rx = tx if rx is None else rx
    q = tx + rx
    shape = width * height * np.sinc(k * width * q[1] / (2 * np.pi)) * np.sinc(k * height * q[2] / (2 * np.pi))
    return vector_factor(np.array([1.0, 0, 0]), tx, rx, geometry, form) * (-1j * k / (4 * np.pi)) * shape


def disc_far(radius, k, tx, rx=None, geometry=None, form="huygens"):
    """S (2, 2) of a disc facing +x in the far field: 2 pi a^2 J1(w)/w (Balanis eq. 11-60 ff.)."""
    rx = tx if rx is None else rx
    w = k * radius * np.hypot(*(tx + rx)[1:])
    shape = np.pi * radius**2 * (2 * j1(w) / w if w > 1e-6 else 1.0)
    return vector_factor(np.array([1.0, 0, 0]), tx, rx, geometry, form) * (-1j * k / (4 * np.pi)) * shape


def _disc(centre, u, v, radius, k, ends, finer):
    """Yield chunks over a disc spanned by unit vectors u, v."""
    corners = centre + radius * np.array([u, v, -u, -v])
    across = max(_panels(2 * radius * e, corners, k, ends, finer) for e in (u, v))
    (r, wr), (f, wf) = line(across), line(int(np.pi * across) + 2)
    ring = np.cos(2 * np.pi * f)[:, None] * u + np.sin(2 * np.pi * f)[:, None] * v
    for ri, wi in zip(r, wr, strict=True):
        yield centre + radius * ri * ring, 2 * np.pi * radius**2 * ri * wi * wf


def disc(radius, k, tx, rx=None, geometry=None, form="huygens", rtol=1e-7):
    """S (2, 2) of a disc facing +x by quadrature, near or far."""
    n, ends = np.array([1.0, 0, 0]), [tx, tx if rx is None else rx]

    def cached(finer):
        parts = _disc(np.zeros(3), np.array([0, 1.0, 0]), np.array([0, 0, 1.0]), radius, k, ends, finer)
        return sum(amplitude(p, n, w, k, tx, rx, geometry, form) for p, w in parts), np.pi * radius**2 * k

    return converged(cached, rtol)


def cylinder(radius, height, k, tx, rx=None, geometry=None, form="huygens", caps=True, rtol=1e-6):
    """S (2, 2) of a cylinder about z, centred at the origin: the side that both ends see, and its caps."""
    ends = [tx, tx if rx is None else rx]
    low, high = -np.inf, np.inf
    middle = np.arctan2(ends[0][0][1], ends[0][0][0])
    for to_end, distance in ends:
        flat = np.hypot(to_end[0], to_end[1])
        # an end sees the side where its horizontal distance times cos(phi - phi_end) exceeds the radius
        ratio = 0.0 if np.isinf(distance) else radius / (distance * flat)
        half = np.arccos(min(ratio, 1.0)) if flat > 1e-12 else 0.0
        off = (np.arctan2(to_end[1], to_end[0]) - middle + np.pi) % (2 * np.pi) - np.pi
        low, high = max(low, off - half), min(high, off + half)

    def cached(finer):
        total = np.zeros((2, 2), complex)
        if high > low:
            turns = int(finer * (4 * k * radius / (2 * np.pi) / CYCLES + 2))
            f, wf = line(turns)
            phi = middle + low + (high - low) * f
            n = np.stack([np.cos(phi), np.sin(phi), 0 * phi], axis=1)
            corners = np.concatenate(
                [radius * n[:: max(1, n.shape[0] // 8)] + [0, 0, z] for z in (-height / 2, height / 2)]
            )
            z, wz = line(_panels(np.array([0, 0, height]), corners, k, ends, finer))
            for zi, wi in zip(z, wz, strict=True):
                weights = radius * (high - low) * wf * height * wi
                points = radius * n + [0, 0, height * (zi - 0.5)]
                total = total + amplitude(points, n, weights, k, tx, rx, geometry, form)
        for sign in (1.0, -1.0):
            top, n = np.array([0, 0, sign * height / 2]), np.array([0, 0, sign])
            if caps and all(side(top, n, end) > 1e-12 for end in ends):
                for p, w in _disc(top, np.array([1.0, 0, 0]), np.array([0, 1.0, 0]), radius, k, ends, finer):
                    total = total + amplitude(p, n, w, k, tx, rx, geometry, form)
        return total, 2 * radius * height * k

    return converged(cached, rtol)
