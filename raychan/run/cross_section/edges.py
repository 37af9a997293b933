"""What fringe fields of a body's edges may bring to its cross-section beyond physical optics: an estimate."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.channel.error import LARGEST_DB, stated_error
from raychan.em.fringe import fringe
from raychan.tracing.legs import Leg
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Pair = tuple[int, int]

_LIFT = 1e-5  # of the body's extent: how far off an edge its shadow ray starts; above what single precision rounds


def edges_db(geometry: Geometry, ends: tuple[Leg, Leg], wavenumber: float, value: complex, heard: Pair) -> float:
    """Return by how much [dB] the fringe fields of a body's edges may change an amplitude; NaN: by more than it is.

    What the fields along the edges bring is summed with its phases, and so is what the magnetic fields along them do;
    both add in squares, for waves that go from edge to edge are left out. They may bring as much as that: of strips
    of 2 to 40 radians of width, by the method of moments, over 90 % lie within (`tests/run/test_rcs_edges.py`).
    Args: ends the legs to transmitter and receiver; wavenumber [1/m]; value the amplitude [m]; heard the polarisations
    of transmitter and receiver, 0 for V, 1 for H.
    """
    edges = geometry.wedge
    if not len(edges):
        return 0.0
    middle, span = edges.mean(axis=1), edges[:, 1] - edges[:, 0]
    looks, ways = zip(*(_towards(leg, middle) for leg in ends), strict=True)
    inward = _inward(geometry)
    angles = [_angle(geometry, inward, look) for look in looks]
    seen = np.all([_seen(geometry, inward, middle, look) for look in looks[: 1 if ends[0] is ends[1] else 2]], axis=0)
    along = wavenumber * np.einsum("ij,ij->i", span, looks[0] + looks[1]) / (2.0 * np.pi)
    length = np.linalg.norm(span, axis=1) / (2.0 * np.pi) * np.sinc(along) * seen
    wave = length * np.exp(1j * wavenumber * (ways[0] + ways[1]))
    # Physical optics is not the same both ways; of both ways the mean is taken, as of what bounces.
    parts = zip(*(fringe(geometry.wedge_n, *both) for both in (angles, angles[::-1])), strict=True)
    shares = zip(*(_along(span, look, which) for look, which in zip(looks, heard, strict=True)), strict=True)
    sums = [
        abs((0.5 * (one + other) * sent * back * wave).sum())
        for (one, other), (sent, back) in zip(parts, shares, strict=True)
    ]
    db = stated_error(value, float(np.hypot(*sums)), 1.0)
    return np.nan if value == 0.0 or db > LARGEST_DB else db


def _towards(leg: Leg, points: Floats) -> tuple[Floats, Floats]:
    """Return the directions (w, 3) from points to the end of a leg, and how much nearer [m] they are to it than the
    origin is."""
    if leg.far:
        return np.broadcast_to(leg.end, points.shape), points @ leg.end
    away = leg.end - points
    size = np.linalg.norm(away, axis=1)
    return away / size[:, None], float(np.linalg.norm(leg.end)) - size


def _along(span: Floats, look: Floats, which: int) -> tuple[Floats, Floats]:
    """Return which share (w,) of a field, and of its magnetic field, across a direction (w, 3) runs along the edges, of
    what may do so; which polarisation, 0 for V, 1 for H."""
    across = np.cross([0.0, 0.0, 1.0], look)
    size = np.linalg.norm(across, axis=1)
    # Straight above or below, any direction across is horizontal: y, as seen from azimuth 0.
    across = np.where((size > 1e-9)[:, None], across / np.maximum(size, 1e-9)[:, None], [0.0, 1.0, 0.0])
    both = np.cross(look, across), across
    edge = span / np.maximum(np.linalg.norm(span, axis=1), 1e-300)[:, None]
    share = [np.einsum("ij,ij->i", edge, axis) for axis in both]
    whole = np.maximum(np.hypot(*share), 1e-9)
    return share[which] / whole, share[1 - which] / whole


def _inward(geometry: Geometry) -> Floats:
    """Return the directions (w, 3) in which face 0 runs from the edges, across them."""
    face = geometry.wedge_facet[:, 0]
    edges, centre = geometry.wedge, geometry.facets.vertices[face].mean(axis=1)
    across = np.cross(geometry.normal[face], edges[:, 1] - edges[:, 0])
    across *= np.sign(np.einsum("ij,ij->i", centre - edges[:, 0], across))[:, None]
    return np.asarray(across / np.maximum(np.linalg.norm(across, axis=1), 1e-300)[:, None])


def _angle(geometry: Geometry, inward: Floats, look: Floats) -> Floats:
    """Return the angles (w,) of directions (w, 3) about the edges, from face 0 on through the outside [rad]."""
    normal = geometry.normal[geometry.wedge_facet[:, 0]]
    x, y = (np.einsum("ij,ij->i", look, axis) for axis in (inward, normal))
    return np.asarray(np.arctan2(y, x) % (2.0 * np.pi))


def _seen(geometry: Geometry, inward: Floats, middle: Floats, look: Floats) -> NDArray[np.bool_]:
    """Tell which edges (w,) nothing hides, by a ray from just off the middle of each along its direction (w, 3)."""
    if geometry.convex_alone:
        return np.ones(len(middle), bool)
    faces, off = geometry.wedge_facet, _LIFT * geometry.extent
    rim = faces[:, 0] == faces[:, 1]
    out = np.where(rim[:, None], -inward, geometry.normal[faces].mean(axis=1))
    hit, _ = geometry.cast(middle + off * out, np.ascontiguousarray(look), faces[:, 0], np.full(len(middle), off))
    return np.asarray(hit < 0)
