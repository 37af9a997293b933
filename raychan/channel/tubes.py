"""Tubes of rays: their state between bounces, how they are cut in two, and how much they can matter.

A tube is a triangle of three corner rays about a centre ray. Lengths and directions are known at all four, so a
tube may be cut without tracing it again from the start: between corners the length follows from its values and
gradients (the directions) by a Hermite rule that is exact to third order; on the first surface it is computed anew.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from raychan.channel.history import History
from raychan.channel.legs import Leg
from raychan.channel.surface import Surface
from raychan.frames import sizes
from raychan.kernels.patch import rays_on
from raychan.kernels.phases import phases
from raychan.kernels.rows import in_two
from raychan.tables import REFLECT

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]

CENTRE = 3
MOST_BEND = 4.0  # rad: beyond it cutting with rays is cheaper than cutting in the integral
_MANY = 4096  # tubes from which on a second thread pays
_EDGES = np.array([[0, 1], [1, 2], [2, 0]])


@dataclass(frozen=True)
class Refinement:
    """How finely tubes are cut.

    `wavenumber` [rad/m]; `phase` [rad] deviation from quadratic that a tube may have where its phase stands still;
    `floor` [1/m] scattered amplitude (unit field at 1 m) under which a doubtful tube is left as it is; `relative` the
    same for a hundred tubes, as a fraction of what was found within the same `cell` [m] of two-way length; `max_edge`
    [m] of first tubes; `levels` of cutting for sight and bounces; `slots` of history; `layers` that a stretch may
    pass; `jitter` (0 to 0.5) draws cuts off the middle, for a second lattice.
    """

    wavenumber: float
    phase: float = 0.05
    turn: float = 0.15
    floor: float = 0.0
    relative: float = 0.01
    cell: float = np.inf
    max_edge: float = 0.3
    levels: int = 12
    slots: int = 8
    layers: int = 2
    max_tubes: int = 100_000_000
    jitter: float = 0.0


@dataclass
class Tubes:
    """Tubes standing on their present footprint; n tubes, 4 rays each (corners, centre), d slots of history.

    `strength` left of the field by mirrors and layers; `points` [m], `k` unit directions of arrival, `length` [m]
    from the transmitter, `normals` of the true surface on the lit side, `spread` [1/m] field at the footprint, `flat`
    all mirrors so far were planes, `bary` corners on
    the first facet, `slots` of history in use, `bounces` counted with this one, `caustics` passed, `last` row of the
    `history` that tubes of one launch share.
    """

    points: Floats
    k: Floats
    length: Floats
    normals: Floats
    facet: Ints
    spread: Floats
    strength: Floats
    flat: Bools
    bary: Floats
    slots: Ints
    bounces: Ints
    caustics: Ints
    last: Ints
    history: History

    def __len__(self) -> int:
        return len(self.facet)

    def take(self, index: NDArray[np.generic]) -> Tubes:
        """Return the tubes at `index` (mask or numbers)."""
        rows = numbers(index)
        return Tubes(**{name: getattr(self, name).take(rows, axis=0) for name in _ROWS}, history=self.history)

    @staticmethod
    def join(parts: list[Tubes]) -> Tubes:
        """Return all tubes of several sets of one launch as one."""
        some = [p for p in parts if len(p)] or parts[:1]
        if len(some) == 1:
            return some[0]
        rows = {name: np.concatenate([getattr(p, name) for p in some]) for name in _ROWS}
        return Tubes(**rows, history=parts[0].history)

    def append(self, rows: NDArray[np.generic], vertex: Floats, normal: Floats, facet: Ints, kind: int) -> None:
        """Write one more vertex into the history of the tubes `rows`."""
        self.last[rows] = self.history.append(self.last[rows], vertex, normal, facet, kind)
        self.slots[rows] += 1

    def came_from(self) -> Ints:
        """Return the facets (n,) of the last reflection before the surface that the tubes stand on; -1: none."""
        return self.history.newest(self.last, REFLECT)


_ROWS = tuple(f.name for f in fields(Tubes) if f.name != "history")


def stand(surface: Surface, leg: Leg, facet: Ints, bary: Floats, slots: int) -> Tubes:
    """Return first-bounce tubes on the true surface at barycentric corners (n, 3, 3), seen from the end of `leg`."""
    n = len(facet)
    points, k, length, normals = _first_rays(surface, leg, facet, bary)
    return Tubes(
        points=points,
        k=k,
        length=length,
        normals=normals,
        facet=facet,
        spread=leg.spread(length[:, CENTRE]),
        strength=leg.weight(points[:, CENTRE]),
        flat=np.ones(n, bool),
        bary=bary,
        slots=np.zeros(n, np.int8),
        bounces=np.full(n, len(leg.mirrors) + 1, np.int8),
        caustics=np.zeros(n, np.int8),
        last=np.full(n, -1, np.int32),
        history=History(slots),
    )


def _first_rays(surface: Surface, leg: Leg, facet: Ints, bary: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    f = surface.facets
    return rays_on(facet, bary, f.vertices, f.normals, surface.bulge, surface.open_facet, leg.image, leg.far)


def halves(surface: Surface, leg: Leg, tubes: Tubes, edge: Ints, first: bool, jitter: float = 0.0) -> Tubes:
    """Return both halves of tubes cut from the middle of edge 0, 1 or 2 to the corner opposite."""
    row = np.arange(len(tubes))
    share = 0.5 + jitter * np.where(row % 2, 1.0, -1.0)
    i, j = _EDGES[edge].T
    parts = []
    for moved in (j, i):
        w = np.broadcast_to(np.eye(3), (len(tubes), 3, 3)).copy()
        w[row, moved, i], w[row, moved, j] = share, 1.0 - share
        parts.append(parts_of(surface, leg, tubes, w, first))
    return Tubes.join(parts)


def along_line(surface: Surface, leg: Leg, tubes: Tubes, side: Floats, first: bool) -> tuple[Tubes, Bools]:
    """Return the three parts of tubes cut along a straight line of their footprint, and which of 3 n have an area.

    Args: side (n, 3) signed distances of the corners from the line; one corner has a sign of its own.
    """
    row = np.arange(len(tubes))
    positive = side > 0.0
    lone = np.argmax(positive == (positive.sum(axis=1) == 1)[:, None], axis=1)
    b, c = (lone + 1) % 3, (lone + 2) % 3
    to_b = side[row, lone] / (side[row, lone] - side[row, b])
    to_c = side[row, lone] / (side[row, lone] - side[row, c])
    corner = np.eye(3)
    u = corner[lone] * (1.0 - to_b)[:, None] + corner[b] * to_b[:, None]
    v = corner[lone] * (1.0 - to_c)[:, None] + corner[c] * to_c[:, None]
    triples = ((corner[lone], u, v), (u, corner[b], corner[c]), (u, corner[c], v))
    out = Tubes.join([parts_of(surface, leg, tubes, np.stack(t, axis=1), first) for t in triples])
    real = sizes(vector_area(out.points)) > 1e-14
    return out.take(real), real


def parts_of(surface: Surface, leg: Leg, tubes: Tubes, weights: Floats, first: bool) -> Tubes:
    """Return part tubes whose corner i is the mean of the parent's corners by weights[:, i] (n, 3, 3).

    New corners lie on edges of the parent. On the first surface (`first`) their rays are computed anew on the
    true surface; later ones are means along the plane footprint, with the length by the cubic Hermite rule.
    """
    child = tubes.take(np.arange(len(tubes)))
    child.bary = weights @ tubes.bary
    if first:
        child.points, child.k, child.length, child.normals = _first_rays(surface, leg, child.facet, child.bary)
        child.spread = leg.spread(child.length[:, CENTRE])
        return child
    p, k, length = tubes.points[:, :3], tubes.k[:, :3], tubes.length[:, :3]
    child.points[:, :3] = weights @ p
    child.k[:, :3] = unit(weights @ k)
    child.normals[:, :3] = unit(weights @ tubes.normals[:, :3])
    for i, j in _EDGES:
        d = p[:, j] - p[:, i]
        gi, gj = np.einsum("nj,nj->n", k[:, i], d), np.einsum("nj,nj->n", k[:, j], d)
        for corner in range(3):
            t = weights[:, corner, j]
            on = (t > 0.0) & (weights[:, corner, i] > 0.0)
            h = length[:, i] + t * (length[:, j] - length[:, i])
            slope = length[:, j] - length[:, i]
            h = h + t * (1 - t) * ((1 - t) * (gi - slope) - t * (gj - slope))
            child.length[on, corner] = h[on]
    whole = np.argmax(weights, axis=2)
    pure = weights.max(axis=2) == 1.0
    child.length[:, :3] = np.where(pure, np.take_along_axis(length, whole, axis=1), child.length[:, :3])
    _centre(child)
    return child


def _centre(tubes: Tubes) -> None:
    """Set the centre ray of each tube from its corners; its length as the mean of parabolas along the three medians."""
    p, k = tubes.points[:, :3], tubes.k[:, :3]
    c = p.mean(axis=1)
    kc = unit(k.sum(axis=1))
    reach = np.einsum("nij,nij->ni", k + kc[:, None], c[:, None] - p)
    tubes.points[:, CENTRE], tubes.k[:, CENTRE] = c, kc
    tubes.length[:, CENTRE] = (tubes.length[:, :3] + 0.5 * reach).mean(axis=1)
    tubes.normals[:, CENTRE] = unit(tubes.normals[:, :3].sum(axis=1))


def vector_area(points: Floats) -> Floats:
    """Return half the cross product of two edges of triangles (n, 3 or 4, 3) [m^2]."""
    return 0.5 * np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])


def edge_lengths(tubes: Tubes) -> Floats:
    """Return the three edges (n, 3) [m] of each footprint."""
    p = tubes.points[:, :3]
    return sizes(np.roll(p, -1, axis=1) - p)


def middles(surface: Surface, leg: Leg, tubes: Tubes, first: bool) -> tuple[Floats, Floats]:
    """Return the middles of the three edges (n, 3, 3) [m] and the lengths there (n, 3) [m]."""
    if first:
        points, _, length, _ = _first_rays(
            surface, leg, tubes.facet, 0.5 * (tubes.bary + np.roll(tubes.bary, -1, axis=1))
        )
        return points[:, :3], length[:, :3]
    p, k, length = tubes.points[:, :3], tubes.k[:, :3], tubes.length[:, :3]
    d = np.roll(p, -1, axis=1) - p
    bend = np.einsum("nij,nij->ni", k - np.roll(k, -1, axis=1), d)
    return p + 0.5 * d, 0.5 * (length + np.roll(length, -1, axis=1)) + 0.125 * bend


@dataclass(frozen=True)
class Phases:
    """Phases of tubes over a way out [rad]: `six` (n, 6) at corners and edge middles, `bend` (n, 3) of the edges from
    straight, `bound` (n,) [1/m] on what a tube can scatter, `area` the same were it in phase, `rough` (n,) above 1
    where a tube bends more than a quadratic phase and one direction of the surface can follow, `length` (n,) [m] of
    the whole way."""

    six: Floats
    bend: Floats
    bound: Floats
    area: Floats
    rough: Floats
    length: Floats

    def take(self, index: NDArray[np.generic]) -> Phases:
        """Return the phases of the tubes at `index` (mask or numbers)."""
        rows = numbers(index)
        return Phases(**{f.name: getattr(self, f.name).take(rows, axis=0) for f in fields(self)})

    @staticmethod
    def join(parts: list[Phases]) -> Phases:
        """Return the phases of several sets of tubes as one."""
        return Phases(**{f.name: np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Phases)})


def phases_of(surface: Surface, leg: Leg, out: Leg, tubes: Tubes, first: bool, rule: Refinement) -> Phases:
    """Return the phases of tubes over the way out, and what each can scatter back at most."""
    n, f = len(tubes), surface.facets
    six, bend, (bound, area, rough, way) = np.empty((n, 6)), np.empty((n, 3)), np.empty((4, n))
    rays = tubes.points, tubes.k, tubes.length, tubes.normals, tubes.facet, tubes.bary
    held = tubes.strength, tubes.spread
    written = six, bend, bound, area, rough, way
    shape = f.vertices, surface.bulge, leg.image, leg.far, out.antenna, rule.wavenumber
    m = f.materials
    stuff = surface.dull, f.material, (m.kind, m.eps, m.thickness, m.roughness)

    def some(rows: slice) -> None:
        here, of, to = ([x[rows] for x in arrays] for arrays in (rays, held, written))
        phases(*(*here, first, *shape, *of, (rule.phase, rule.turn, MOST_BEND), *stuff, *to))

    in_two(n, some, _MANY)
    return Phases(six, bend, bound, area, rough, way)


def numbers(index: NDArray[np.generic]) -> NDArray[np.intp]:
    """Return the numbers of the rows at `index` (mask or numbers): to take rows by these is up to ten times faster."""
    return np.flatnonzero(index) if index.dtype == np.bool_ else np.asarray(index, np.intp)


def unit(v: Floats) -> Floats:
    """Return vectors (..., 3) scaled to length one; a vector of none stays as it is."""
    size = sizes(v)[..., None]
    return v / np.where(size > 0.0, size, 1.0)
