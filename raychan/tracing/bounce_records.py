"""What kernels of a reflection read and write, as named tuples of columns."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raychan.geometry.intersect import FacetGroups, FacetShapes
from raychan.tracing.edge_crossings import TubeRays
from raychan.tracing.silhouette_crossings import Outlines, outlines_of
from raychan.tracing.subdivide import Patches
from raychan.tracing.tubes import TubeColumns
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]


class Surroundings(NamedTuple):
    """A geometry: groups and shapes of facets for rays; plane, smooth patch, curved, body, is_layer, lossy and material
    (f,) of facets; role (b,) of bodies; the materials; edges around planes as `edges_within` reads them; outlines."""

    groups: FacetGroups
    shapes: FacetShapes
    plane: Ints
    smooth: Ints
    curved: Bools
    body: NDArray[np.integer[Any]]
    is_layer: Bools
    lossy: Bools
    material: Ints
    role: NDArray[np.int8]
    materials: tuple[Any, ...]
    first_edge: NDArray[np.int64]
    plane_edges: Floats
    outlines: Outlines


def surroundings(geometry: Geometry) -> Surroundings:
    """Return what kernels need of a geometry."""
    f, g = geometry.facets, geometry
    return Surroundings(
        *g.ray_targets, g.plane, g.smooth, g.curved, f.body, g.is_layer, g.lossy, g.material_columns[0], f.role,
        g.material_columns[1], g.first_edge, g.plane_edges, outlines_of(g),
    )  # fmt: skip


class Rules(NamedTuple):
    """How tubes are reflected: patches lit over their leg; image (3,), far of the leg by which contributions are
    bounded; wavenumber [rad/m]; first, last whether they stand on their first surface, or land on their last; layers,
    levels, jitter, patch of the `Refinement`; by_landing whether tubes are cut by what they bring, all in phase, where
    they land; wide whether fans are not narrow; thresholds (c,) [1/m] of contributions for each `cell` [m] of length,
    and those of `specular` points (c,); max_cuts, max_rays."""

    patches: Patches
    image: Floats
    far: bool
    wavenumber: float
    first: bool
    last: bool
    layers: int
    levels: int
    jitter: float
    patch: float
    by_landing: bool
    wide: bool
    thresholds: Floats
    specular: Floats
    cell: float
    max_cuts: float
    max_rays: float


class Flight(NamedTuple):
    """Tubes between two surfaces: `start` (n, 4) [m] from which hits count, layers passed so far, `through` (n, l), and
    how often each tube was cut and passed a layer, `cuts`, `passed` (n,)."""

    tubes: TubeColumns
    start: Floats
    through: Ints
    cuts: NDArray[np.int8]
    passed: NDArray[np.int8]


class Met(NamedTuple):
    """What the rays of a flight met: rays; side (n, 3) [m] distances of corners from an edge that runs through a tube,
    zeros where none does; one_surface (n,) whether all rays land on one; wanted (n,) which are to be subdivided."""

    rays: TubeRays
    side: Floats
    one_surface: Bools
    wanted: Bools


class Landed(NamedTuple):
    """Tubes where they landed; vertex, normal (n, 3) and facet `left` (n,) of the reflection, layers passed since,
    `through` (n, l)."""

    tubes: TubeColumns
    vertex: Floats
    normal: Floats
    left: Ints
    through: Ints


def named(flight: Any, met: Any, landed: Any, count: int) -> tuple[Flight, Met, Landed, int]:
    """Return with names what compiled code returns as plain tuples."""
    flight, landed = (x(TubeColumns(*y[0]), *y[1:]) for x, y in ((Flight, flight), (Landed, landed)))
    return flight, Met(TubeRays(*met[0]), *met[1:]), landed, count


def nothing_met() -> Met:
    """Return what the rays of no tubes met."""
    none, point, flag = np.empty((0, 4)), np.empty((0, 4, 3)), np.empty(0, bool)
    return Met(TubeRays(point, point, none, flag, np.empty((0, 4), np.int32), none), np.empty((0, 3)), flag, flag)


def none_landed(like: TubeColumns, layers: int) -> Landed:
    """Return columns of no tubes, of the types of others."""
    tubes = TubeColumns(*(np.empty((0, *x.shape[1:]), x.dtype) for x in like))._replace(bary=np.empty((0, 0, 3)))
    nowhere = np.empty((0, 3))
    return Landed(tubes, nowhere, nowhere, np.empty(0, np.int32), np.empty((0, layers), np.int32))
