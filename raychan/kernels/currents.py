"""Currents: what the two parts of physical optics radiate, the reflected wave's and the shadow's (numba scalars)."""

from __future__ import annotations

import math

import numpy as np

from raychan.kernels.footprint import element_of
from raychan.kernels.jit import njit
from raychan.kernels.po import radiated
from raychan.kernels.polar import Vec, cross, dot, transmit


@njit(cache=True)
def reflected_wave(e: Vec, k: Vec, to: Vec, element: Vec, r_s: complex, r_p: complex, g: Vec) -> complex:
    """Project on g what the currents n x H, -n x E of the reflected wave of (e, k) on a vector element of area (on the
    lit side) radiate in the direction `to`; multiply as for `huygens`. Source: as there."""
    size = math.sqrt(dot(element, element))
    if size == 0.0:
        return 0j
    n = (element[0] / size, element[1] / size, element[2] / size)
    return size * radiated(e, k, to, n, r_s, r_p, g)


@njit(cache=True)
def shadow_wave(e: Vec, k: Vec, to: Vec, element: Vec, t_s: complex, t_p: complex, g: Vec) -> complex:
    """Project on g what the currents n x H, -n x E of the wave (e, k) itself on a vector element of area (on the lit
    side) radiate in the direction `to`, less what goes on behind it (T_s, T_p): the shadow radiation, nothing in
    backscatter. With `reflected_wave` it is physical optics, 2 n x H on a conductor (Ufimtsev 2014, ch. 1)."""
    size = math.sqrt(dot(element, element))
    if size == 0.0:
        return 0j
    n = (element[0] / size, element[1] / size, element[2] / size)
    behind = transmit(e, k, n, t_s, t_p)
    lost = (e[0] - behind[0], e[1] - behind[1], e[2] - behind[2])
    magnetic = cross(to, cross(element, lost))
    electric = cross(element, cross(k, lost))
    return dot(g, magnetic) + dot(g, electric)


@njit(cache=True, forceinline=True)
def _toward(p, image, far):  # type: ignore[no-untyped-def]
    return 1.0 if far else math.sqrt((p[0] - image[0]) ** 2 + (p[1] - image[1]) ** 2 + (p[2] - image[2]) ** 2)


@njit(cache=True, nogil=True)
def elements(points, normals, facet, bary, vertices, bulge, curved, image, out_image, far, out):  # type: ignore[no-untyped-def]
    """Write the vector elements of area (n, 3, 3) [m^2] of first tubes at their corners, on the lit side: the mean of
    the three is the tube's, weighed by both ends' spreading there over that at the centre.

    Args: points, normals (n, 4, 3), facet (n,), bary (n, 3, 3) of the tubes; vertices, bulge (f, 3, 3), curved (f,) of
    facets; images of both ends [m], or directions to them when far.
    """
    one = np.empty(3)
    for i in range(len(facet)):
        f, w = facet[i], bary[i]
        share = w[0, 0] * (w[1, 1] * w[2, 2] - w[1, 2] * w[2, 1])
        share -= w[0, 1] * (w[1, 0] * w[2, 2] - w[1, 2] * w[2, 0])
        share += w[0, 2] * (w[1, 0] * w[2, 1] - w[1, 1] * w[2, 0])
        centre = _toward(points[i, 3], image, far) * _toward(points[i, 3], out_image, far)
        p, q, r = points[i, 0], points[i, 1], points[i, 2]
        for j in range(3):
            size = 0.5 * centre / (_toward(points[i, j], image, far) * _toward(points[i, j], out_image, far))
            if curved[f]:
                element_of(vertices[f], bulge[f], w[j], one)
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
