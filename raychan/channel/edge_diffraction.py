"""What routes over wedges carry for a radar, by the uniform theory of diffraction."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raychan.channel.ends import RadarEnds, at_start, paths_record, rx_fields, swept_by
from raychan.em.diffraction import diffract
from raychan.em.fresnel import coefficients
from raychan.records import DiffractedRoutes, Facets, Paths
from raychan.units import C0

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


def diffracted_paths(routes: DiffractedRoutes, facets: Facets, radar: RadarEnds, frequency: float) -> Paths:
    """Return what diffracted routes carry for a radar; frequency as for `paths_of`.

    Source: Kouyoumjian and Pathak 1974, eqs. 17 to 25; a point target scatters by the root of its RCS over 4 pi.
    """
    k = 2.0 * np.pi * (frequency + swept_by(radar)) / C0
    n = len(routes.kind)
    ends = rx_fields(radar)
    received = {name: np.zeros(n, complex) for name in ("amplitude", "cross")[: len(ends)]}
    for r in range(n):
        there = leg_field(_leg(routes, r, 0), facets, radar.tx_field, k)
        for out, rx_field in zip(received.values(), ends, strict=True):
            back = leg_field(_leg(routes, r, 1), facets, rx_field, k)
            out[r] = 0.5 / k * np.sqrt(routes.sigma[r] / (4.0 * np.pi)) * (there @ back)
    length = (routes.near + routes.far).sum(axis=1)
    back = np.exp((2j * np.pi * swept_by(radar) / C0 - facets.attenuation) * length)
    received = {name: x * back for name, x in received.items()}
    rate = np.array([_length_rate(routes, r, facets, np.asarray(radar.velocity)) for r in range(n)])
    return paths_record(radar).of(
        **at_start(facets, radar, {"length": length, **received, "length_rate": rate}),
        departure=routes.leaves[:, 0],
        arrival=routes.leaves[:, 1],
        body=routes.body,
        part=routes.part,
        kind=routes.kind,
        vertices=routes.vertices.astype(np.float32),
        body_names=facets.body_names,
        part_names=facets.part_names,
        tx=routes.end,
        rx=routes.end,
    )


class Leg(NamedTuple):
    """One leg of a diffracted route: the columns of `DiffractedRoutes` of that name."""

    near: float
    far: float
    leaves: Floats
    arrives: Floats
    faces: Any
    edge: Floats
    normals: Floats
    wedge_n: float


def leg_field(leg: Leg, facets: Facets, field_of: Callable[[Floats], Any], k: float) -> Complexes:
    """Return the field (3,) at the target per unit wave [1/m] that an antenna sends over one leg, phase in.

    Args: field_of unit directions (n, 3) -> antenna vectors (n, 3); k wavenumber [rad/m].
    """
    e: Complexes = np.asarray(field_of(leg.leaves[None]))[0] / leg.near * np.exp(-1j * k * leg.near)
    if leg.faces[0] < 0:
        return e
    field: Any = tuple(complex(x) for x in e)
    r_0, r_n = (_reflection(leg, facets, which, k) for which in (0, 1))
    vectors = (tuple(x) for x in (leg.leaves, leg.arrives, leg.edge, leg.normals[0]))
    vector = diffract(field, *vectors, float(leg.wedge_n), k, leg.near, leg.far, r_0, r_n)
    return np.array(vector) * np.exp(-1j * k * leg.far)


def _leg(routes: DiffractedRoutes, row: int, which: int) -> Leg:
    return Leg(*(getattr(routes, name)[row, which] for name in Leg._fields))


def _reflection(leg: Leg, facets: Facets, which: int, k: float) -> tuple[complex, complex]:
    """Return (R_s, R_p) of face 0 or n of a wedge, at the steeper of the two angles to its normal."""
    m, of = facets.materials, facets.material[leg.faces[which]]
    normal = leg.normals[which]
    cosine = max(abs(float(leg.leaves @ normal)), abs(float(leg.arrives @ normal)))
    c = coefficients(m.kind[of], complex(m.eps[of]), m.thickness[of], m.roughness[of], cosine, k)
    return c[0], c[1]


def _length_rate(routes: DiffractedRoutes, row: int, facets: Facets, own: Floats) -> float:
    """Return how fast [m/s] the whole length grows; own is the radar's velocity (3,)."""
    used = np.flatnonzero(routes.kind[row])
    stops = [routes.end, *routes.vertices[row, used], routes.end]
    bodies = routes.body[row, used]
    target = [np.array_equal(v, routes.target[row]) for v in routes.vertices[row, used]]
    speeds = [routes.target_velocity[row] if t else facets.velocity[b] for t, b in zip(target, bodies, strict=True)]
    speed = [own, *speeds, own]
    steps = [(b - a) / np.linalg.norm(b - a) for a, b in pairwise(stops)]
    return sum(float((speed[j + 1] - speed[j]) @ d) for j, d in enumerate(steps))
