"""The launch: tubes on the facets that a leg lights, subdivided until each is simple in phase and in visibility.

Each lit facet is one tube to begin with, so that none straddles surfaces at the first bounce. It is bisected until the
two-way phase over it is quadratic, clipped at the terminator of a curved surface, and then at the edges of shadows.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.geometry.lit_parts import lit_parts
from raychan.geometry.patch_cuts import edge_of_fan, edge_to_cut, halved
from raychan.poses import sizes
from raychan.records import REFLECT, SCATTERER, TRANSMIT
from raychan.tracing.cache import cache_of
from raychan.tracing.contributions import Contributions
from raychan.tracing.culling import seed_facets
from raychan.tracing.legs import Leg, View
from raychan.tracing.radiation import OBLIQUE, phases_of, radiating
from raychan.tracing.subdivide import as_if_straight, clipped, subdivide
from raychan.tracing.tubes import CENTRE, MOST_BEND, Refinement, Tubes, edge_middles, launch_tubes, unit
from raychan.tracing.visibility import centre_visibility, tube_visibility
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]

# Of the prune threshold: from there on a coarse launch looks at hidden tubes where others of their facets are seen, as
# several may be seen in part. A bench 1.1 and 1.3 dB too strong of 0.7 and 0.5 stated, without this and the late ways
# of `other_ways`, is right with 0.3 and with 0.1, which takes more rays. With both 196 of 202 levels of 26 random
# streets at 1 and 0.5 dB, that bench's among them, lie within what is stated, without 193 (no command).
_HIDDEN = 0.3
OBLIQUE_SHARE = 0.1  # of their sum in phase that tubes facing away from an end are taken to add up to; not measured


def launch(
    geometry: Geometry,
    leg: Leg,
    out: Leg,
    pieces: Bools,
    found: Contributions,
    more: bool,
    others: list[Leg],
    only: Bools | None = None,
) -> Iterator[Tubes]:
    """Yield, in batches, the tubes of first bounces that are seen over `leg`, fine enough for a return over `out`.

    Args: pieces (p,) which may carry a first bounce (those of the leg's own mirrors never do); found the field found so
    far; more whether the tubes bounce again; others legs by which they may leave too; only (f,) facets to start on.
    """
    f = geometry.facets
    shape = f.vertices, f.normals, geometry.edge_curvature
    images = leg.image, leg.far, out.image, out.far
    facet = seeds_of(geometry, leg, pieces)
    if only is not None:
        facet = facet[only[facet]]
    for part, bary in _bisect_for_phase(geometry, facet, shape, images, found, not more):
        part, bary = lit_parts(part, bary, *shape, geometry.both_sides, leg.image, leg.far)
        tubes = clip_where_gains_end(geometry, leg, out, launch_tubes(geometry, leg, part, bary))
        if leg.mirrors:
            tubes = _prune_facing_away(geometry, leg, out, others, tubes, found)
        yield _clip_at_shadows(geometry, leg, out, tubes, found, more)


def seeds_of(geometry: Geometry, leg: Leg, pieces: Bools) -> Ints:
    """Return the `seed_facets` of a leg on pieces (p,) that may carry a first bounce, kept with the leg: launches that
    refine start from some of the same."""
    allowed = pieces & (geometry.piece_role == SCATTERER)
    allowed[leg.pieces(geometry)[-1:]] = False
    known, found = cache_of(geometry).by_leg("seeds", leg, lambda: (allowed, seed_facets(geometry, leg, allowed)))
    return found if np.array_equal(known, allowed) else seed_facets(geometry, leg, allowed)


def clip_where_gains_end(geometry: Geometry, leg: Leg, out: Leg, tubes: Tubes) -> Tubes:
    """Return the tubes, just launched, clipped at the planes behind which the gain of an end ends at once."""
    count = len(tubes)
    for end in [leg] if out is leg else [leg, out]:
        for normal in end.gain_ends:
            height = (tubes.points[:, :CENTRE] - end.image) @ normal
            across = (height.min(axis=1) < 0.0) & (height.max(axis=1) > 0.0)
            rows = np.flatnonzero(across & geometry.curved[tubes.facet])
            if len(rows):
                # A corner that comes to lie behind the plane, and not on it, has no field at all.
                middle, _ = edge_middles(geometry, leg, tubes.take(rows), True)
                height[rows] = as_if_straight(height[rows], (middle - end.image) @ normal)
            tubes = clipped(geometry, leg, tubes, height)
    if len(tubes) > count:
        # Parts have the strength of the whole, whose centre may lie behind.
        tubes.strength = leg.weight(tubes.points[:, CENTRE])
    return tubes


def across_gain_ends(leg: Leg, corners: Floats) -> Bools:
    """Return which triangles (n, 3, 3) [m] a plane runs through behind which the gain of the leg's end ends at once."""
    side = (corners - leg.image) @ leg.gain_ends.T
    return np.asarray(((side.min(axis=1) < 0.0) & (side.max(axis=1) > 0.0)).any(axis=1))


def _prune_facing_away(
    geometry: Geometry, leg: Leg, out: Leg, others: list[Leg], tubes: Tubes, found: Contributions
) -> Tubes:
    """Return the tubes that face the end of `out`, and of the rest those that count over it or one of the others."""
    _, facing = radiating(out, tubes, OBLIQUE)
    away = np.flatnonzero(~facing)
    some, best, length = tubes.take(away), np.zeros(len(away)), np.zeros(len(away))
    for other in [out, *others] if len(away) else []:
        share, _ = radiating(other, some, OBLIQUE)
        ph = phases_of(geometry, leg, other, some, found.rule)
        better = ph.bound * share > best
        best[better], length[better] = (ph.bound * share)[better], ph.length[better]
    counts = facing.copy()
    counts[away[found.that_count(OBLIQUE_SHARE * best, length, 0)]] = True
    return tubes.take(counts)


def _bisect_for_phase(
    geometry: Geometry, facet: Ints, shape: Any, images: Any, found: Contributions, across: bool
) -> Iterator[tuple[Ints, Floats]]:
    """Bisect tubes at the edge on which the two-way phase bends most, until it is quadratic; yield facets and corners
    of the parts in batches, so that memory does not grow with their number.

    Args: facet (n,); shape, images as for `edge_to_cut`; across whether only an edge's length across the rays is
    bounded: tubes that bounce again need to be short along them too.
    """
    rule = found.rule
    # What hides in tubes that bring less than deep ones are cut for, all in phase, is not looked for.
    least = rule.coarse * rule.floor
    limits = rule.wavenumber, rule.phase, rule.turn, rule.max_edge, MOST_BEND, rule.widest, across, least, rule.near
    left = [(facet, np.broadcast_to(np.eye(3), (len(facet), 3, 3)).copy(), 0)]
    done: list[tuple[Ints, Floats]] = []
    held = 0
    while left:
        facet, bary, level = left.pop()
        if len(facet) > rule.batch:
            half = len(facet) // 2
            left += [(facet[half:].copy(), bary[half:].copy(), level), (facet[:half], bary[:half], level)]
            continue
        edge = edge_to_cut(facet, bary, *(*shape, *images, *limits))
        if rule.by_landing and not across:
            edge = np.where(edge < 0, edge_of_fan(facet, bary, shape[1], rule.fan), edge)
        if level < rule.least:
            edge = np.where((edge < 0) & (geometry.curved[facet] | (not across)), _longest(facet, bary, shape[0]), edge)
        more = found.budget.affords_phase(geometry, facet, edge >= 0)
        ready, rows = np.flatnonzero(~more), np.flatnonzero(more)
        if held + len(ready) > rule.batch:
            yield _joined(done)
            done, held = [], 0
        done.append((facet.take(ready), bary.take(ready, axis=0)))
        held += len(ready)
        if len(rows):
            left.append((*halved(facet, bary, edge, rows, rule.jitter, level), level + 1))
    if held:
        yield _joined(done)


def _longest(facet: Ints, bary: Floats, vertices: Floats) -> NDArray[np.int8]:
    """Return the longest edge (n,) of patches of facets (n,) with corners bary (n, 3, 3)."""
    corner = bary @ vertices[facet]
    lengths = sizes(corner - np.roll(corner, -1, axis=1))
    return np.argmax(lengths, axis=1).astype(np.int8)


def _joined(parts: list[tuple[Ints, Floats]]) -> tuple[Ints, Floats]:
    return np.concatenate([f for f, _ in parts]), np.concatenate([b for _, b in parts])


def _clip_at_shadows(geometry: Geometry, leg: Leg, out: Leg, tubes: Tubes, found: Contributions, more: bool) -> Tubes:
    """Return the tubes that are seen; those of which only some rays are seen are subdivided while they matter: by what
    they return, or, where they bounce again, by what they may carry there."""
    parts: list[Tubes] = []
    rule = found.rule

    def take_seen(view: View, ready: Bools) -> None:
        rows = np.flatnonzero(ready)
        if len(rows) or not parts:
            parts.append(tubes.take(rows))
            write_leg(geometry, parts[-1], leg, view.corners.take(rows, axis=0), view.passed.take(rows, axis=0), rule)

    ph = phases_of(geometry, leg, out, tubes, rule)
    # What returns little by itself may still carry the next bounces.
    rows = found.that_count(ph.in_phase if more else ph.bound, ph.length)
    if len(rows) < len(tubes):
        tubes, ph = tubes.take(rows), ph.take(rows)
    # First by the centre rays alone: what is hidden must not raise the prune threshold, and the strongest lit surface
    # may stand behind a wall.
    view = centre_visibility(geometry, leg, tubes, True, rule)
    found.add(ph.take(view.seen))
    ready = geometry.convex_alone or found.budget.spent(geometry)
    # A coarse launch leaves what hidden tubes carry to those that follow it.
    coarse = rule.coarse != 1.0
    carries, cut = more and not coarse, _HIDDEN if coarse else 1.0
    least = found.prune_threshold(ph.length)
    if coarse:
        least[_beside_seen(geometry, tubes, view)] *= cut
    matters = ((ph.in_phase if carries else ph.bound) > least) & (not ready)
    take_seen(view, view.seen & ~matters)
    rows = np.flatnonzero(matters)
    known: View | None = view.take(rows)
    tubes, matters = tubes.take(rows), matters[rows]
    for level in range(rule.levels + 1):
        if not len(tubes):
            break
        s = tube_visibility(geometry, leg, tubes, matters, True, rule, level, known)
        split = found.budget.affords(geometry, tubes.facet, s.mixed & matters & (level < rule.levels))
        take_seen(s.centre, ~split & s.centre.seen)
        rows = np.flatnonzero(split)
        tubes, _ = subdivide(geometry, leg, tubes, rows, s.side, True, rule.jitter)
        ph = phases_of(geometry, leg, out, tubes, rule)
        known, matters = None, (ph.in_phase if carries else ph.bound) > cut * found.prune_threshold(ph.length)
    return Tubes.join(parts)


def _beside_seen(geometry: Geometry, tubes: Tubes, view: View) -> Bools:
    """Return which tubes (n,) are hidden while others of their facets are seen."""
    in_part = np.zeros(len(geometry.plane), bool)
    in_part[tubes.facet[view.seen]] = True
    return ~view.seen & in_part[tubes.facet]


def write_leg(geometry: Geometry, tubes: Tubes, leg: Leg, corners: Floats, passed: Ints, rule: Refinement) -> None:
    """Write the leg's mirrors, met at corners (n, m, 3) [m], and the layers passed (n, l) (see `leg_rays.follow_leg`)
    into the tubes' history."""
    every, per = np.arange(len(tubes)), passed.shape[1] // (len(leg.mirrors) + 1)
    for i, m in enumerate(leg.mirrors):
        facet = np.full(len(tubes), m.facet, np.int32)
        d = unit(corners[:, i] - (corners[:, i - 1] if i else leg.end))
        write_layers(geometry, tubes, corners[:, i], d, passed[:, i * per : (i + 1) * per], rule)
        tubes.append(every, corners[:, i], m.normal, facet, REFLECT)
        tubes.strength = tubes.strength * geometry.strength(facet, np.abs(d @ m.normal), rule.wavenumber)
    own = passed[:, len(leg.mirrors) * per :]
    write_layers(geometry, tubes, tubes.points[:, CENTRE], tubes.k[:, CENTRE], own, rule)


def write_layers(geometry: Geometry, tubes: Tubes, point: Floats, k: Floats, passed: Ints, rule: Refinement) -> None:
    """Write the layers (n, l) that the rays through `point` (n, 3) along k (n, 3) passed into the history."""
    for j in range(passed.shape[1]):
        rows = np.flatnonzero(passed[:, j] >= 0)
        if not len(rows):
            break  # layers are written from the first column on
        facet = passed[rows, j]
        t = geometry.distance(facet, point[rows], k[rows])
        tubes.append(rows, point[rows] + t[:, None] * k[rows], geometry.normal[facet], facet, TRANSMIT)
        cosine = np.abs(np.einsum("ij,ij->i", geometry.normal[facet], k[rows]))
        tubes.strength[rows] *= geometry.strength(facet, cosine, rule.wavenumber, passing=True)
