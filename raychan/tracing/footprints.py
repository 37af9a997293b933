"""Footprints: lengths at six points of each, and how obliquity, spreading and the curved surface's area vary over it
(numba kernels)."""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit


@njit(cache=True, forceinline=True)
def element_of(v, b, w, out):  # type: ignore[no-untyped-def]
    """Write the vector element of area (3,) [m^2] of the curved surface at barycentric w (3,): the cross product of its
    derivatives by the last two coordinates.

    Args: v (3, 3) [m] corners, b (3, 3) [m] edge curvatures (Nagata 2005, eq. 10).
    """
    for c in range(3):
        d, e = (c + 1) % 3, (c + 2) % 3
        along_d = v[1, d] - v[0, d] - (w[0] - w[1]) * b[0, d] - w[2] * (b[1, d] - b[2, d])
        along_e = v[1, e] - v[0, e] - (w[0] - w[1]) * b[0, e] - w[2] * (b[1, e] - b[2, e])
        aside_d = v[2, d] - v[0, d] + w[1] * (b[0, d] - b[1, d]) - (w[0] - w[2]) * b[2, d]
        aside_e = v[2, e] - v[0, e] + w[1] * (b[0, e] - b[1, e]) - (w[0] - w[2]) * b[2, e]
        out[c] = along_d * aside_e - along_e * aside_d


@njit(cache=True, forceinline=True)
def _mean_cosine(normal, k, back):  # type: ignore[no-untyped-def]
    """Return the mean of the cosines of incidence from both ends, waves travelling along k and back (3,)."""
    total = 0.0
    for c in range(3):
        total -= 0.5 * normal[c] * (k[c] + back[c])
    return total


@njit(cache=True, forceinline=True)
def _harmonic_cosine(normal, k, back):  # type: ignore[no-untyped-def]
    """Return the harmonic mean of the cosines of incidence from both ends, waves travelling along k and back (3,).

    Where a smooth surface mirrors it equals `_mean_cosine`. At the terminator of either end it falls to zero, as light
    does there; the plain mean would end abruptly, and its end would scatter.
    """
    one = two = 0.0
    for c in range(3):
        one -= normal[c] * k[c]
        two -= normal[c] * back[c]
    return 2.0 * one * two / (one + two) if one * two > 0.0 else 0.0


@njit(cache=True, forceinline=True)
def _back(p, image, far, k):  # type: ignore[no-untyped-def]
    """Write the unit direction in which a wave from the end travels at p (3,), and return its length [m]."""
    if far:
        along = 0.0
        for c in range(3):
            k[c] = -image[c]
            along -= p[c] * image[c]
        return along
    size = 0.0
    for c in range(3):
        k[c] = p[c] - image[c]
        size += k[c] * k[c]
    size = math.sqrt(size)
    for c in range(3):
        k[c] /= size
    return size


@njit(cache=True, forceinline=True)
def _share(w):  # type: ignore[no-untyped-def]
    """Return the share of its facet that a patch of corners w (3, 3) takes, below 0 where it runs the other way
    round."""
    share = w[0, 0] * (w[1, 1] * w[2, 2] - w[1, 2] * w[2, 1])
    share -= w[0, 1] * (w[1, 0] * w[2, 2] - w[1, 2] * w[2, 0])
    return share + w[0, 2] * (w[1, 0] * w[2, 1] - w[1, 1] * w[2, 0])


@njit(cache=True, nogil=True)
def footprints(tubes, middle, half_way, facets, image, far, out):  # type: ignore[no-untyped-def]
    """Write the footprints of tubes.

    Args: tubes: points, k, normals (n, 4, 3), length (n, 4), facet (n,), bary (n, 3, 3),
    or (n, 0, 3) once they left their first facet and all are flat; middle (n, 3, 3) [m] of the
    edges and length there half_way (n, 3) [m]; facets: normal (f, 3),
    vertices and edge curvature (f, 3, 3), curved (f,); image of the end of the leg out, or the direction to it when
    far; out: points (n, 6, 3), lengths (n, 6) through them and through the centre (n,), taper (n, 3): obliquity
    times spreading at corners over the mean one at the centre, which the coupling has, for areas of the flat
    footprints, zero beyond the terminator, scaled to the mean over the footprint; area (n,) and length (n,) [m] of the
    leg out.
    """
    points, k, normals, length, facet, bary = tubes
    facing, vertices, edge_curvature, curved = facets
    six, lengths, whole, taper, area, back_length = out
    bent = bary.shape[1] == 3
    flat, element, at, lit = np.empty(3), np.empty(3), np.empty(3), np.empty(4)
    back_k, back = np.empty((4, 3)), np.empty(4)
    for i in range(len(facet)):
        for j in range(4):
            back[j] = _back(points[i, j], image, far, back_k[j])
        for j in range(3):
            lengths[i, j] = length[i, j] + back[j]
            lengths[i, 3 + j] = half_way[i, j] + _back(middle[i, j], image, far, element)
            for c in range(3):
                six[i, j, c], six[i, 3 + j, c] = points[i, j, c], middle[i, j, c]
        whole[i], back_length[i] = length[i, 3] + back[3], back[3]
        p, q, r = points[i, 0], points[i, 1], points[i, 2]
        size = 0.0
        for c in range(3):
            d, e = (c + 1) % 3, (c + 2) % 3
            flat[c] = 0.5 * ((q[d] - p[d]) * (r[e] - p[e]) - (q[e] - p[e]) * (r[d] - p[d]))
            size += flat[c] * flat[c]
        area[i] = math.sqrt(size)
        least = max(area[i], 1e-300)
        f = facet[i]
        side, share = 0.0, _share(bary[i]) if bent else 0.0
        for c in range(3):
            side += facing[f, c] * normals[i, 3, c]
        centre = max(_mean_cosine(normals[i, 3], k[i, 3], back_k[3]), 0.0)
        if not far:
            centre /= length[i, 3] * back[3]
        for j in range(4):
            if bent and curved[f]:
                _place_of(bary[i], j, at)
                element_of(vertices[f], edge_curvature[f], at, element)
                strength = _harmonic_cosine(element, k[i, j], back_k[j]) * math.copysign(0.5 * share / least, side)
            else:
                # Where the curved surface turns away from the flat footprint it has more area.
                turned = 0.0
                for c in range(3):
                    turned += normals[i, j, c] * flat[c] / least
                strength = _mean_cosine(normals[i, j], k[i, j], back_k[j]) / max(abs(turned), 0.5)
            strength = max(strength, 0.0)
            if not far:
                strength /= length[i, j] * back[j]
            lit[j] = min(strength / centre, 4.0) if centre > 0.0 else 0.0
        by = _to_mean(lit)
        for j in range(3):
            taper[i, j] = by * lit[j]


@njit(cache=True, forceinline=True)
def _place_of(w, j, out):  # type: ignore[no-untyped-def]
    """Write the barycentric place (3,) of corner j of a patch of corners w (3, 3), or with j = 3 of its centre."""
    for c in range(3):
        out[c] = w[j, c] if j < 3 else (w[0, c] + w[1, c] + w[2, c]) / 3.0


@njit(cache=True, forceinline=True)
def _to_mean(lit):  # type: ignore[no-untyped-def]
    """Return by what values (4,) at the corners and the centre of a triangle, of a quadratic, have to be multiplied
    for the mean over the corners to be the quadratic's: 3/4 of the centre's value and 1/12 of each corner's."""
    mean = (lit[0] + lit[1] + lit[2]) / 3.0
    return 0.25 + 0.75 * lit[3] / mean if mean > 0.0 else 1.0


@njit(cache=True, forceinline=True)
def _distance(p, image, far):  # type: ignore[no-untyped-def]
    """Return the distance [m] from p (3,) to an image, 1 when far."""
    return 1.0 if far else math.sqrt((p[0] - image[0]) ** 2 + (p[1] - image[1]) ** 2 + (p[2] - image[2]) ** 2)


@njit(cache=True, nogil=True)
def elements(points, normals, facet, bary, vertices, edge_curvature, curved, image, out_image, far, out):  # type: ignore[no-untyped-def]
    """Write the vector elements of area (n, 4, 3) [m^2] of first tubes at their corners and centres, on the lit side,
    for the area of the tube, weighted by both ends' spreading there over that at the centre.

    Args: points, normals (n, 4, 3), facet (n,), bary (n, 3, 3) of the tubes; vertices, edge curvature (f, 3, 3),
    curved (f,) of facets; images of both ends [m], or directions to them when far.
    """
    one, at = np.empty((2, 3))
    for i in range(len(facet)):
        f, share = facet[i], _share(bary[i])
        centre = _distance(points[i, 3], image, far) * _distance(points[i, 3], out_image, far)
        p, q, r = points[i, 0], points[i, 1], points[i, 2]
        for j in range(4):
            size = 0.5 * centre / (_distance(points[i, j], image, far) * _distance(points[i, j], out_image, far))
            if curved[f]:
                _place_of(bary[i], j, at)
                element_of(vertices[f], edge_curvature[f], at, one)
                size *= share
            else:
                for c in range(3):
                    d, e = (c + 1) % 3, (c + 2) % 3
                    one[c] = (q[d] - p[d]) * (r[e] - p[e]) - (q[e] - p[e]) * (r[d] - p[d])
            side = one[0] * normals[i, 3, 0] + one[1] * normals[i, 3, 1] + one[2] * normals[i, 3, 2]
            if side < 0.0:
                size = -size
            for c in range(3):
                out[i, j, c] = size * one[c]
