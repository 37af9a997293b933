"""Radar cross-section of a body by itself, by the tubes and fields that scenes use, with its stated error."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from raychan.blas import on_one_blas_thread
from raychan.channel.mesh_error import mesh_error
from raychan.poses import direction
from raychan.radar.declared import check_type, reals
from raychan.run.cross_section.case import Case, Value
from raychan.run.cross_section.refinement import refined
from raychan.run.cross_section.single_body import facets_of, mesh_of
from raychan.scalars import plain, shown
from raychan.tracing.legs import Leg
from raychan.units import C0
from raychan.world.body import MeshLike
from raychan.world.geometry import Geometry
from raychan.world.limits import BOUNCES, CREASE, FREQUENCY, LENGTH, RAYS, TOLERANCE_DB
from raychan.world.material import Material
from raychan.world.point_in_body import nearest_on, refuse_within, within
from raychan.world.simplified import traced_alone

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_POLARIZATIONS = {"VV": (0, 0), "VH": (0, 1), "HV": (1, 0), "HH": (1, 1)}


@dataclass(frozen=True)
class Rcs:
    """Radar cross-sections; each field is of the shape (...) of the angles given."""

    sigma: Floats
    """[m^2]"""
    error_db: Floats
    """Stated error [dB]; NaN where the launches do not agree well enough to state one, or the mesh leaves it open."""
    numerical_db: Floats
    """The part of it [dB] that more rays reduce, NaN where they did not suffice to state it; the mesh and physical
    optics leave the rest open."""
    rays: NDArray[np.int64]
    """Rays cast."""
    bounces: NDArray[np.int64]
    """Most bounces that counted."""
    amplitude: Complexes
    """Scattering matrix (..., 2, 2) [m], rows receive V, H, columns transmit: sigma = 4 pi |amplitude|^2."""
    further_db: Floats
    """Change [dB] by a bounce beyond max_bounces, an estimate that is not in error_db: what one brings as much as the
    last allowed one, where that is within the tolerance, else what a coarse launch finds; 0 for a convex body, NaN
    where max_bounces is 1 and the body is not convex."""
    edges_db: Floats
    """Change [dB] that fringe fields of edges may bring, which physical optics leaves out: an estimate for perfect
    conductors that is not in error_db; 0 without edges, NaN where they may bring as much as the rest."""
    too_near: NDArray[np.bool_]
    """Whether an end is within a wavelength of the body: near fields, which rays do not carry, then change the level
    beyond what is stated."""

    merged: str = ""
    """What was merged of a finely tessellated mesh: '327,680 facets merged into 7,956, deviation 0.24 um'."""

    @property
    def converged(self) -> NDArray[np.bool_]:
        """Whether the stated error is a figure."""
        return np.isfinite(self.error_db)


@on_one_blas_thread
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
    simplify: bool = True,
) -> Rcs:
    """Return the RCS and scattering matrix of a mesh, in the near or far field, monostatic or bistatic.

    Args: mesh trimesh, Mesh or file; frequency [Hz]; angles [deg] from the target to the radar in the target's frame,
    which broadcast; polarization receive then transmit (V, H of a wave that leaves the antenna); distance [m] from the
    origin, inf for plane waves; tolerance_db [dB] wanted; rx_* of the receiver, where it is elsewhere; max_rays an
    angle, about; folds under crease_deg [deg] are smooth and others edges, unless the mesh knows its normals (None: 20,
    or as the Mesh was made, and the error includes that this is a guess); simplify finely tessellated smooth surfaces,
    as near to them as the tolerance asks for.
    A near-field value is that of the point target at the origin that returns as much: 4 pi D^4 |E_s|^2 for unit field
    at 1 m. Raises: ValueError for arguments out of range.
    Source: Knott, Shaeffer, Tuley, Radar Cross Section, 2004, ch. 5.
    """
    frequency, polarization = FREQUENCY.check("frequency", frequency), _polarizations(polarization)
    distance, rx_distance = _distances(distance, rx_distance)
    tolerance_db = TOLERANCE_DB.check("tolerance_db", tolerance_db)
    max_bounces = BOUNCES.check("max_bounces", max_bounces, whole=True)
    crease_deg = None if crease_deg is None else CREASE.check("crease_deg", crease_deg)
    check_type("material", material, str, Material)
    check_type("simplify", simplify, bool)
    bistatic = rx_azimuth_deg is not None or rx_elevation_deg is not None or rx_distance is not None
    rx_az = azimuth_deg if rx_azimuth_deg is None else rx_azimuth_deg
    rx_el = elevation_deg if rx_elevation_deg is None else rx_elevation_deg
    max_rays = RAYS.check("max_rays", max_rays, whole=True)
    angles = _angles(azimuth_deg=azimuth_deg, elevation_deg=elevation_deg, rx_azimuth_deg=rx_az, rx_elevation_deg=rx_el)
    k = 2.0 * np.pi * frequency / C0
    body = traced_alone(mesh_of(mesh, crease_deg), k, tolerance_db if simplify else None, crease_deg is not None)
    topology = [body.mesh.topology] if body.merged else []
    geometry = Geometry(facets_of(body.mesh, material, frequency), topology, merged=body.merged)
    other = mesh_error(geometry, body.alternatives, k)
    if crease_deg is not None:
        # The caller's word on what is an edge; the default is a guess.
        other = replace(other, creased=None, rounded=None, rounded_halved=None)
    row, col = _POLARIZATIONS[polarization]
    found, near = [], []
    for az, el, raz, rel in zip(*(a.ravel() for a in angles), strict=True):
        leg = _leg(direction(az, el), distance)
        out = _leg(direction(raz, rel), distance if rx_distance is None else rx_distance) if bistatic else leg
        _outside(geometry, leg, "distance")
        _outside(geometry, out, "distance" if rx_distance is None else "rx_distance")
        near.append(_within(geometry, C0 / frequency, leg, out))
        found.append(refined(Case(geometry, other, leg, out, frequency, max_bounces, tolerance_db, max_rays, row, col)))
    return _collected(found, near, angles[0].shape, str(body.merged or ""))


def _angles(**given: ArrayLike) -> list[Floats]:
    """Return angles [rad] of the same shape. Raises: ValueError where there are none, or their shapes do not fit."""
    each = [np.radians(reals(name, a)) for name, a in given.items()]
    for name, a in zip(given, each, strict=True):
        if not (a.size and np.isfinite(a).all()):
            raise ValueError(f"{name} = {given[name]!r}: finite numbers of degrees are wanted, one at least")
    try:
        return list(np.broadcast_arrays(*each))
    except ValueError:
        shapes = ", ".join(dict.fromkeys(str(a.shape) for a in each))
        raise ValueError(f"angles of shapes {shapes}: must be of one shape, or single numbers") from None


def _collected(found: list[Value], near: list[bool], shape: tuple[int, ...], merged: str) -> Rcs:
    """Return the cross-sections of all angles in their shape."""

    def column(name: str, kind: type) -> Any:
        return np.array([getattr(one, name) for one in found], kind).reshape(shape)

    return Rcs(
        sigma=column("sigma", float),
        error_db=column("error_db", float),
        numerical_db=column("numerical_db", float),
        rays=column("rays", np.int64),
        bounces=column("bounces", np.int64),
        amplitude=np.array([one.matrix for one in found], complex).reshape(*shape, 2, 2),
        further_db=column("further_db", float),
        edges_db=column("edges_db", float),
        too_near=np.array(near, bool).reshape(shape),
        merged=merged,
    )


def _leg(look: Floats, distance: float) -> Leg:
    """Return the straight leg to an end in a direction (3,), at a distance [m] or infinitely far."""
    return Leg(end=look, far=True) if np.isinf(distance) else Leg(end=look * distance)


def _outside(geometry: Geometry, leg: Leg, name: str) -> None:
    """Raise ValueError that names the distance by which an end is within the body or on it."""
    if not leg.far:
        far = float(np.linalg.norm(leg.end))
        refuse_within(geometry.facets.vertices, leg.end, f"{name} = {far:g} m: the radar")


def _within(geometry: Geometry, wavelength: float, *legs: Leg) -> bool:
    """Return whether the end of a leg is nearer to the body than a wavelength [m]."""
    v = geometry.facets.vertices
    box = np.array([v.min(axis=(0, 1)) - wavelength, v.max(axis=(0, 1)) + wavelength])
    ends = [leg.end for leg in legs if not leg.far and within(box, leg.end)]
    return any(float(np.linalg.norm(nearest_on(v, x) - x)) < wavelength for x in ends)


def _polarizations(given: object) -> str:
    """Return the polarisations of receiver and transmitter. Raises: ValueError where they are none."""
    if not (isinstance(given, str) and given.upper() in _POLARIZATIONS):
        raise ValueError(f"polarization = {shown(given)}: must be one of {', '.join(_POLARIZATIONS)}")
    return given.upper()


def _distances(distance: object, rx_distance: object) -> tuple[float, float | None]:
    """Return the distances [m] of transmitter and receiver, the latter None where it is the same. Raises: ValueError
    where one is none, or where one alone is infinite."""
    sent = _distance("distance", distance)
    if rx_distance is None:
        return sent, None
    heard = _distance("rx_distance", rx_distance)
    if np.isinf(heard) != np.isinf(sent):
        raise ValueError(f"rx_distance = {heard!r} m: must be inf where distance is, and only there")
    return sent, heard


def _distance(name: str, given: object) -> float:
    """Return a distance [m], perhaps inf. Raises: ValueError where it is none."""
    far = plain(given)
    return np.inf if isinstance(far, float) and far == np.inf else float(LENGTH.check(name, given))
