"""Radar cross-section of a body by itself: the tubes and fields of a scene, refined until two launches agree."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from raychan.channel.error import COVER, LARGEST_DB, MAX_ERROR_DB, stated_error
from raychan.channel.mesh_error import MeshError, creeping, mesh_error
from raychan.channel.terminator_error import terminator_error
from raychan.channel.transfer import transfer
from raychan.poses import direction, theta_phi
from raychan.run.first_surface import first_surface
from raychan.run.single_body import facets_of, mesh_of
from raychan.tracing.contributions import Contributions
from raychan.tracing.legs import Leg
from raychan.tracing.shooting import tube_routes
from raychan.tracing.tubes import Refinement, Tubes
from raychan.units import C0
from raychan.world.body import MeshLike
from raychan.world.creases import readings
from raychan.world.geometry import Geometry
from raychan.world.limits import BOUNCES, CREASE, FREQUENCY, LENGTH, TOLERANCE_DB
from raychan.world.material import Material
from raychan.world.point_in_body import refuse_within

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_POLARIZATIONS = {"VV": (0, 0), "VH": (0, 1), "HV": (1, 0), "HH": (1, 1)}
_STEPS = 12  # halvings of the phase: rays run out before
_FIRST_EDGE = 0.1  # m: parts of cars that hide others are of this size, and a larger tube may miss them
_EDGE_ALONE = 0.3  # m: the same where nothing is hidden; a larger tube may bend more than its integral follows
_RAYS = 200.0  # of two launches over a flat body, about, for an area of max_edge squared
_COVER_ALONE = 1.05  # the same where a body hides nothing of itself, so that launches cannot both miss it
_CURVED = 0.01  # of the value a radian of a rule's `phase`: what launches over the same curved facets all miss
_TERMINATOR = 0.25  # of 1 / k: what light's sudden end leaves a sphere of any radius in physical optics, not in Mie
_TUBES = 30_000  # a launch may always cut, if max_rays allow
_NULL = 1e-4  # of the strongest polarisation: -80 dB
_GROWTH = 2.6  # rays of the next refinement over those of all before it, about


@dataclass(frozen=True)
class Rcs:
    """Radar cross-sections: `sigma` [m^2], `error_db` stated error, NaN where the launches tell nothing, `rays` cast
    and most `bounces` that counted, `further_db` what a bounce beyond max_bounces would change if it brought as much as
    the last allowed one (an estimate, not in error_db; 0 for a convex body, NaN where max_bounces is 1 and it is not
    convex), each of the shape of the angles given; `amplitude` of that shape and (2, 2) [m],
    the scattering matrix, rows the receiver's V, H, columns the transmitter's: sigma = 4 pi |amplitude|^2."""

    sigma: Floats
    error_db: Floats
    rays: NDArray[np.int64]
    bounces: NDArray[np.int64]
    amplitude: Complexes
    further_db: Floats

    @property
    def converged(self) -> NDArray[np.bool_]:
        """Whether the launches agree by enough for the stated error to be a figure."""
        return np.isfinite(self.error_db)


def rcs(
    mesh: MeshLike,
    frequency: float,
    azimuth_deg: ArrayLike,
    elevation_deg: ArrayLike = 0.0,
    polarization: str = "VV",
    distance: float = np.inf,
    material: str | Material = "pec",
    tolerance_db: float = 0.25,
    max_bounces: int = 3,
    rx_azimuth_deg: ArrayLike | None = None,
    rx_elevation_deg: ArrayLike | None = None,
    rx_distance: float | None = None,
    max_rays: int = 1_000_000,
    crease_deg: float | None = None,
) -> Rcs:
    """Return the RCS and scattering matrix of a mesh, monostatic unless a receiver's direction is given, near or far.

    Args: mesh trimesh, Mesh or file; frequency [Hz]; angles [deg] from the target to the radar in its frame, which
    broadcast; polarization receive then transmit (V theta-hat, H phi-hat); distance [m] from the origin, inf for
    plane waves; tolerance_db [dB] wanted; rx_* the receiver's; max_rays an angle, about; folds under crease_deg [deg]
    are smooth (None: 20, or as the Mesh was made), unless the mesh knows its normals. A near value is that of the
    point target at the origin that would return as much: 4 pi D^4 |E_s|^2 for unit field at 1 m.
    Raises: ValueError for arguments out of range. Source: Knott, Shaeffer, Tuley, Radar Cross Section, 2004, ch. 5.
    """
    _check(frequency, polarization, distance, tolerance_db, max_bounces, crease_deg)
    bistatic = rx_azimuth_deg is not None or rx_elevation_deg is not None or rx_distance is not None
    if rx_distance is not None and not (rx_distance > 0.0 and np.isinf(rx_distance) == np.isinf(distance)):
        raise ValueError(f"rx_distance = {rx_distance!r} m: must be above 0, and inf where distance is")
    rx_az = azimuth_deg if rx_azimuth_deg is None else rx_azimuth_deg
    rx_el = elevation_deg if rx_elevation_deg is None else rx_elevation_deg
    angles = np.broadcast_arrays(
        *(np.radians(np.asarray(a, float)) for a in (azimuth_deg, elevation_deg, rx_az, rx_el))
    )
    if not all(np.isfinite(a).all() for a in angles):
        raise ValueError("angles must be finite numbers of degrees")
    body = mesh_of(mesh, crease_deg)
    geometry = Geometry(facets_of(body, material, frequency))
    doubt = mesh_error(geometry, readings(body), 2.0 * np.pi * frequency / C0)
    row, col = _POLARIZATIONS[polarization.upper()]
    out, matrix = np.zeros((5, angles[0].size)), np.zeros((angles[0].size, 2, 2), complex)
    for i, (az, el, raz, rel) in enumerate(zip(*(a.ravel() for a in angles), strict=True)):
        leg = _leg(direction(az, el), distance)
        back = _leg(direction(raz, rel), distance if rx_distance is None else rx_distance) if bistatic else leg
        for end in (leg, back):
            if not end.far:
                refuse_within(geometry.facets.vertices, end.end, "radar")
        *out[:, i], matrix[i] = _refined(
            geometry, doubt, leg, back, frequency, max_bounces, tolerance_db, max_rays, row, col
        )
    shape = angles[0].shape
    sigma, error, rays, bounces, further = (o.reshape(shape) for o in out)
    return Rcs(sigma, error, rays.astype(np.int64), bounces.astype(np.int64), matrix.reshape(*shape, 2, 2), further)


def refinements(
    geometry: Geometry, frequency: float, steps: int = _STEPS, max_rays: float = np.inf
) -> Iterator[Refinement]:
    """Yield ever finer rules; the lattice of cuts differs from one to the next, and every step cuts most facets
    again. The first two keep to max_rays, about, where curvature and edges allow."""
    edge = _first_edge(geometry) * _stretch(geometry, max_rays)
    own = _typical_edge(geometry)
    for i in range(steps):
        fine = 2.0**-i
        longest = edge if i == 0 else min(edge, 1.35 * own) * 0.6**i
        yield Refinement(
            wavenumber=2.0 * np.pi * frequency / C0,
            phase=0.2 * fine,
            turn=0.3 * fine,
            relative=0.03 * fine,
            max_edge=longest,
            jitter=0.0 if i % 2 == 0 else 0.13,
        )


def _first_edge(geometry: Geometry) -> float:
    """Return the longest edge [m] of tubes at first."""
    return min(_EDGE_ALONE if geometry.convex_alone else _FIRST_EDGE, geometry.extent / 4.0)


def _stretch(geometry: Geometry, max_rays: float) -> float:
    """Return how many times longer than usual the first tubes are, so that max_rays do."""
    edge = _first_edge(geometry)
    return max(1.0, float(np.sqrt(_RAYS * geometry.area.sum() / max_rays)) / edge) if edge > 0.0 else 1.0


def _typical_edge(geometry: Geometry) -> float:
    """Return the median over the surface's area of its facets' longest edges [m]."""
    v = geometry.facets.vertices
    longest = np.linalg.norm(np.roll(v, -1, axis=1) - v, axis=2).max(axis=1)
    order = np.argsort(longest)
    covered = np.cumsum(geometry.area[order])
    return float(longest[order][np.searchsorted(covered, 0.5 * covered[-1])])


def scattering(geometry: Geometry, leg: Leg, out: Leg, frequency: float, bounces: int, rule: Refinement) -> Complexes:
    """Return the scattering amplitudes (bounces, 2, 2) [m] by number of bounces; sigma = 4 pi |sum|^2.

    Rows are the receiver's V, H and columns the transmitter's; V, H are theta-hat, phi-hat of the direction that each
    end looks to. Point ends are scaled to their distances from the origin.
    """
    every = np.ones(len(geometry.piece_role), bool)
    total = np.zeros((bounces, 2, 2), complex)

    def first(tubes: Tubes, found: Contributions) -> None:
        total[0] += first_surface(geometry, leg, out, tubes, found, frequency, _basis)

    for routes in tube_routes(geometry, leg, [out], every, rule, bounces, first=None if out == leg else first):
        count = int((routes.kind[0] != 0).sum()) - int((routes.kind[0] == 2).sum())
        total[min(count, bounces) - 1] += transfer(routes, geometry.facets, frequency, _basis, _basis).sum(axis=0)
    reach = 1.0 if leg.far else float(np.linalg.norm(leg.end))
    reach *= 1.0 if out.far else float(np.linalg.norm(out.end))
    total *= 4.0 * np.pi * frequency / C0 * reach
    return total


def _refined(
    geometry: Geometry,
    doubt: MeshError,
    leg: Leg,
    out: Leg,
    frequency: float,
    bounces: int,
    tolerance_db: float,
    max_rays: int,
    row: int,
    col: int,
) -> tuple[float, float, int, int, float, Complexes]:
    """Return (sigma, error in dB, rays, bounces, further in dB, matrix), refining until the last two launches agree or
    rays run out."""
    before, first = None, 0j
    rays, off, value, by_bounce = geometry.rays + doubt.rays, np.inf, 0j, np.zeros(bounces, complex)
    curved = _CURVED if geometry.curved.any() else 0.0
    # A body without edges ends in the dark along one ring, all of which may return in phase.
    ring = 0.0
    if geometry.convex_alone and curved and not geometry.smooth.any():
        k = 2.0 * np.pi * frequency / C0
        ring = _TERMINATOR / k + (
            terminator_error(float(geometry.area.sum()), leg.end, out.end, k, row, col) if out != leg else 0.0
        )
    cover = _COVER_ALONE if geometry.convex_alone else COVER
    # Long tubes may miss the same in two launches.
    cover *= np.sqrt(_stretch(geometry, max_rays))
    rules = [
        replace(step, max_tubes=_most_tubes(i, max_rays), max_rays=max_rays)
        for i, step in enumerate(refinements(geometry, frequency, max_rays=max_rays))
    ]
    for rule in rules:
        coarse, so_far = geometry.uncut, geometry.rays
        s = _both_ways(geometry, leg, out, frequency, bounces, rule)
        by_bounce = s[:, row, col]
        value = complex(by_bounce.sum())
        if geometry.uncut > coarse and geometry.rays - so_far > max_rays:
            # What hides what was not found out: nobody knows by how much that is off.
            off = np.inf
            break
        if before is None:
            first = value
        else:
            change = abs(value - before)
            shared = curved * rule.phase * abs(value) + ring
            off = cover * (change + shared)
            spent = (geometry.rays + doubt.rays - rays) * _GROWTH > max_rays
            # In a null of this polarisation nothing is left to find.
            null = change < _NULL * np.abs(s.sum(axis=0)).max()
            agreed = stated_error(value, off, 1.0) <= tolerance_db or null
            # Two launches may miss the same in tubes that their number alone kept from being cut.
            if spent or (geometry.uncut == coarse and agreed):
                break
        before = value

    def other(mesh: Geometry) -> complex:
        return complex(_both_ways(mesh, leg, out, frequency, bounces, rules[0])[:, row, col].sum())

    # What no refinement mends: what the mesh leaves open, and waves that creep around the body. Launches and normals
    # miss of the same bright spots, in phase at worst; other waves and other readings know nothing of that phase and
    # add in squares.
    around, share = creeping(doubt.rounded or geometry, rules[0].wavenumber)
    sure = value != 0.0 and stated_error(value, off, 1.0) <= LARGEST_DB
    # Where the launches tell nothing, another reading of the mesh adds nothing.
    off += doubt.facets(first, value, other) * abs(value) if sure else 0.0
    error_db = stated_error(value, math.hypot(off, max(around if ring else 0.0, share * abs(value))), 1.0)
    # How far apart two readings are is a figure, however far.
    folds_db = doubt.edges_db(first, value, other) if sure else 0.0
    counted = np.flatnonzero(np.abs(by_bounce) > 1e-3 * np.abs(by_bounce).max(initial=0.0))
    # Nothing has no level to be off by.
    known = min(math.hypot(error_db, folds_db), MAX_ERROR_DB) if sure and error_db <= LARGEST_DB else np.nan
    cast = geometry.rays + doubt.rays - rays
    most, further = int(counted.max(initial=-1)) + 1, _further(geometry, by_bounce)
    return 4.0 * np.pi * abs(value) ** 2, known, cast, most, further, s.sum(axis=0)


def _further(geometry: Geometry, by_bounce: Complexes) -> float:
    """Return by how much [dB] a level would change if one more bounce brought as much as the last of those given."""
    if geometry.convex_alone:
        return 0.0
    whole = abs(by_bounce.sum())
    return np.nan if len(by_bounce) == 1 or not whole else float(20.0 * np.log10(1.0 + abs(by_bounce[-1]) / whole))


def _most_tubes(step: int, max_rays: int) -> int:
    """Return how many tubes a launch may cut: of the first two, a quarter of what later ones may, so that a body whose
    every tube needs many rays does not spend all at once."""
    later = max(1000, max_rays // 4)
    return later if step > 1 else max(later // 4, min(later, _TUBES))


def _both_ways(geometry: Geometry, leg: Leg, out: Leg, frequency: float, bounces: int, rule: Refinement) -> Complexes:
    """Return scattering amplitudes (bounces, 2, 2) [m] of one launch, reciprocal by construction."""
    s = scattering(geometry, leg, out, frequency, bounces, rule)
    if out != leg:
        # Over several bounces physical optics prefers the last surface; the mean of both ways is reciprocal.
        s = 0.5 * (s + scattering(geometry, out, leg, frequency, bounces, rule).transpose(0, 2, 1))
    return s


def _leg(look: Floats, distance: float) -> Leg:
    return Leg(end=look, far=True) if np.isinf(distance) else Leg(end=look * distance)


def _basis(look: Floats) -> Complexes:
    return np.stack(theta_phi(look), axis=1).astype(np.complex128)


def _check(
    frequency: float, polarization: str, distance: float, tolerance_db: float, bounces: int, crease_deg: float | None
) -> None:
    FREQUENCY.check("frequency", frequency)
    if polarization.upper() not in _POLARIZATIONS:
        raise ValueError(f"polarization = {polarization!r}: must be one of {', '.join(_POLARIZATIONS)}")
    if distance != np.inf:
        LENGTH.check("distance", distance)
    TOLERANCE_DB.check("tolerance_db", tolerance_db)
    BOUNCES.check("max_bounces", bounces, whole=True)
    if crease_deg is not None:
        CREASE.check("crease_deg", crease_deg)
