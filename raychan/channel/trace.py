"""Trace: from bounce to bounce; tubes that would straddle two surfaces are cut while they matter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.channel.between import between
from raychan.channel.edges import edge_within, meeting_lines
from raychan.channel.found import Found
from raychan.channel.launch import divide, on_facets, write_layers
from raychan.channel.legs import Leg
from raychan.channel.surface import Surface
from raychan.channel.tubes import (
    CENTRE,
    Refinement,
    Tubes,
    phases_of,
    vector_area,
)
from raychan.kernels.landing import landing_span
from raychan.tables import REFLECT

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]

_ALIKE = 0.98  # cosine within which normals of one smooth patch may differ over a tube


def bounce(surface: Surface, leg: Leg, out: Leg, tubes: Tubes, first: bool, last: bool, found: Found) -> Tubes:
    """Return the tubes after one more reflection, standing where they land.

    Args: out the way back used to weigh tubes; first, last whether `tubes` stand on their first surface, or land on
    their last; found what was so far.
    """
    rule = found.rule
    landed: list[Tubes] = []
    tubes = tubes.take(tubes.slots < rule.slots - 2)
    n = len(tubes)
    flight = _Flight(tubes, np.zeros((n, 4)), np.full((n, rule.layers), -1, np.int32), np.zeros((2, n), np.int8))
    while len(flight.tubes):
        flight = _step(surface, leg, out, flight, first, last, found, landed)
    if not landed:
        return tubes.take(np.zeros(n, bool))
    after = Tubes.join(landed)
    ph = phases_of(surface, leg, out, after, False, rule)
    return after.take(found.that_count(ph.bound if last else ph.area, ph.length))


@dataclass(frozen=True)
class _Flight:
    """Tubes between two surfaces: `start` (n, 4) [m] from which hits count, layers `through` (n, l) so far, and how
    often each was cut and passed a layer, `count` (2, n)."""

    tubes: Tubes
    start: Floats
    through: Ints
    count: NDArray[np.int8]

    def take(self, rows: NDArray[np.signedinteger]) -> _Flight:
        return _Flight(self.tubes.take(rows), self.start[rows], self.through[rows], self.count[:, rows])


def _step(
    surface: Surface, leg: Leg, out: Leg, flight: _Flight, first: bool, last: bool, found: Found, landed: list[Tubes]
) -> _Flight:
    """Cast centre rays, and corners where they matter; land what agrees; return what was cut, and what goes on behind
    the thin layers that were hit."""
    rule, tubes = found.rule, flight.tubes
    k = mirrored(tubes)
    ph = phases_of(surface, leg, out, tubes, first, rule)
    points = on_facets(surface, tubes) if first else tubes.points
    mid, ahead = surface.cast(points[:, CENTRE], k[:, CENTRE], tubes.facet, flight.start[:, CENTRE])
    hit, t = np.repeat(mid, 4).reshape(-1, 4), np.repeat(ahead, 4).reshape(-1, 4)
    if last:
        # What counts is how the phase will run where the tube lands: two mirrors at right angles send it straight
        # back. Before more mirrors nobody knows. Where the centre meets nothing a body may still stand beside it.
        span = np.where(mid >= 0, _landing_span(surface, out, tubes, k, hit, rule), 0.0)
        matters = ph.area > found.doubt(_whole_way(out, tubes, k, ahead)) * (1.0 + 0.5 * span)
    else:
        matters = ph.area > found.doubt(ph.length)
    # Beside a centre that meets nothing no corner is cast: the outline of a body there runs through the tube.
    _cast_corners(surface, points, tubes.facet, k, flight.start, np.flatnonzero(matters & (mid >= 0)), hit, t)
    agree = _agree(surface, hit)
    side = _edges(surface, leg, tubes, points, k, hit, t, matters)
    mixed = (~agree & (hit >= 0).any(axis=1)) | (side != 0.0).any(axis=1)
    cuts, layers = flight.count
    split = mixed & matters & (cuts < rule.levels)
    ready = np.flatnonzero(~split & (mid >= 0))
    whole = np.where(agree[ready, None], hit[ready], mid[ready, None])
    landed.append(_land(surface, leg, tubes.take(ready), k[ready], whole, flight.through[ready], rule))
    behind = ready[surface.is_layer[mid[ready]] & (layers[ready] < rule.layers)]
    beyond = flight.take(behind)
    reach = np.where(np.isfinite(t[behind]), t[behind], t[behind, CENTRE, None]) + 1e-6
    beyond.through[np.arange(len(behind)), layers[behind]] = mid[behind]
    beyond.count[1] += 1
    rows = np.flatnonzero(split)
    parts, rows = divide(surface, leg, tubes.take(rows), rows, side[rows], first, rule)
    start = flight.start[rows]
    start[:] = np.where(start > 0, start.max(axis=1, keepdims=True), 0.0)
    count = flight.count[:, rows]
    count[0] += 1
    return _Flight(
        Tubes.join([parts, beyond.tubes]),
        np.concatenate([start, reach]),
        np.concatenate([flight.through[rows], beyond.through]),
        np.concatenate([count, beyond.count], axis=1),
    )


def _edges(
    surface: Surface, leg: Leg, tubes: Tubes, footprint: Floats, k: Floats, hit: Ints, t: Floats, wanted: Bools
) -> Floats:
    """Return the sides (n, 3) of an edge that runs through each of the tubes `wanted`; zeros where none does."""
    flat = tubes.flat & ~surface.curved[tubes.facet]
    side = np.zeros((len(tubes), 3))
    for rows, far in ((np.flatnonzero(flat & wanted), leg.far), (np.flatnonzero(~flat & wanted), True)):
        points, way, met = footprint[rows], k[rows], hit[rows]
        mid = way[:, CENTRE]
        reach = np.where(met[:, CENTRE] >= 0, t[rows, CENTRE], surface.extent)
        # Off a curved mirror rays seem to come from no one point: there they count as parallel, with the section that
        # the tube has where it lands.
        spread = np.where(flat[rows], 0.0, reach)[:, None, None] * (way - mid[:, None])
        plane = np.where(met >= 0, surface.plane[np.maximum(met, 0)], -1)
        source = points[:, CENTRE] - tubes.length[rows, CENTRE, None] * mid
        at = points + spread
        found = edge_within(at, source, mid, far, plane, surface.first_edge, surface.outline)
        meeting_lines(at, source, mid, far, plane, met, surface.first, surface.normal, mid, found)
        between(surface).across(points, way, source, far, flat[rows], met[:, CENTRE], reach, found)
        side[rows] = found
    return side


def _landing_span(surface: Surface, out: Leg, tubes: Tubes, k: Floats, hit: Ints, rule: Refinement) -> Floats:
    ways = surface.first, surface.normal, out.image, out.far
    span: Floats = landing_span(tubes.points, k, tubes.length, hit, *(*ways, rule.wavenumber))
    return span


def _whole_way(out: Leg, tubes: Tubes, k: Floats, t: Floats) -> Floats:
    """Return the lengths (n,) [m] of the ways that end where the centre rays land, or here where they do not."""
    reach = np.where(np.isfinite(t), t, 0.0)
    end = tubes.points[:, CENTRE] + reach[:, None] * k[:, CENTRE]
    return np.asarray(tubes.length[:, CENTRE] + reach + out.rays(end)[1])


def mirrored(tubes: Tubes) -> Floats:
    """Return the directions (n, 4, 3) after reflection at the true surface."""
    dot = np.einsum("nij,nij->ni", tubes.k, tubes.normals)
    return tubes.k - 2.0 * dot[..., None] * tubes.normals


def _cast_corners(
    surface: Surface,
    points: Floats,
    facet: Ints,
    k: Floats,
    start: Floats,
    rows: NDArray[np.signedinteger],
    hit: Ints,
    t: Floats,
) -> None:
    """Write the facets met and distances (n, 4) of the corner rays of the tubes `rows`; the centre's speak for the
    others."""
    centre = points[rows, CENTRE:]
    origin = (centre + 0.98 * (points[rows, :3] - centre)).reshape(-1, 3)
    own = np.repeat(facet[rows], 3)
    found, distance = surface.cast(origin, k[rows, :3].reshape(-1, 3), own, start[rows, :3].ravel())
    hit[rows, :3], t[rows, :3] = found.reshape(-1, 3), distance.reshape(-1, 3)


def _agree(surface: Surface, hit: Ints) -> Bools:
    """Tell whether all rays of a tube land on one plane, or on one smooth patch within a small turn."""
    safe = np.maximum(hit, 0)
    all_hit = (hit >= 0).all(axis=1)
    plane, smooth = surface.plane[safe], surface.smooth[safe]
    turn = np.einsum("nij,nj->ni", surface.normal[safe], surface.normal[safe[:, CENTRE]])
    one_plane = (plane == plane[:, CENTRE:]).all(axis=1)
    one_patch = (smooth == smooth[:, CENTRE:]).all(axis=1) & (turn > _ALIKE).all(axis=1)
    return all_hit & (one_plane | one_patch)


def _land(surface: Surface, leg: Leg, tubes: Tubes, k: Floats, hit: Ints, through: Ints, rule: Refinement) -> Tubes:
    """Return tubes put down on the planes of the facets `hit` (n, 4), their reflection written into the history."""
    n = len(tubes)
    flat_k, flat_p, flat_hit = k.reshape(-1, 3), tubes.points.reshape(-1, 3), hit.ravel()
    t = surface.distance(flat_hit, flat_p, flat_k).reshape(n, 4)
    # Rays that run beside the centre's plane cannot be put down on it: such a sliver is dropped.
    sound = np.flatnonzero((t > -1e-6).all(axis=1) & (t < 10.0 * t[:, CENTRE:] + 1.0).all(axis=1))
    tubes, k, hit, through, t = tubes.take(sound), k[sound], hit[sound], through[sound], t[sound]
    n = len(tubes)
    before = vector_area(tubes.points)
    facet = hit[:, CENTRE].copy()
    every = np.arange(n)
    tubes.append(every, tubes.points[:, CENTRE], tubes.normals[:, CENTRE], tubes.facet, REFLECT)
    cosine = np.abs(np.einsum("ij,ij->i", tubes.normals[:, CENTRE], k[:, CENTRE]))
    tubes.strength = tubes.strength * surface.strength(tubes.facet, cosine, rule.wavenumber)
    write_layers(surface, tubes, tubes.points[:, CENTRE], k[:, CENTRE], through, rule)
    points = tubes.points + t[..., None] * k
    after = vector_area(points)
    across_before = np.einsum("ij,ij->i", before, k[:, CENTRE])
    across_after = np.einsum("ij,ij->i", after, k[:, CENTRE])
    flat = tubes.flat & ~surface.curved[tubes.facet]
    length = tubes.length + t
    with np.errstate(divide="ignore", invalid="ignore"):
        thinned = tubes.spread * np.sqrt(np.abs(across_before / across_after))
    thinned = np.where(np.isfinite(thinned), thinned, 0.0)
    tubes.spread = np.where(flat, leg.spread(length[:, CENTRE]), thinned)
    tubes.caustics = tubes.caustics + (across_before * across_after < 0.0)
    bary = surface.barycentric(hit.reshape(-1), points.reshape(-1, 3))
    normals = surface.normal_at(hit.reshape(-1), np.clip(bary, -0.5, 1.5)).reshape(n, 4, 3)
    # The centre says which side is lit; a corner beyond the terminator then shows its back and carries nothing.
    behind = np.einsum("nj,nj->n", normals[:, CENTRE], k[:, CENTRE]) > 0.0
    tubes.normals = np.where(behind[:, None, None], -normals, normals)
    tubes.points, tubes.k, tubes.length, tubes.flat, tubes.facet = points, k, length, flat, facet
    tubes.bounces = tubes.bounces + np.int8(1)
    return tubes
