"""The methods of the trade-off study, each a function (case, effort) -> Run: its result, rays and seconds.

Seconds count from the mesh to the result: building Embree's tree is included, reading the mesh is not.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from raychan.poses import direction
from raychan.run.cross_section.refinement import refinements
from raychan.run.cross_section.scattering import scattering
from raychan.run.cross_section.single_body import facets_of
from raychan.run.rcs import rcs
from raychan.study.cases import FREQUENCY, WAVENUMBER, Target, vertical
from raychan.study.ray_lattice import Window, echoes
from raychan.study.specular_points import specular_points
from raychan.tracing.legs import Leg
from raychan.world.geometry import Geometry
from raychan.world.meshes.mesh import Mesh
from raychan.world.ray_caster import RayCaster

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

POINT, UNIFORM, ADAPTIVE, MIRRORS, POINTS = (
    "point-sampled rays", "uniform tubes", "adaptive tubes (ours)", "mirror paths only", "targets as points",
)  # fmt: skip
METHODS = (ADAPTIVE, UNIFORM, POINT, MIRRORS, POINTS)
DEFAULT_TOLERANCE_DB = 0.25
"""The default of `raychan.rcs`."""
_MOST_POINTS = 2_000_000  # point samples a view, for targets that converge slowly: sphere and car


@dataclass(frozen=True)
class Run:
    """A result: `value`, RCS by view [m^2] or a map [W]; `rays` cast and `seconds` of wall time over all views."""

    value: Floats
    rays: float
    seconds: float


def lattice(target: Target, rays: int, tubes: bool) -> Run:
    """Return the RCS by rays on a lattice, with the phase constant over each ray or linear over its tube."""
    since = perf_counter()
    tracer = RayCaster(facets_of(target.fine, "pec", FREQUENCY))
    out = []
    for end in target.ends():
        window = Window.onto(end, target.fine.vertices, -end)
        found = echoes(
            tracer, window, [Leg(end=end)], vertical, vertical, FREQUENCY, rays, target.bounces, tubes
        )  # fmt: skip
        total = sum(e.amplitude.sum() for e in found)
        out.append(4.0 * np.pi * abs(total * (end @ end)) ** 2)
    return Run(np.array(out), tracer.rays, perf_counter() - since)


def adaptive(target: Target, tolerance_db: float) -> Run:
    """Return the RCS by `raychan.rcs`, refined until two launches agree within the tolerance [dB]."""
    since = perf_counter()
    a, e, d = target.views.T
    found = rcs(
        target.mesh, FREQUENCY, a, e, distance=float(d[0]), tolerance_db=tolerance_db, max_bounces=target.bounces
    )  # fmt: skip
    return Run(found.sigma, float(found.rays.sum()), perf_counter() - since)


def launched(target: Target, step: int) -> Run:
    """Return the RCS by one launch of adaptive tubes, by rule number `step` of `raychan.rcs`; it states no error."""
    since = perf_counter()
    geometry = Geometry(facets_of(target.mesh, "pec", FREQUENCY))
    rule = list(refinements(geometry, FREQUENCY))[step]
    out = []
    for end in target.ends():
        leg = Leg(end=end)
        s = scattering(geometry, leg, leg, FREQUENCY, target.bounces, rule)[:, 0, 0].sum()
        out.append(4.0 * np.pi * abs(s) ** 2)
    return Run(np.array(out), float(geometry.rays), perf_counter() - since)


def mirrors(target: Target, fine: int) -> Run:
    """Return the RCS by the specular points of single reflections, on the plain (0) or the fine (1) mesh."""
    since = perf_counter()
    tracer = RayCaster(facets_of(target.fine if fine else target.mesh, "pec", FREQUENCY))
    out = []
    for end in target.ends():
        total = specular_points(tracer, end, WAVENUMBER).field.sum()
        out.append(4.0 * np.pi * abs(total * (end @ end)) ** 2)
    return Run(np.array(out), max(float(tracer.rays), 1.0), perf_counter() - since)


def as_points(target: Target, aspects: int) -> Run:
    """Return the RCS of a point target that has the mean RCS over `aspects` directions, from a table made beforehand.

    Time and rays count its use only: a look-up and one visibility ray a view.
    """
    around = target.around_deg
    table = mean_rcs(target.mesh, aspects, float(target.views[0, 2]), target.bounces, around)
    since = perf_counter()
    value = np.array([table for _ in target.ends()])
    return Run(value, len(target.views), perf_counter() - since)


def mean_rcs(mesh: Mesh, aspects: int, distance: float, bounces: int, span_deg: float = 180.0, seed: int = 0) -> float:
    """Return the mean RCS [m^2] of a conducting mesh over random azimuths within +-span about +x, by uniform tubes."""
    rng = np.random.default_rng(seed)
    tracer = RayCaster(facets_of(mesh, "pec", FREQUENCY))
    found = []
    for azimuth in np.radians(rng.uniform(-span_deg, span_deg, aspects)):
        end = distance * direction(azimuth, 0.0)
        window = Window.onto(end, mesh.vertices, -end)
        parts = echoes(tracer, window, [Leg(end=end)], vertical, vertical, FREQUENCY, 20_000, bounces, True)
        found.append(4.0 * np.pi * abs(sum(e.amplitude.sum() for e in parts) * (end @ end)) ** 2)
    return float(np.mean(found))


@dataclass(frozen=True)
class Effort:
    """One setting of a method: its name, a label of the setting, whether it is the default, and how to run it."""

    method: str
    label: str
    default: bool
    run: Callable[[Target], Run]


def efforts(quick: bool, heavy: bool = False, hard: bool = False) -> list[Effort]:
    """Return all settings of all methods for a target: fewer if quick or if the target is heavy, more point samples if
    it is hard."""
    counts = (1_000, 16_000, 128_000) if quick else (1_000, 4_000, 16_000, 64_000, 256_000, 700_000)
    tolerances = (DEFAULT_TOLERANCE_DB,) if quick or heavy else (1.0, DEFAULT_TOLERANCE_DB, 0.1)
    made = []
    for step in range(2 if quick or heavy else 3):
        made.append(Effort(ADAPTIVE, f"launch {step + 1}", False, lambda case, step=step: launched(case, step)))  # type: ignore[misc]
    for t in tolerances:
        made.append(
            Effort(ADAPTIVE, f"{t:g} dB", t == DEFAULT_TOLERANCE_DB, lambda case, t=t: adaptive(case, t))  # type: ignore[misc]
        )
    for method, tubes in ((UNIFORM, True), (POINT, False)):
        for n in (*counts, _MOST_POINTS) if hard and not quick and not tubes else counts:
            made.append(Effort(method, f"{n} a view", False, lambda case, n=n, tubes=tubes: lattice(case, n, tubes)))  # type: ignore[misc]
    for i, mesh in enumerate(("plain mesh", "fine mesh")):
        made.append(Effort(MIRRORS, mesh, False, lambda case, i=i: mirrors(case, i)))  # type: ignore[misc]
    for n in (1, 4) if quick else (1, 4, 16):
        made.append(Effort(POINTS, f"{n} aspects", False, lambda case, n=n: as_points(case, n)))  # type: ignore[misc]
    return made
