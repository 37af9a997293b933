"""The channel gain of each route: the wave followed from the transmitter over mirrors and layers to the scatterer, and
by reciprocity from the receiver to it. Materials, antennas and polarisations enter here only; routes are geometry.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from raychan.channel.ends import RadarEnds, rx_fields
from raychan.channel.fields_along import cosine, curved, heading, incidences, over_mirrors, slot, vec
from raychan.compile.jit import njit
from raychan.em.fresnel import coefficients
from raychan.em.phase_integral import triangle_terms
from raychan.em.phasor import times
from raychan.em.physical_optics import coupled, incident, reflected_wave, shadow_wave
from raychan.em.polarization import onto
from raychan.parallel import parallel_for
from raychan.records import POINT, REFLECT, SCATTER, Facets, Materials, Routes
from raychan.units import C0
from raychan.vectors import dot, row

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
HUYGENS, REFLECTED, SHADOW = 0, 1, 2
"""Which currents radiate: those of the reflected wave, averaged over both directions so that the result is reciprocal;
those of the reflected wave; those of the shadow radiation."""

_LINEAR = 1e-4  # rad: deviation from a linear phase up to which a piece of the footprint is integrated in closed form

_INSIDE = 1e-6  # of the way to the centre: beyond the rounding of cuts, below what a pattern changes by; not measured

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
    first, away, look = _directions(
        routes.tx, routes.rx, routes.far or wave != HUYGENS, routes.vertices, routes.normals, routes.kind, routes.facet,
        routes.scatter, routes.points, facets.normals, *departures(routes),
    )  # fmt: skip
    e_tx = np.ascontiguousarray(tx_field(away), dtype=np.complex128)
    e_rx = np.ascontiguousarray(rx_field(look), dtype=np.complex128)
    m: Materials = facets.materials
    table = m.kind, m.eps, m.thickness, m.roughness
    k = 2.0 * np.pi * frequency / C0
    out = np.zeros((len(routes.kind), e_rx.shape[1], e_tx.shape[1], 3 if corners else 1), np.complex128)
    columns = (
        routes.vertices, routes.normals, routes.kind, routes.facet, routes.scatter, routes.lengths, routes.length,
        routes.taper, routes.area, routes.spread_in, routes.spread_out, routes.caustics, routes.sigma,
        np.zeros((len(out), 0, 3)) if elements is None else elements, out, routes.points,
    )  # fmt: skip

    def some(at: slice) -> None:
        _transfer(
            (routes.tx, routes.rx, routes.far), facets.material, table, k, wave, e_tx, e_rx, away, look,
            first[at.start : at.stop + 1], *(c[at] for c in columns),
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


@njit(cache=True, forceinline=True)
def _outward(tx, rx, far, vertices, i, used):  # type: ignore[no-untyped-def]
    """Return the directions in which the transmitter radiates and to which the receiver looks, route i of so many
    slots."""
    if far:
        return (-tx[0], -tx[1], -tx[2]), (-rx[0], -rx[1], -rx[2])
    if used == 0:
        return heading(vec(tx), vec(rx)), heading(vec(rx), vec(tx))
    return heading(vec(tx), slot(vertices, i, 0)), heading(vec(rx), slot(vertices, i, used - 1))


@njit(cache=True, nogil=True)
def _departures(tx, rx, far, vertices, kind, away, look):  # type: ignore[no-untyped-def]
    n, d = kind.shape
    for i in range(n):
        used = 0
        while used < d and kind[i, used] > 0:
            used += 1
        out, back = _outward(tx, rx, far, vertices, i, used)
        for c in range(3):
            away[i, c], look[i, c] = out[c], back[c]


@njit(cache=True, nogil=True, error_model="numpy")
def _transfer(  # type: ignore[no-untyped-def]
    ends, material, table, k, wave, e_tx, e_rx, away, look, first, vertices, normals, kind, facet, scatter, lengths,
    length, taper, area, spread_in, spread_out, caustics, sigma, elements, out, points,
):  # fmt: skip
    tx, rx, far = ends  # taken out of the tuple once: each access counts a reference
    n, d = kind.shape
    terms, phases = np.empty(3, np.complex128), np.empty(6)
    # The fields of the centre, or of the three corners one after the other.
    arriving = np.empty((3 * e_tx.shape[1], 3), np.complex128)
    leaving = np.empty((3 * e_rx.shape[1], 3), np.complex128)
    cos_in, cos_out, starts = np.empty((3, d)), np.empty((3, d)), np.empty((3, 3))
    for i in range(n):
        used, wavelength_4pi = 0, 0.5 / k
        while used < d and kind[i, used] > 0:
            used += 1
        at = scatter[i] if scatter[i] >= 0 else used
        k_in, k_out = _outward(tx, rx, far, vertices, i, used)
        ways = first[i + 1] - first[i]
        if ways == 3:
            incidences(points, tx, i, 0, at, 1, vertices, normals, kind, cos_in, starts)
            incidences(points, rx, i, used - 1, at, -1, vertices, normals, kind, cos_out, starts)
        # In: from the transmitter over mirrors and layers to the scatterer (or to the receiver).
        _begin(arriving, e_tx, away, k_in, first[i], ways)
        k_in = over_mirrors(
            arriving, ways, k_in, i, 0, at, 1, vertices, normals, kind, facet, material, used, rx, table, k, cos_in
        )  # fmt: skip
        if at == used:
            whole = wavelength_4pi * spread_in[i] * np.exp(-1j * k * length[i])
            _begin(leaving, e_rx, look, k_out, first[i], 1)
            _couple(i, out, whole, leaving, arriving)
            continue
        # Out: the receiver's field by reciprocity, over the rest of the route backwards.
        _begin(leaving, e_rx, look, k_out, first[i], ways)
        k_out = over_mirrors(
            leaving, ways, k_out, i, used - 1, at, -1, vertices, normals, kind, facet, material, used, rx, table, k,
            cos_out,
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
                i, out, terms, ways, arriving, leaving, k_in, k_out, normal, table, m, k, at, cos_in, cos_out
            )  # fmt: skip
        else:
            _scatter_elements(i, out, terms, wave, arriving, leaving, k_in, k_out, normal, table, m, k, elements)


@njit(cache=True, forceinline=True)
def _begin(held, fields, directions, centre, first, ways):  # type: ignore[no-untyped-def]
    """Write the fields (p, 3) that an end has of so many ways, rows from the first on, one after the other; those of
    three ways as turned with their rays into that of the centre."""
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


@njit(cache=True)
def _by_corner(i, used, kind, facet, scatter, normals):  # type: ignore[no-untyped-def]
    """Tell whether each corner of a footprint of route i has fields of its own, of the ray that leads to it: over
    layers and plane mirrors. Fields of the centre alone would jump from tube to tube, and what off the mirror direction
    should cancel where tubes meet would not."""
    plane = scatter[i] >= 0 and kind[i, scatter[i]] == SCATTER
    for j in range(used):
        plane &= kind[i, j] != REFLECT or facet[i, j] < 0 or not curved(normals, facet[i, j])
    return plane


@njit(cache=True, nogil=True)
def _directions(  # type: ignore[no-untyped-def]
    tx, rx, apart, vertices, normals, kind, facet, scatter, points, facet_normals, away, look
):
    """Return the first of the rows of each route, (n + 1,) with the end of the last, and the rows (m, 3): unit
    directions in which the transmitter radiates and to which the receiver looks, one for a route, away and look (n, 3),
    or unless all are `apart` one for each corner of its footprint."""
    n, d = kind.shape
    first, slots = np.zeros(n + 1, np.int64), np.empty(n, np.int64)
    for i in range(n):
        used = 0
        while used < d and kind[i, used] > 0:
            used += 1
        slots[i] = used
        corners = not apart and _by_corner(i, used, kind, facet, scatter, facet_normals)
        first[i + 1] = first[i] + (3 if corners else 1)
    out, back, cosines = np.empty((first[n], 3)), np.empty((first[n], 3)), np.empty((3, d))
    for i in range(n):
        begin, end, at = first[i], first[i + 1], scatter[i]
        if end == begin + 1:
            out[begin], back[begin] = away[i], look[i]
            continue
        incidences(points, tx, i, 0, at, 1, vertices, normals, kind, cosines, out[begin:end])
        incidences(points, rx, i, slots[i] - 1, at, -1, vertices, normals, kind, cosines, back[begin:end])
        # Footprints are cut where an antenna's gain ends: corners there lie on the centre's side of that line.
        out[begin:end] += _INSIDE * (away[i] - out[begin:end])
        back[begin:end] += _INSIDE * (look[i] - back[begin:end])
    return first, out, back


@njit(cache=True, forceinline=True)
def _couple(i, out, whole, receiving, arriving):  # type: ignore[no-untyped-def]
    """Write gains (n, q, p, ...) of route i without a footprint: fields arriving (p, 3) onto receiving (q, 3)."""
    for p in range(out.shape[2]):
        for q in range(out.shape[1]):
            out[i, q, p, 0] = whole * dot(row(receiving, q), row(arriving, p))


@njit(cache=True, forceinline=True)
def _scatter(  # type: ignore[no-untyped-def]
    i, out, terms, ways, arriving, leaving, k_in, k_out, normal, table, m, k, at, cos_in, cos_out
):
    """Add to gains (n, q, p, 1 or 3) what the footprint of route i in slot `at`, of material m, scatters: its three
    terms (3,), each with the currents that the wave has there.

    These are those of the centre, or of three ways each corner's own, at its cosines of incidence (3, d), of its own
    part of the fields arriving and leaving; directions are always those of the centre.
    """
    kinds, eps, thickness, roughness = table
    apart, corners = out.shape[3] == 3, ways == 3
    ins, outs = out.shape[2], out.shape[1]
    wave_in, wave_out = incident(k_in, normal), incident(k_out, normal)
    for c in range(ways):
        there = cos_in[c, at] if corners else cosine(k_in, normal)
        back = cos_out[c, at] if corners else cosine(k_out, normal)
        ci = co = coefficients(kinds[m], eps[m], thickness[m], roughness[m], there, k)
        if back != there:
            co = coefficients(kinds[m], eps[m], thickness[m], roughness[m], back, k)
        for p in range(ins):
            for q in range(outs):
                e, g = row(arriving, c * ins + p), row(leaving, c * outs + q)
                couple = coupled(e, k_in, wave_in, g, k_out, wave_out, normal, (ci[0], ci[1]), (co[0], co[1]))
                for c3 in range(c if corners else 0, c + 1 if corners else 3):
                    out[i, q, p, c3 if apart else 0] += couple * terms[c3]


@njit(cache=True)
def _scatter_elements(  # type: ignore[no-untyped-def]
    i, out, terms, wave, arriving, leaving, k_in, k_out, normal, table, m, k, elements
):
    """Add to gains (n, q, p, 1 or 3) what one of the two waves of physical optics scatters, its three phase-integral
    terms weighted by the currents on the vector elements of area at the corners.

    Source: physical optics, Knott, Shaeffer, Tuley, Radar Cross Section, 2004, ch. 5; Ufimtsev 2014, ch. 1 (the two
    waves of which its currents are the sum).
    """
    kinds, eps, thickness, roughness = table
    fresnel = coefficients(kinds[m], eps[m], thickness[m], roughness[m], cosine(k_in, normal), k)
    apart, to = out.shape[3] == 3, (-k_out[0], -k_out[1], -k_out[2])
    for p in range(out.shape[2]):
        for q in range(out.shape[1]):
            e, g = row(arriving, p), row(leaving, q)
            for c3 in range(3):
                element = slot(elements, i, c3)
                if wave == REFLECTED:
                    couple = reflected_wave(e, k_in, to, element, fresnel[0], fresnel[1], g)
                else:
                    couple = shadow_wave(e, k_in, to, element, fresnel[2], fresnel[3], g)
                out[i, q, p, c3 if apart else 0] += couple * terms[c3]
