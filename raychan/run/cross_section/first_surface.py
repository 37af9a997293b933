"""Bistatic scattering of the first surface: the reflected wave of all lit facets, and the shadow radiation."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from raychan.channel.transfer import REFLECTED, SHADOW, FieldOf, transfer
from raychan.tracing.contributions import Contributions
from raychan.tracing.footprints import elements
from raychan.tracing.legs import Leg
from raychan.tracing.radiation import LIT
from raychan.tracing.routes import routes_of
from raychan.tracing.shooting import resolve_return_leg
from raychan.tracing.tubes import Tubes
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Ints = NDArray[np.int32]


def first_surface(
    geometry: Geometry, leg: Leg, out: Leg, tubes: Tubes, found: Contributions, frequency: float, basis: FieldOf
) -> Iterator[tuple[Ints, Complexes]]:
    """Yield the facets (n,) and gains (n, 2, 2) of tubes from their first surface to the end of `out`, as `transfer`
    computes them.

    Physical optics has currents on the lit surface that radiate in all directions, the sum of two parts: the reflected
    wave, which other bodies and parts of this one may block, and the shadow radiation, which cancels the incident wave
    behind the body. What stands there is in its shadow already, so the latter is never blocked.
    Source: Ufimtsev, Fundamentals of the Physical Theory of Diffraction, 2014, ch. 1.
    """
    seen, corners, passed = resolve_return_leg(geometry, leg, out, tubes, found, True, LIT)
    yield seen.facet, _radiated(geometry, leg, out, seen, (corners, passed), frequency, basis, REFLECTED)
    free = np.zeros((len(tubes), 0, 3)), np.full((len(tubes), 1), -1, np.int32)
    yield tubes.facet, _radiated(geometry, leg, out, tubes, free, frequency, basis, SHADOW)


def _radiated(
    geometry: Geometry, leg: Leg, out: Leg, tubes: Tubes, way: tuple[Floats, Ints], frequency: float,
    basis: FieldOf, wave: int,
) -> Complexes:  # fmt: skip
    """Return the gains (n, 2, 2) of one of the two parts over a return leg with its mirror points and layers."""
    if not len(tubes):
        return np.zeros((0, 2, 2), complex)
    area = np.empty((len(tubes), 4, 3))
    shape = geometry.facets.vertices, geometry.edge_curvature, geometry.curved, leg.image, out.image, out.far
    elements(tubes.points, tubes.normals, tubes.facet, tubes.bary, *shape, area)
    routes = routes_of(geometry, leg, out, tubes, True, *way)
    return transfer(routes, geometry.facets, frequency, basis, basis, wave=wave, elements=area)
