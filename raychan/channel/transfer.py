"""The channel gain of each route: the wave followed from the transmitter over mirrors and layers to the scatterer, and
by reciprocity from the receiver to it. Materials, antennas and polarisations enter here only; routes are geometry.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from raychan.channel.ends import RadarEnds, rx_fields
from raychan.channel.fields_along import coefficients_at, cosine, heading, incidence, over_mirrors, vec
from raychan.compile.jit import njit
from raychan.em.phase_integral import triangle_terms
from raychan.em.physical_optics import huygens, reflected_wave, shadow_wave
from raychan.parallel import parallel_for
from raychan.records import LAYER, POINT, REFLECT, Facets, Materials, Routes
from raychan.units import C0
from raychan.vectors import copy_to, dot

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
HUYGENS, REFLECTED, SHADOW = 0, 1, 2
"""Which currents radiate: those of the reflected wave, averaged over both directions so that the result is reciprocal;
those of the reflected wave; those of the shadow radiation."""

_LINEAR = 1e-4  # rad: deviation from a linear phase up to which a piece of the footprint is integrated in closed form

FieldOf = Callable[[Floats], Complexes]
"""Function from directions (n, 3) to an antenna's vector fields (n, p, 3), one for each of p polarisations."""


def departures(routes: Routes) -> tuple[Floats, Floats]:
    """Return the unit directions (n, 3) in which the transmitter radiates and to which the receiver looks."""
    away, look = np.empty((2, len(routes.kind), 3))
    _departures(routes.tx, routes.rx, routes.far, routes.vertices, routes.kind, away, look)
    return away, look


def transfer(
    routes: Routes,
    facets: Facets,
    frequency: float,
    tx_field: FieldOf,
    rx_field: FieldOf,
    corners: bool = False,
    wave: int = HUYGENS,
    elements: Floats | None = None,
) -> Complexes:
    """Return the gain (n, q, p) of each route: received over transmitted wave, with lambda / 4 pi and carrier phase.

    Args: tx_field, rx_field vector fields of p and q polarisations; corners: return (n, q, p, 3), the parts that belong
    to the three footprint corners and sum to the gain; wave which currents radiate; unless it is HUYGENS, elements
    (n, 3, 3) [m^2] are the vector area elements at the corners, in place of taper and area.
    """
    away, look = departures(routes)
    e_tx = np.ascontiguousarray(tx_field(away), dtype=np.complex128)
    e_rx = np.ascontiguousarray(rx_field(look), dtype=np.complex128)
    m: Materials = facets.materials
    table = m.kind, m.eps, m.thickness, m.roughness
    material = facets.material[np.maximum(routes.facet, 0)].astype(np.int64) if len(facets.material) else routes.facet
    k = 2.0 * np.pi * frequency / C0
    out = np.zeros((len(routes.kind), e_rx.shape[1], e_tx.shape[1], 3 if corners else 1), np.complex128)
    columns = (
        routes.vertices, routes.normals, routes.kind, material, routes.scatter, routes.lengths, routes.length,
        routes.taper, routes.area, routes.spread_in, routes.spread_out, routes.caustics, routes.sigma, e_tx, e_rx,
        np.zeros((len(out), 0, 3)) if elements is None else elements, out, routes.points,
        _by_corner(routes, facets, wave),
    )  # fmt: skip

    def some(at: slice) -> None:
        _transfer(
            (routes.tx, routes.rx, routes.far), table, k, wave, *(c[at] for c in columns),
        )  # fmt: skip

    parallel_for(len(out), some)
    if facets.attenuation:
        out *= np.exp(-facets.attenuation * routes.length)[:, None, None, None]
    return out if corners else out[..., 0]


def corner_gains(routes: Routes, facets: Facets, radar: RadarEnds, frequency: float) -> Complexes:
    """Return the gains (n, q, 3) of routes for a radar's q receivers, the parts that belong to the three corners."""
    return transfer(
        routes,
        facets,
        frequency,
        lambda d: np.asarray(radar.tx_field(d))[:, None],
        lambda d: np.stack([np.asarray(f(d)) for f in rx_fields(radar)], axis=1),
        corners=True,
    )[:, :, 0]


@njit(cache=True, nogil=True)
def _departures(tx, rx, far, vertices, kind, away, look):  # type: ignore[no-untyped-def]
    n, d = kind.shape
    for i in range(n):
        used = 0
        while used < d and kind[i, used] > 0:
            used += 1
        if far:
            out, back = (-tx[0], -tx[1], -tx[2]), (-rx[0], -rx[1], -rx[2])
        elif used > 0:
            out, back = heading(tx, vertices[i, 0]), heading(rx, vertices[i, used - 1])
        else:
            out, back = heading(tx, rx), heading(rx, tx)
        for c in range(3):
            away[i, c], look[i, c] = out[c], back[c]


@njit(cache=True, nogil=True)
def _transfer(  # type: ignore[no-untyped-def]
    ends, table, k, wave, vertices, normals, kind, material, scatter, lengths, length, taper, area, spread_in,
    spread_out, caustics, sigma, e_tx, e_rx, elements, out, points, by_corner,
):  # fmt: skip
    tx, rx, far = ends
    n, d = kind.shape
    ins, outs = e_tx.shape[1], e_rx.shape[1]
    terms, phases = np.empty(3, np.complex128), np.empty(6)
    arriving, leaving = np.empty((ins, 3), np.complex128), np.empty((outs, 3), np.complex128)
    wavelength_4pi, own = 0.5 / k, np.empty(0)
    for i in range(n):
        used = 0
        while used < d and kind[i, used] > 0:
            used += 1
        at = scatter[i] if scatter[i] >= 0 else used
        # In: from the transmitter over mirrors and layers to the scatterer (or to the receiver).
        k_in = (-tx[0], -tx[1], -tx[2])
        if not far:
            k_in = heading(tx, vertices[i, 0]) if used > 0 else heading(tx, rx)
        for p in range(ins):
            copy_to(arriving[p], e_tx[i, p])
        k_in = over_mirrors(
            arriving, k_in, i, 0, at, 1, vertices, normals, kind, material, used, rx, table, k, own
        )  # fmt: skip
        if at == used:
            whole = wavelength_4pi * spread_in[i] * np.exp(-1j * k * length[i])
            _couple(i, out, whole, e_rx[i], arriving)
            continue
        # Out: the receiver's field by reciprocity, over the rest of the route backwards.
        k_out = (-rx[0], -rx[1], -rx[2]) if far else heading(rx, vertices[i, used - 1])
        for q in range(outs):
            copy_to(leaving[q], e_rx[i, q])
        k_out = over_mirrors(
            leaving, k_out, i, used - 1, at, -1, vertices, normals, kind, material, used, rx, table, k, own
        )  # fmt: skip
        if kind[i, at] == POINT:
            whole = wavelength_4pi * spread_in[i] * np.exp(-1j * k * length[i])
            whole *= (sigma[i] / (4.0 * np.pi)) ** 0.5 * spread_out[i]
            _couple(i, out, whole, leaving, arriving)
            continue
        normal = vec(normals[i, at])
        ci = coefficients_at(table, material[i, at], cosine(k_in, normal), k)
        co = coefficients_at(table, material[i, at], cosine(k_out, normal), k)
        scale = wavelength_4pi * (-0.25j * k / np.pi) * spread_in[i] * spread_out[i]
        for _ in range(caustics[i]):
            scale *= 1j
        for c6 in range(6):
            phases[c6] = k * lengths[i, c6]
        triangle_terms(phases, _LINEAR, terms)
        if by_corner[i]:
            route, fields = (vertices, normals, kind, material), (e_tx, e_rx, arriving, leaving)
            for c3 in range(3):
                terms[c3] *= scale * area[i] * taper[i, c3]
            _scatter_by_corner(i, out, terms, route, points[i], (tx, rx), (at, used), fields, (k_in, k_out), table, k)
            continue
        _scatter(
            i, out, scale, terms, wave, arriving, leaving, (k_in, k_out), normal, (ci, co), area[i], taper, elements,
        )  # fmt: skip


def _by_corner(routes: Routes, facets: Facets, wave: int) -> NDArray[np.bool_]:
    """Return of which routes (n,) each corner of the footprint has Fresnel coefficients of its own, for the ray that
    leads to it: of those over layers and plane mirrors. In a layer waves interfere, and it turns quickly with angle."""
    n, layer = len(routes.kind), facets.materials.kind == LAYER
    if wave != HUYGENS or routes.far or not layer.any():
        return np.zeros(n, bool)
    at = np.maximum(routes.facet, 0)
    over = ((routes.kind > 0) & layer[facets.material[at]]).any(axis=1)
    rows = np.flatnonzero(over)
    normals = facets.normals[at[rows]]
    curved = (normals != normals[:, :, :1]).any(axis=(2, 3))
    over[rows] = ~((routes.kind[rows] == REFLECT) & curved).any(axis=1)
    return np.asarray(over)


@njit(cache=True, nogil=True)
def _scatter_by_corner(i, out, terms, route, points, ends, slots, fields, arrives, table, k):  # type: ignore[no-untyped-def]
    """Add to gains (n, q, p, 1 or 3) of route i what its footprint scatters, each of its three terms with the currents
    that the wave has by the Fresnel coefficients of the ray to its corner; directions are those of the centre."""
    (vertices, normals, kind, material), (tx, rx), (at, used) = route, ends, slots
    (e_tx, e_rx, arriving, leaving), (k_in, k_out) = fields, arrives
    cosines, normal = np.empty(kind.shape[1]), vec(normals[i, at])
    for c3 in range(3):
        here = vec(points[c3])
        c_in = cosine(incidence(here, tx, i, 0, at, 1, vertices, normals, kind, cosines), normal)
        c_out = cosine(incidence(here, rx, i, used - 1, at, -1, vertices, normals, kind, cosines), normal)
        for p in range(len(arriving)):
            copy_to(arriving[p], e_tx[i, p])
        for q in range(len(leaving)):
            copy_to(leaving[q], e_rx[i, q])
        over_mirrors(
            arriving, heading(tx, vertices[i, 0]), i, 0, at, 1, vertices, normals, kind, material, used, rx, table, k,
            cosines,
        )  # fmt: skip
        over_mirrors(
            leaving, heading(rx, vertices[i, used - 1]), i, used - 1, at, -1, vertices, normals, kind, material, used,
            rx, table, k, cosines,
        )  # fmt: skip
        ci, co = coefficients_at(table, material[i, at], c_in, k), coefficients_at(table, material[i, at], c_out, k)
        for p in range(len(arriving)):
            for q in range(len(leaving)):
                e, g = vec(arriving[p]), vec(leaving[q])
                couple = huygens(e, k_in, g, k_out, normal, (ci[0], ci[1]), (co[0], co[1]))
                out[i, q, p, c3 if out.shape[3] == 3 else 0] += couple * terms[c3]


@njit(cache=True, forceinline=True)
def _couple(i, out, whole, receiving, arriving):  # type: ignore[no-untyped-def]
    """Write gains (n, q, p, ...) of route i without a footprint: fields arriving (p, 3) onto receiving (q, 3)."""
    for p in range(len(arriving)):
        for q in range(len(receiving)):
            out[i, q, p, 0] = whole * dot(vec(receiving[q]), vec(arriving[p]))


@njit(cache=True, forceinline=True)
def _scatter(  # type: ignore[no-untyped-def]
    i, out, scale, terms, wave, arriving, leaving, directions, normal, fresnel, area, taper, elements
):
    """Add to gains (n, q, p, 1 or 3) what the footprint of route i scatters, its three phase-integral terms weighted by
    the currents.

    Source: physical optics, Knott, Shaeffer, Tuley, Radar Cross Section, 2004, ch. 5; Ufimtsev 2014, ch. 1 (the two
    waves of which its currents are the sum).
    """
    (k_in, k_out), (ci, co) = directions, fresnel
    apart = out.shape[3] == 3
    to, mean = (-k_out[0], -k_out[1], -k_out[2]), 0j
    for p in range(len(arriving)):
        for q in range(len(leaving)):
            e, g = vec(arriving[p]), vec(leaving[q])
            if wave == HUYGENS:
                mean = area * huygens(e, k_in, g, k_out, normal, (ci[0], ci[1]), (co[0], co[1]))
            for c3 in range(3):
                if wave == HUYGENS:
                    couple = mean * taper[i, c3]
                elif wave == REFLECTED:
                    couple = reflected_wave(e, k_in, to, vec(elements[i, c3]), ci[0], ci[1], g)
                else:
                    couple = shadow_wave(e, k_in, to, vec(elements[i, c3]), ci[2], ci[3], g)
                out[i, q, p, c3 if apart else 0] += scale * couple * terms[c3]


def rates(routes: Routes, facets: Facets, tx_velocity: Floats, rx_velocity: Floats) -> Floats:
    """Return range rates (n,) [m/s]: half the rate of each route's length, from the velocities of its vertices.

    A mirror that slides in its own plane has no effect: the length is stationary there (Fermat's principle).
    """
    return _rates(
        routes.tx, routes.rx, routes.vertices, routes.kind, routes.body, facets.velocity, facets.spin,
        facets.origin, np.asarray(tx_velocity, float), np.asarray(rx_velocity, float),
    )  # fmt: skip


@njit(cache=True, nogil=True)
def _rates(  # type: ignore[no-untyped-def]
    tx, rx, vertices, kind, body, velocity, spin, origin, tx_velocity, rx_velocity
):
    n, d = kind.shape
    out = np.empty(n)
    x, v, y, w = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for i in range(n):
        copy_to(x, tx)
        copy_to(v, tx_velocity)
        total = 0.0
        for j in range(d + 1):
            last = j == d or kind[i, j] == 0
            if last:
                copy_to(y, rx)
                copy_to(w, rx_velocity)
            else:
                copy_to(y, vertices[i, j])
                b = max(body[i, j], 0)
                s, o = spin[b], origin[b]
                w[0] = velocity[b, 0] + s[1] * (y[2] - o[2]) - s[2] * (y[1] - o[1])
                w[1] = velocity[b, 1] + s[2] * (y[0] - o[0]) - s[0] * (y[2] - o[2])
                w[2] = velocity[b, 2] + s[0] * (y[1] - o[1]) - s[1] * (y[0] - o[0])
            k = heading(x, y)
            total += (w[0] - v[0]) * k[0] + (w[1] - v[1]) * k[1] + (w[2] - v[2]) * k[2]
            if last:
                break
            copy_to(x, y)
            copy_to(v, w)
        out[i] = 0.5 * total
    return out
