"""Ray tubes: their state on a surface, and the rule by which they are refined.

A tube is a triangle of three corner rays about a centre ray. Lengths and directions are known at all four, so a tube
may be subdivided without tracing it again from the start: between corners the length follows from its values and
gradients (the directions) by a Hermite rule that is exact to third order; on the first surface it is computed anew.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raychan.columns import row_numbers
from raychan.geometry.curved_patches import rays_on
from raychan.poses import sizes
from raychan.records import REFLECT
from raychan.tracing.history import History
from raychan.tracing.legs import Leg
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]

CENTRE = 3
# Of its distance from an end: what a first tube may reach. Of 60 plates of 5 cm to 1 m, 5 mm to 3 m before a radar at
# 10, 24 and 77 GHz, at 0.1 to 3 dB, none is off a direct sum by more than 0.08 dB beyond what is stated, with 0.2 by
# more than 0.2 dB; with 0.5 at all tolerances 12 are by more than 0.5 dB. Frames of three scenes take 0.2 % more rays
# at most with it (command not kept).
NEAR = 0.15
MOST_BEND = 4.0  # rad that an edge may bend: the phase integral divides tubes that bend more itself; not measured
_CLEAR, _STEEP = 1.5, 0.05  # times a hollow patch's depth, the least slope: what rays that leave it pass; not measured
_MOST_SLOTS = 120  # of a history: their number is kept in a byte


@dataclass(frozen=True)
class Refinement:
    """How finely tubes are subdivided.

    Fields: `wavenumber` [rad/m]; `phase` [rad] by which a tube may deviate from quadratic where its phase is
    stationary; `turn` [rad] by which its normal may; `floor` [1/m] scattered amplitude (unit field at 1 m) under which
    a tube is not subdivided, `specular` the same for what a curved surface reflects at a specular point; `relative` the
    same for a hundred tubes, as a fraction of what was found within the same `cell` [m] of two-way length, or of the
    share `beside` of that in the cells next to it; `max_edge` [m] of first tubes, the share `near` of their distance
    from an end that they may reach, and the `widest` angle [rad] under which an end may see their edges; `levels` of
    subdivision for visibility and bounces; `slots` of history; `layers` that a stretch may pass; `batch` of tubes
    launched at once, which bounds the memory (few scenes have more on one leg; not measured); budgets of a launch:
    `max_tubes` that subdivision for phase may make, `max_cuts` for visibility, `max_rays` (see
    `Contributions.affords`); `jitter` (0 to 0.5) moves cuts off the middle, for a second lattice; `coarse` not 1: tubes
    that bounced are cut only where one alone may bring so many times the floor, and a good part of what is found there;
    `least` bisections of each first tube on a curved facet, and of all that bounce again, for a launch to be finer
    where the one before was fine enough; `fan` [rad] by which curved facets may spread the rays of a tube that bounces
    again (twice that after its first bounce), where `coarse` is not 1 of one that matters: where it is not infinite and
    `coarse` is 1, tubes are cut by what they may bring where they land;
    `patch` least cosine between the normals of facets of one smooth patch for a tube to land on several of them, 1: on
    one only.
    """

    wavenumber: float
    phase: float = 0.05
    turn: float = 0.15
    floor: float = 0.0
    specular: float = 0.0
    relative: float = 0.01
    cell: float = np.inf
    beside: float = 1.0
    max_edge: float = 0.3
    near: float = NEAR
    widest: float = np.inf
    levels: int = 12
    slots: int = 8
    layers: int = 2
    batch: int = 1 << 17
    max_tubes: int = 100_000_000
    max_cuts: float = np.inf
    max_rays: float = np.inf
    jitter: float = 0.0
    coarse: float = 1.0
    least: int = 0
    fan: float = np.inf
    patch: float = 0.98

    @property
    def by_landing(self) -> bool:
        """Whether tubes are cut by what they may bring, all in phase, where they land."""
        return self.fan < np.inf and self.coarse == 1.0

    def for_depth(self, bounces: int) -> Refinement:
        """Return the same rule with slots for so many bounces, and for layers on every stretch between them."""
        return replace(self, slots=min(max(self.slots, bounces + self.layers * (bounces + 1) + 3), _MOST_SLOTS))


class TubeColumns(NamedTuple):
    """The columns of `Tubes`, for kernels."""

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


@dataclass
class Tubes:
    """n tubes on their present footprint, four rays each: three corners, then the centre.

    Fields: `points` (n, 4, 3) [m]; `k` (n, 4, 3) unit directions of arrival; `length` (n, 4) [m] from the transmitter;
    `normals` (n, 4, 3) of the curved surface on the lit side; `facet` (n,); `spread` (n,) [1/m] field there by
    spreading alone, `strength` (n,) its share left by mirrors and layers; `flat` (n,) whether all mirrors so far were
    planes; `bary` (n, 3, 3) corners on the first facet, (n, 0, 3) once tubes left it; `slots` (n,) of history in use,
    `bounces` (n,) with this one, `caustics` (n,) passed; `last` (n,) row of the `history` that all tubes of one
    launch share.
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

    @property
    def columns(self) -> TubeColumns:
        """The columns, for kernels."""
        return TubeColumns(*(getattr(self, name) for name in _COLUMNS))

    def take(self, index: NDArray[np.generic]) -> Tubes:
        """Return the tubes at `index` (mask or numbers)."""
        rows = row_numbers(index)
        return Tubes(**{name: getattr(self, name).take(rows, axis=0) for name in _COLUMNS}, history=self.history)

    def only(self, rows: NDArray[np.intp]) -> Tubes:
        """Return the tubes `rows`, in order and each once; these tubes themselves, not a copy, if it is all of them."""
        return self if len(rows) == len(self) else self.take(rows)

    @staticmethod
    def join(parts: list[Tubes], kept: NDArray[np.intp] | None = None) -> Tubes:
        """Return all tubes of several sets of one launch as one, or of all these those `kept`, in order."""
        some = [p for p in parts if len(p)] or parts[:1]
        bounds = np.cumsum([0, *(len(p) for p in some)])
        if kept is None or len(kept) == bounds[-1]:
            if len(some) == 1:
                return some[0]
            rows = {name: np.concatenate([getattr(p, name) for p in some]) for name in _COLUMNS}
            return Tubes(**rows, history=parts[0].history)
        at = np.searchsorted(kept, bounds)
        rows = {}
        for name in _COLUMNS:
            columns = [getattr(p, name) for p in some]
            rows[name] = np.empty((len(kept), *columns[0].shape[1:]), columns[0].dtype)
            for column, before, i, j in zip(columns, bounds, at, at[1:], strict=False):
                # With mode "clip" numpy writes straight to `out`; all numbers are in range.
                column.take(kept[i:j] - before, axis=0, out=rows[name][i:j], mode="clip")
        return Tubes(**rows, history=parts[0].history)

    def append(self, rows: NDArray[np.generic], vertex: Floats, normal: Floats, facet: Ints, kind: int) -> None:
        """Write one more vertex into the history of the tubes `rows`."""
        self.last[rows] = self.history.append(self.last[rows], vertex, normal, facet, kind)
        self.slots[rows] += 1

    def came_from(self) -> Ints:
        """Return the facets (n,) of the last reflection before the present surface; -1: none."""
        return self.history.newest(self.last, REFLECT)


_COLUMNS = TubeColumns._fields


def launch_tubes(geometry: Geometry, leg: Leg, facet: Ints, bary: Floats) -> Tubes:
    """Return tubes on their first surface, at barycentric corners (n, 3, 3) of facets (n,), from the end of `leg`."""
    n = len(facet)
    points, k, length, normals = first_rays(geometry, leg, facet, bary)
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
        history=History(),
    )


def first_rays(geometry: Geometry, leg: Leg, facet: Ints, bary: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Return points, directions, lengths and normals of the rays of a leg to barycentric corners (n, 3, 3) and their
    centres."""
    f = geometry.facets
    return rays_on(facet, bary, f.vertices, f.normals, geometry.edge_curvature, geometry.both_sides, leg.image, leg.far)


def edge_middles(geometry: Geometry, leg: Leg, tubes: Tubes, first: bool) -> tuple[Floats, Floats]:
    """Return the middles of the three edges (n, 3, 3) [m] and the lengths there (n, 3) [m].

    Args: first whether tubes stand on their first surface.
    """
    if first:
        points, _, length, _ = first_rays(
            geometry, leg, tubes.facet, 0.5 * (tubes.bary + np.roll(tubes.bary, -1, axis=1))
        )
        return points[:, :3].copy(), length[:, :3].copy()
    p, k, length = tubes.points[:, :3], tubes.k[:, :3], tubes.length[:, :3]
    d = np.roll(p, -1, axis=1) - p
    bend = np.einsum("nij,nij->ni", k - np.roll(k, -1, axis=1), d)
    n, next_n = tubes.normals[:, :3], np.roll(tubes.normals[:, :3], -1, axis=1)
    rise = (0.125 * np.einsum("nij,nij->ni", next_n - n, d))[:, :, None] * unit(n + next_n)
    along = np.einsum("nij,nij->ni", 0.5 * (k + np.roll(k, -1, axis=1)), rise)
    return p + 0.5 * d + rise, 0.5 * (length + np.roll(length, -1, axis=1)) + 0.125 * bend + along


def clearance(geometry: Geometry, tubes: Tubes) -> Floats:
    """Return the distance (n, 4) [m] from which on hits of rays count that leave points of curved patches: hollow ones
    lie behind the facets that rays meet."""
    clear, rows = np.zeros((len(tubes), 4)), np.flatnonzero(geometry.curved[tubes.facet])
    facet = tubes.facet[rows]
    normal, lit = geometry.normal[facet], tubes.normals[rows, CENTRE]
    bulge = -0.25 * np.einsum("nec,nc->ne", geometry.edge_curvature[facet], normal)
    depth = (-bulge * np.sign(np.einsum("nc,nc->n", normal, lit))[:, None]).max(axis=1)
    slope = np.abs(np.einsum("nc,nc->n", normal, tubes.k[rows, CENTRE]))
    clear[rows] = (_CLEAR * np.maximum(depth, 0.0) / np.maximum(slope, _STEEP))[:, None]
    return clear


def slices(columns: tuple[Any, ...], rows: slice) -> Any:
    """Return the same named tuple of columns, of some rows."""
    return type(columns)(*(x[rows] for x in columns))


def unit(v: Floats) -> Floats:
    """Return vectors (..., 3) scaled to length one; zero vectors stay as they are."""
    size = sizes(v)[..., None]
    return v / np.where(size > 0.0, size, 1.0)
