"""Which bodies of a scene are traced by a simplified mesh, within which limits, and what that adds to the error."""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from raychan.geometry.collapses import Limits
from raychan.records import MIRROR
from raychan.units import C0
from raychan.world.body import Body
from raychan.world.meshes.creases import Alternatives, alternatives, uncertain_facets
from raychan.world.meshes.mesh import Mesh
from raychan.world.meshes.simplify import Simplified, simplify
from raychan.world.near_surfaces import near_surfaces
from raychan.world.scene_files.schema import Model

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

MANY = 20_000
"""Facets from which on a mesh is simplified: those of fewer cost little, and simulate as they are (not measured)."""
_SHARE = 0.1  # of the tolerance, as amplitude: trades what the simplified surface may add for its facets; not measured
_COARSEST_DB = 1.0  # tubes are no coarser for a larger tolerance (tracing.settings)
_TURN = 0.3  # rad: largest turn of the normal over a tube (tracing.settings)
_RAYLEIGH = 0.125  # wavelengths: a surface counts as smooth if it deviates by less
# Of that sagitta, what flat facets must keep off other surfaces, at four points of each: those that cross others are
# found where they cross by less (shells of 0.3 to 2 mm; command not noted).
_APART = 0.5
_RADIUS = 0.25  # of the size of a body, across its corners: the radius of curvature of what stands in its shadow
_TRIES = 3  # of meshes with surfaces near each other; not measured
_QUARTER = 0.25  # of turn times edge: the sagitta that it makes, at most


class Bodies(Protocol):
    """A scene of bodies (see world.scene.Scene)."""

    bodies: tuple[Body, ...]
    frequency: float
    model: Model
    _static: dict[Any, Any]


T = TypeVar("T", bound=Bodies)


@dataclass(frozen=True)
class Merged:
    """Facets that one or several bodies have, and those that are traced in their place; the deviation [m] of the
    surface; the two-way phase [rad] that it makes at most, and the share of an amplitude that moved shadows make."""

    before: int
    after: int
    deviation: float
    phase: float
    shadow: float

    def share(self, bounces: Any) -> Any:
        """Return by what share of it an amplitude of so many bounces may be off, each off by itself."""
        return np.sqrt(bounces * self.phase**2 + self.shadow**2)

    def __str__(self) -> str:
        return f"{self.before:,} facets merged into {self.after:,}, deviation {1e6 * self.deviation:.2g} um"


@dataclass(frozen=True)
class Traced:
    """The mesh that is traced in place of another, and other surfaces it may stand for; merged None where it is the
    same."""

    mesh: Mesh
    alternatives: Alternatives
    merged: Merged | None = None


def limits_of(wavenumber: float, tolerance_db: float, size: float) -> Limits:
    """Return how far a simplified surface may be off for a tolerance [dB], a wavenumber [rad/m] and a size of body [m].

    Each may change an amplitude by a tenth of the tolerance. A surface off by d changes the two-way phase by 2 k d. A
    normal off by e moves the point at which a ray is reflected by e times the radius of curvature r at most; the length
    of a path is stationary there, so that its phase changes by k r e^2. The flat facets say what hides what: a shadow
    line off by s through a bright spot changes its echo by s / sqrt(pi r / k), the width of its Fresnel integral.
    """
    share = _SHARE * (10.0 ** (min(tolerance_db, _COARSEST_DB) / 20.0) - 1.0)
    return Limits(
        deviation=share / (2.0 * wavenumber),
        normal=math.sqrt(share / (wavenumber * size)),
        sag=min(share * _spot(wavenumber, size), _rayleigh(wavenumber)),
        turn=_TURN,
    )


def _spot(wavenumber: float, size: float) -> float:
    """Return the width [m] of a bright spot, by a wavenumber [rad/m]: on a surface as curved as a body of that size
    [m]."""
    return math.sqrt(math.pi * _RADIUS * size / wavenumber)


def _rayleigh(wavenumber: float) -> float:
    """Return the deviation [m] up to which a surface counts as smooth."""
    return _RAYLEIGH * 2.0 * math.pi / wavenumber


def traced_mesh(mesh: Mesh, wavenumber: float, tolerance_db: float) -> Simplified | None:
    """Return the simplified mesh that is traced in place of a mesh, computed once for each tolerance [dB] and
    wavenumber [rad/m]; None where the mesh itself is: where it has few facets, or no more than its shape asks for."""
    return _kept(mesh, wavenumber, tolerance_db, None)


def traced_alone(mesh: Mesh, wavenumber: float, tolerance_db: float | None, told: bool = False) -> Traced:
    """Return the mesh that is traced in place of that of a body by itself, and its alternatives; args as for
    `traced_mesh`, but for a tolerance of None, where no mesh is simplified; told as for `alternatives`."""
    found = alternatives(mesh, told)
    coarse = None if tolerance_db is None else _kept(mesh, wavenumber, tolerance_db, found, told)
    if coarse is None:
        return Traced(mesh, found)

    def taken(normals: Floats | None) -> Floats | None:
        return None if normals is None else normals.reshape(-1, 3)[coarse.corner]

    fitted = taken(found.fitted)
    if fitted is not None:
        # Where facets were merged the surface is held by the vertices that went: another fit changes nothing.
        fitted[coarse.merged] = coarse.mesh.normals[coarse.merged]
        fitted = None if np.array_equal(fitted, coarse.mesh.normals) else fitted
    regular = None if found.regular is None else found.regular[coarse.corner[:, 0] // 3]
    others = Alternatives(fitted, taken(found.creased), taken(found.rounded), regular, coarse.merged)
    return Traced(coarse.mesh, others, _merged([mesh], [coarse], wavenumber, True))


def traced_bodies(
    bodies: Sequence[Body], frequency: float, tolerance_db: float
) -> tuple[tuple[Body, ...], Merged | None]:
    """Return bodies with the meshes that are traced in place of theirs, for a frequency [Hz] and a tolerance [dB], and
    what was merged; None where the bodies are the same."""
    wavenumber = 2.0 * math.pi * frequency / C0
    # Image paths need the planes of a mirror as they are.
    found = [None if b.resolved_role == MIRROR else traced_mesh(b.geometry, wavenumber, tolerance_db) for b in bodies]
    out = tuple(b if m is None else _with(b, m.mesh) for b, m in zip(bodies, found, strict=True))
    return out, _merged([b.geometry for b in bodies], found, wavenumber)


def traced_scene(scene: T, tolerance_db: float | None) -> tuple[T, Merged | None]:
    """Return a scene whose bodies have the meshes that are traced in place of theirs, for a tolerance [dB] (None: the
    scene's), and what was merged: the same scene, and None, where nothing is, or where its model wants none."""
    if not scene.model.simplify:
        return scene, None
    tolerance = scene.model.tolerance_db if tolerance_db is None else tolerance_db
    bodies, merged = traced_bodies(scene.bodies, scene.frequency, tolerance)
    if merged is None:
        return scene, None
    traced = copy(scene)
    traced.__dict__["bodies"] = bodies
    # As the scene's own, what is kept of bodies that do not move serves all instants.
    traced._static = scene._static.setdefault(f"simplified {tolerance}", {})
    return traced, merged


def _kept(
    mesh: Mesh, wavenumber: float, tolerance_db: float, found: Alternatives | None, told: bool = False
) -> Simplified | None:
    """Return the simplified mesh, kept with the mesh; found the other surfaces of a body by itself, `told` or not:
    facets that another fit of its normals moves by more than the deviation allowed stay."""
    if len(mesh.faces) < MANY:
        return None
    limits, alone = limits_of(wavenumber, tolerance_db, _size(mesh)), found is not None
    name = f"simplified {limits} {alone} {told}"
    if name not in mesh.memo:
        fixed = uncertain_facets(mesh)
        if found is not None and found.fitted is not None:
            fixed = fixed | (_QUARTER * _moved(mesh, found.fitted) > limits.deviation)
        # A convex body alone hides nothing.
        mesh.memo[name] = _apart(mesh, limits, fixed, _rayleigh(wavenumber) if alone else 0.0)
    simplified: Simplified | None = mesh.memo[name]
    return simplified


def _size(mesh: Mesh) -> float:
    """Return the size [m] of a mesh across its corners."""
    return float(np.linalg.norm(np.ptp(mesh.bounds, axis=0)))


def _apart(mesh: Mesh, limits: Limits, fixed: Bools, sag_alone: float) -> Simplified | None:
    """Return a simplified mesh whose flat facets keep off other surfaces: where one lies nearer to a facet than flat
    facets may lie under their curved ones, its facets stay as they are."""
    for _ in range(_TRIES):
        simple = simplify(mesh, limits, fixed, sag_alone)
        if simple is None:
            return None
        found, home = simple
        near = near_surfaces(found.mesh, _APART * found.sag) & found.merged
        if not near.any():
            return found
        fixed = fixed | near[home()]
    return None


def _moved(mesh: Mesh, fitted: Floats) -> Floats:
    """Return the largest turn of corner normals times the longest edge (f,) [m rad] of facets with other normals."""
    c = mesh.corners
    edge = np.linalg.norm(np.roll(c, -1, axis=1) - c, axis=2).max(axis=1)
    return np.asarray(np.linalg.norm(fitted - mesh.normals, axis=2).max(axis=1) * edge)


def _merged(
    meshes: Sequence[Mesh], found: Sequence[Simplified | None], wavenumber: float, alone: bool = False
) -> Merged | None:
    """Return what was merged of some meshes, or of one that is alone; None for nothing."""
    pairs = [(m, s) for m, s in zip(meshes, found, strict=True) if s is not None]
    if not pairs:
        return None
    before, after = (sum(len(m.faces) for m in x) for x in ([m for m, _ in pairs], [s.mesh for _, s in pairs]))
    deviation = max(s.deviation for _, s in pairs)
    shadow = max(0.0 if alone and s.mesh.topology.convex else s.sag / _spot(wavenumber, _size(m)) for m, s in pairs)
    return Merged(before, after, deviation, 2.0 * wavenumber * deviation, shadow)


def _with(body: Body, mesh: Mesh) -> Body:
    """Return the same body with another mesh."""
    other: Any = copy(body)
    other.__dict__["geometry"] = mesh
    traced: Body = other
    return traced
