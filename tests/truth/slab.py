"""Half spaces and stacks of layers by characteristic matrices of the tangential fields (Born & Wolf 1999, sec. 1.6).

R_s = E_r/E_i for E perpendicular to the plane of incidence; R_p = H_r/H_i for H perpendicular to it, so that a perfect
conductor has R_s = -1, R_p = +1. eps = eps' - j eps''.
"""

from __future__ import annotations

import numpy as np


def _admittance(cos_i, eps):
    """Return the normal wave number over k, and tangential admittances (s, p) of a medium over that of vacuum."""
    normal = np.sqrt(np.asarray(eps, complex) - (1.0 - np.asarray(cos_i) ** 2))
    normal = np.where(normal.imag > 0, -normal, normal)
    return normal, normal, eps / normal


def stack(cos_i, layers, k, behind=1.0):
    """(R_s, R_p, T_s, T_p) of layers [(eps, thickness m), ...] in front of a half space `behind`.

    T is the tangential E just behind the stack over the incident tangential E at its face.
    """
    cos_i = np.asarray(cos_i, float)
    answer = []
    _, *front = _admittance(cos_i, 1.0)
    _, *back = _admittance(cos_i, behind)
    for pol in (0, 1):
        e, h = np.ones_like(cos_i, complex), back[pol] + 0j
        for eps, thickness in reversed(list(layers)):
            normal, *inside = _admittance(cos_i, eps)
            delta, y = k * thickness * normal, inside[pol]
            e, h = np.cos(delta) * e + 1j * np.sin(delta) / y * h, 1j * y * np.sin(delta) * e + np.cos(delta) * h
        y0 = front[pol]
        electric = (y0 * e - h) / (y0 * e + h)
        answer.append((electric if pol == 0 else -electric, 2 * y0 / (y0 * e + h)))
    return answer[0][0], answer[1][0], answer[0][1], answer[1][1]


def half_space(cos_i, eps):
    """(R_s, R_p) of a half space."""
    return stack(cos_i, [], 1.0, eps)[:2]


def layer(cos_i, eps, thickness, k):
    """(R_s, R_p, T_s, T_p) of one slab in air; T over the wave that the same thickness of air would pass."""
    r_s, r_p, t_s, t_p = stack(cos_i, [(eps, thickness)], k)
    air = np.exp(1j * k * thickness * np.asarray(cos_i))
    return r_s, r_p, t_s * air, t_p * air


def pec(cos_i):
    """(R_s, R_p) of a perfect conductor."""
    one = np.ones_like(np.asarray(cos_i, float))
    return -one, one
