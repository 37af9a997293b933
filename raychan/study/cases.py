"""Cases of the trade-off study: targets and a scene with reference values and their sources."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.poses import direction, theta_phi
from raychan.records import Facets
from raychan.run.cross_section.refinement import refinements
from raychan.run.cross_section.scattering import scattering
from raychan.run.cross_section.single_body import facets_of
from raychan.study.ray_lattice import Window, echoes
from raychan.tracing.legs import Leg
from raychan.units import C0
from raychan.world.geometry import Geometry
from raychan.world.meshes.mesh import Mesh
from raychan.world.ray_caster import RayCaster
from raychan.world.shapes import build

Floats = NDArray[np.float64]

FREQUENCY = 77e9
WAVENUMBER = 2.0 * np.pi * FREQUENCY / C0


@dataclass(frozen=True)
class Target:
    """A conducting body seen from several places: `views` (n, 3) azimuth and elevation [deg] and distance [m]; `fine`,
    a mesh fine enough for methods of flat facets; `truth` (n,) reference RCS [m^2] and its `source`."""

    name: str
    title: str
    mesh: Mesh
    fine: Mesh
    views: Floats
    bounces: int
    truth: Floats
    source: str
    around_deg: float = 45.0
    """Azimuths on either side of +x over which the mean RCS is taken."""
    heavy: bool = False
    """Whether a run takes so long that fewer settings are tried."""
    hard: bool = False
    """Whether point samples converge so slowly that more of them are tried."""
    truth_db: float = 0.05
    """Error of the reference [dB]."""

    def ends(self) -> Floats:
        """Return where the radar stands (n, 3) [m]."""
        return np.array([d * direction(np.radians(a), np.radians(e)) for a, e, d in self.views])


@dataclass(frozen=True)
class Street:
    """A scene file; its reference is the range-Doppler map of a converged run."""

    name: str
    title: str
    path: Path
    source: str
    tolerance_db: float
    truth_db: float = 0.0
    """Error of the reference [dB], known once it is computed."""


def plate() -> Target:
    """Square plate of 1.5 m in its near field at 12 m, broadside and turned; reference: quadrature."""
    mesh = build("plate", {"width": 1.5, "height": 1.5})
    views = np.array([[0.0, 0.0, 12.0], [1.3, 0.4, 12.0], [2.7, 1.1, 12.0]])
    truth = np.array([_plate_near(1.5, *v) for v in views])
    return Target(
        "plate",
        "plate 1.5 m at 12 m (near field)",
        mesh,
        mesh,
        views,
        1,
        truth,
        "quadrature of the plate",
        truth_db=0.01,
    )


def sphere() -> Target:
    """Sphere of 0.5 m radius at 12 m; reference: geometrical optics of a spherical wave, D from the centre."""
    mesh, fine = build("sphere", {"radius": 0.5}), build("sphere", {"radius": 0.5, "max_sag": 2e-5})
    views = np.array([[7.0, 3.0, 12.0], [33.0, 11.0, 12.0], [61.0, -8.0, 12.0]])
    truth = np.full(len(views), np.pi * 0.25 * (12.0 / 11.5) ** 2)
    return Target(
        "sphere",
        "sphere r 0.5 m at 12 m",
        mesh,
        fine,
        views,
        1,
        truth,
        "pi a^2 (D / (D - a))^2",
        hard=True,
        truth_db=0.02,
    )


def dihedral() -> Target:
    """Dihedral of 0.1 m on boresight, far field; reference: its aperture (Knott et al. 2004), and each face alone."""
    size = 0.1
    mesh = build("dihedral", {"size": size, "height": size})
    views = np.array([[0.0, 0.0, _FAR]])
    # Two bounces: an aperture of width sqrt(2) a and height b. One bounce, of opposite sign, off each face at 45 deg:
    # the integral of its currents along the face.
    turn = 1j * np.sqrt(2.0) * WAVENUMBER
    faces = np.sqrt(2.0) * size * (np.exp(turn * size) - 1.0) / turn
    amplitude = WAVENUMBER / (2.0 * np.pi) * (np.sqrt(2.0) * size**2 - faces)
    truth = np.full(1, 4.0 * np.pi * abs(amplitude) ** 2)
    source = "8 pi a^2 b^2 / lambda^2, and each face by itself"
    # At 1 km the wave is plane to this error.
    return Target("dihedral", "dihedral 0.1 m, boresight", mesh, mesh, views, 2, truth, source, truth_db=2e-4)


def trihedral() -> Target:
    """Triangular trihedral of 0.2 m on and off boresight; reference: converged uniform tubes, closed form on
    boresight."""
    mesh = build("trihedral", {"size": 0.2})
    views = np.array([[0.0, 0.0, _FAR], [7.0, 4.0, _FAR], [-11.0, 6.0, _FAR]])
    # The reference is another method than the one under test: about a million uniform tubes a view, on two lattices. A
    # test compares it with the closed form on boresight.
    facets = facets_of(mesh, "pec", FREQUENCY)
    ends = [direction(*np.radians(v[:2])) * v[2] for v in views]
    found = np.array([[_uniform(facets, end, n) for end in ends] for n in (600_000, 1_100_000)])
    truth = found.mean(axis=0)
    known = 0.5 * float(np.sqrt(np.mean((10.0 * np.log10(found[0] / found[1])) ** 2)))
    source = (
        f"uniform tubes, 0.6 and 1.1 million a view, {2.0 * known:.3f} dB apart; on boresight 4 pi a^4 / 3 lambda^2"
    )
    return Target(
        "trihedral", "trihedral 0.2 m, on and off boresight", mesh, mesh, views, 3, truth, source, truth_db=known
    )


def car(quick: bool = False) -> Target:
    """Parametric car at 12 m, all metal; reference: a converged run."""
    mesh, fine = build("car"), build("car", {"max_sag": 1e-4})
    views = np.array([[15.0, 0.0, 12.0], [70.0, 0.0, 12.0]])
    # Another lattice of cuts and a finer rule than the launches under test, which must not be their own reference.
    geometry = Geometry(facets_of(mesh, "pec", FREQUENCY))
    rules = [replace(r, jitter=0.21) for r in refinements(geometry, FREQUENCY)][0 if quick else 1 : 2 if quick else 3]
    found = []
    for rule in rules:
        legs = [Leg(end=direction(*np.radians(v[:2])) * v[2]) for v in views]
        s = [scattering(geometry, leg, leg, FREQUENCY, 3, rule)[:, 0, 0].sum() for leg in legs]
        found.append(4.0 * np.pi * np.abs(s) ** 2)
    known = float(np.sqrt(np.mean((10.0 * np.log10(found[0] / found[1])) ** 2)))
    source = f"adaptive tubes, finer and cut elsewhere; moved by {known:.2f} dB rms in its last refinement"
    return Target("car", "car at 12 m, 3 bounces", mesh, fine, views, 3, found[1], source, 180.0, True, True, known)


def urban(path: Path | None = None, quick: bool = False) -> Street:
    """Return the urban scene; reference: its map by a finer run on another lattice of cuts."""
    here = path or Path(__file__).parents[2] / "scenes" / "urban.toml"
    fine = 0.5 if quick else 0.2
    return Street("urban", "urban scene", here, f"tubes cut for {fine:g} dB, another lattice of cuts", fine)


_FAR = 1000.0  # m: a corner of 0.2 m sees a plane wave from here

TARGETS: dict[str, Callable[..., Any]] = {
    "plate": plate,
    "sphere": sphere,
    "dihedral": dihedral,
    "trihedral": trihedral,
    "car": car,
    "urban": urban,
}
"""Cases by name."""


def vertical(look: Floats) -> NDArray[np.complex128]:
    """Return theta-hat (n, 3) of directions (n, 3)."""
    return np.ascontiguousarray(theta_phi(look)[0], np.complex128)


def _uniform(facets: Facets, end: Floats, rays: int) -> float:
    """Return the RCS [m^2] of flat facets by uniform tubes from `end` (3,) [m], three bounces."""
    window = Window.onto(end, facets.vertices.reshape(-1, 3), -end)
    found = echoes(RayCaster(facets), window, [Leg(end=end)], vertical, vertical, FREQUENCY, rays, 3, True)
    return float(4.0 * np.pi * abs(sum(e.amplitude.sum() for e in found) * (end @ end)) ** 2)


def _plate_near(size: float, azimuth_deg: float, elevation_deg: float, distance: float) -> float:
    """Return the RCS [m^2] of a square plate facing +x by Gauss-Legendre quadrature of its currents 2 n x H_i."""
    end = distance * direction(np.radians(azimuth_deg), np.radians(elevation_deg))
    x, w = np.polynomial.legendre.leggauss(16)
    panels = 160
    s = ((np.arange(panels)[:, None] + 0.5 + 0.5 * x) / panels - 0.5).ravel() * size
    weight = np.tile(0.5 * w / panels, panels) * size
    total = 0j
    for y, wy in zip(s, weight, strict=True):
        r = np.sqrt(end[0] ** 2 + (end[1] - y) ** 2 + (end[2] - s) ** 2)
        total += wy * np.sum(weight * (end[0] / r) * (distance / r) ** 2 * np.exp(-2j * WAVENUMBER * (r - distance)))
    return float(4.0 * np.pi * abs(WAVENUMBER / (2.0 * np.pi) * total) ** 2)
