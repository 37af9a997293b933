"""The channel gain of each route: the wave followed from the transmitter over mirrors and layers to the scatterer, and
by reciprocity from the receiver to it. Materials, antennas and polarisations enter here only; routes are geometry.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from raychan.channel.corner_rays import corner_rays, outward, used_of
from raychan.channel.ends import RadarEnds, rx_fields
from raychan.channel.fields_along import cosine, over_mirrors, slot
from raychan.compile.jit import njit
from raychan.em.fresnel import coefficients
from raychan.em.phase_integral import triangle_terms
from raychan.em.phasor import times
from raychan.em.physical_optics import coupled, incident, reflected_wave, shadow_wave
from raychan.em.polarization import onto
from raychan.parallel import parallel_for
from raychan.records import POINT, Facets, Materials, Routes
from raychan.units import C0
from raychan.vectors import dot, row

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
HUYGENS, REFLECTED, SHADOW = 0, 1, 2
"""Which currents radiate: those of the reflected wave, averaged over both directions so that the result is reciprocal;
those of the reflected wave; those of the shadow radiation."""

_LINEAR = 1e-4  # rad: deviation from a linear phase up to which a piece of the footprint is integrated in closed form

FieldOf = Callable[[Floats], Complexes]
"""Function from directions (n, 3) to an antenna's vector fields (n, p, 3), one for each of p polarisations."""


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
    (n, 4, 3) [m^2] are the vector area elements at corners and centre, in place of taper and area.
    """
    rays = corner_rays(routes, facets, 1 if routes.far else 3 if wave == HUYGENS else 4)
    e_tx = np.ascontiguousarray(tx_field(rays.away), dtype=np.complex128)
    e_rx = np.ascontiguousarray(rx_field(rays.look), dtype=np.complex128)
    m: Materials = facets.materials
    table = m.kind, m.eps, m.thickness, m.roughness
    k = 2.0 * np.pi * frequency / C0
    out = np.zeros((len(routes.kind), e_rx.shape[1], e_tx.shape[1], 3 if corners else 1), np.complex128)
    columns = (
        routes.vertices, routes.normals, routes.kind, routes.facet, routes.scatter, routes.lengths, routes.length,
        routes.taper, routes.area, routes.spread_in, routes.spread_out, routes.caustics, routes.sigma,
        np.zeros((len(out), 0, 3)) if elements is None else elements, out,
    )  # fmt: skip

    def some(at: slice) -> None:
        _transfer(
            (routes.tx, routes.rx, routes.far), facets.material, table, k, wave, e_tx, e_rx,
            rays._replace(first=rays.first[at.start : at.stop + 1]), *(c[at] for c in columns),
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


@njit(cache=True, nogil=True, error_model="numpy")
def _transfer(  # type: ignore[no-untyped-def]
    ends, material, table, k, wave, e_tx, e_rx, rays, vertices, normals, kind, facet, scatter, lengths, length, taper,
    area, spread_in, spread_out, caustics, sigma, elements, out,
):  # fmt: skip
    # The fields of the centre, or of the three corners and then the centre one after the other.
    arriving = np.empty((4 * e_tx.shape[1], 3), np.complex128)
    leaving = np.empty((4 * e_rx.shape[1], 3), np.complex128)
    _each_route(
        ends, material, table, k, wave, e_tx, e_rx, rays, vertices, normals, kind, facet, scatter, lengths, length,
        taper, area, spread_in, spread_out, caustics, sigma, elements, out, np.empty(3, np.complex128), np.empty(6),
        arriving, leaving,
    )  # fmt: skip


@njit(cache=True, error_model="numpy", uncounted=True)
def _each_route(  # type: ignore[no-untyped-def]
    ends, material, table, k, wave, e_tx, e_rx, rays, vertices, normals, kind, facet, scatter, lengths, length, taper,
    area, spread_in, spread_out, caustics, sigma, elements, out, terms, phases, arriving, leaving,
):  # fmt: skip
    """Do what `_transfer` does, with room for terms (3,), phases (6,) and fields (4 p, 3) and (4 q, 3)."""
    (tx, rx, far), (first, away, look, cos_in, cos_out) = ends, rays
    for i in range(len(kind)):
        used, wavelength_4pi = used_of(kind, i), 0.5 / k
        at = scatter[i] if scatter[i] >= 0 else used
        k_in, k_out = outward(tx, rx, far, vertices, i, used)
        begun, ways = first[i], first[i + 1] - first[i]
        # In: from the transmitter over mirrors and layers to the scatterer (or to the receiver).
        _begin(arriving, e_tx, away, k_in, begun, ways)
        k_in = over_mirrors(
            arriving, ways, k_in, i, 0, at, 1, vertices, normals, kind, facet, material, used, rx, table, k, cos_in,
            begun,
        )  # fmt: skip
        if at == used:
            whole = wavelength_4pi * spread_in[i] * np.exp(-1j * k * length[i])
            _begin(leaving, e_rx, look, k_out, begun, 1)
            _couple(i, out, whole, leaving, arriving)
            continue
        # Out: the receiver's field by reciprocity, over the rest of the route backwards.
        _begin(leaving, e_rx, look, k_out, begun, ways)
        k_out = over_mirrors(
            leaving, ways, k_out, i, used - 1, at, -1, vertices, normals, kind, facet, material, used, rx, table, k,
            cos_out, begun,
        )  # fmt: skip
        if kind[i, at] == POINT:
            whole = wavelength_4pi * spread_in[i] * np.exp(-1j * k * length[i])
            whole *= (sigma[i] / (4.0 * np.pi)) ** 0.5 * spread_out[i]
            _couple(i, out, whole, leaving, arriving)
            continue
        scale = wavelength_4pi * (-0.25j * k / np.pi) * spread_in[i] * spread_out[i]
        for _ in range(caustics[i]):
            scale *= 1j
        for c6 in range(6):
            phases[c6] = k * lengths[i, c6]
        triangle_terms(phases, _LINEAR, terms)
        normal, m = slot(normals, i, at), material[facet[i, at]]
        for c3 in range(3):
            terms[c3] *= times(area[i] * taper[i, c3] if wave == HUYGENS else 1.0, scale)
        if wave == HUYGENS:
            _scatter(
                i, out, terms, ways, arriving, leaving, k_in, k_out, normal, table, m, k, at, cos_in, cos_out, begun
            )  # fmt: skip
        else:
            _scatter_elements(
                i, out, terms, ways, wave, arriving, leaving, k_in, k_out, normal, table, m, k, elements, away, look,
                begun,
            )  # fmt: skip


@njit(cache=True, forceinline=True, uncounted=True)
def _begin(held, fields, directions, centre, first, ways):  # type: ignore[no-untyped-def]
    """Write the fields (p, 3) that an end has of so many ways, rows from the first on, one after the other; those of
    three ways as turned with their rays into that of the centre. Four keep their own."""
    count = fields.shape[1]
    for w in range(ways):
        k = row(directions, first + w)
        both = k[0] + centre[0], k[1] + centre[1], k[2] + centre[2]
        size = 1.0 + dot(k, centre)
        for f in range(count):
            e = slot(fields, first + w, f)
            along = onto(e, centre) / size if ways == 3 else 0j
            for c in range(3):
                held[w * count + f, c] = e[c] - along * both[c]


@njit(cache=True, forceinline=True, uncounted=True)
def _couple(i, out, whole, receiving, arriving):  # type: ignore[no-untyped-def]
    """Write gains (n, q, p, ...) of route i without a footprint: fields arriving (p, 3) onto receiving (q, 3)."""
    for p in range(out.shape[2]):
        for q in range(out.shape[1]):
            out[i, q, p, 0] = whole * dot(row(receiving, q), row(arriving, p))


@njit(cache=True, forceinline=True, uncounted=True)
def _scatter(  # type: ignore[no-untyped-def]
    i, out, terms, ways, arriving, leaving, k_in, k_out, normal, table, m, k, at, cos_in, cos_out, begun
):
    """Add to gains (n, q, p, 1 or 3) what the footprint of route i in slot `at`, of material m, scatters: its three
    terms (3,), each with the currents that the wave has there.

    These are those of the centre, or of three ways each corner's own, at its cosines of incidence (n, d), rows from
    `begun` on, of its own part of the fields arriving and leaving; directions are always those of the centre.
    """
    kinds, eps, thickness, roughness = table
    apart, corners = out.shape[3] == 3, ways == 3
    ins, outs = out.shape[2], out.shape[1]
    wave_in, wave_out = incident(k_in, normal), incident(k_out, normal)
    for c in range(ways):
        there = cos_in[begun + c, at] if corners else cosine(k_in, normal)
        back = cos_out[begun + c, at] if corners else cosine(k_out, normal)
        ci = co = coefficients(kinds[m], eps[m], thickness[m], roughness[m], there, k)
        if back != there:
            co = coefficients(kinds[m], eps[m], thickness[m], roughness[m], back, k)
        for p in range(ins):
            for q in range(outs):
                e, g = row(arriving, c * ins + p), row(leaving, c * outs + q)
                couple = coupled(e, k_in, wave_in, g, k_out, wave_out, normal, (ci[0], ci[1]), (co[0], co[1]))
                for c3 in range(c if corners else 0, c + 1 if corners else 3):
                    out[i, q, p, c3 if apart else 0] += couple * terms[c3]


@njit(cache=True, uncounted=True)
def _scatter_elements(  # type: ignore[no-untyped-def]
    i, out, terms, ways, wave, arriving, leaving, k_in, k_out, normal, table, m, k, elements, away, look, begun
):
    """Add to gains (n, q, p, 1 or 3) what one of the two waves of physical optics scatters, its three phase-integral
    terms weighted by the currents on the vector elements of area at the corners.

    Of four ways each corner, and the centre, has its own fields and directions, rows from `begun` on. Currents vary
    over the footprint as a quadratic: its mean is 3/4 of the centre's value and 1/12 of each corner's.
    Source: physical optics, Knott, Shaeffer, Tuley, Radar Cross Section, 2004, ch. 5; Ufimtsev 2014, ch. 1 (the two
    waves of which its currents are the sum).
    """
    apart, ins, outs = out.shape[3] == 3, out.shape[2], out.shape[1]
    for p in range(ins):
        for q in range(outs):
            bend = 0j
            for c in range(4):
                w = c if ways == 4 else 0
                to_here, back = (row(away, begun + c), row(look, begun + c)) if ways == 4 else (k_in, k_out)
                e, g, element = row(arriving, w * ins + p), row(leaving, w * outs + q), slot(elements, i, c)
                couple = _currents(e, to_here, g, back, wave, element, normal, table, m, k)
                bend += 0.75 * couple if c == 3 else -0.25 * couple
                if c < 3:
                    out[i, q, p, c if apart else 0] += couple * terms[c]
            for c in range(3):
                out[i, q, p, c if apart else 0] += bend * terms[c]


@njit(cache=True, forceinline=True, uncounted=True)
def _currents(e, k_in, g, k_out, wave, element, normal, table, m, k):  # type: ignore[no-untyped-def]
    """Return what the currents of one of the two waves of e on an element of material m radiate, projected on g."""
    kinds, eps, thickness, roughness = table
    fresnel = coefficients(kinds[m], eps[m], thickness[m], roughness[m], cosine(k_in, normal), k)
    to = -k_out[0], -k_out[1], -k_out[2]
    if wave == REFLECTED:
        return reflected_wave(e, k_in, to, element, fresnel[0], fresnel[1], g)
    return shadow_wave(e, k_in, to, element, fresnel[2], fresnel[3], g)
