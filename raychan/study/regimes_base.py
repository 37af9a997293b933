"""Records of the stability study, helpers that its regimes share, and closed forms for comparison."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.poses import direction
from raychan.records import Facets
from raychan.run.cross_section.refinement import refinements
from raychan.run.cross_section.scattering import scattering
from raychan.run.cross_section.single_body import facets_of
from raychan.tracing.legs import Leg
from raychan.units import C0
from raychan.world.geometry import Geometry
from raychan.world.meshes.mesh import Mesh, make_mesh

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

FREQUENCY = 77e9
LAMBDA = C0 / FREQUENCY
K = 2.0 * np.pi / LAMBDA


@dataclass(frozen=True)
class Row:
    """One check: `expected` (or, where `bound`, the most allowed), `seen` and `tolerance` in `unit`; `truth`, the
    source of the expected value; `note`, the cause of a failure or a remark."""

    name: str
    expected: float
    seen: float
    tolerance: float
    unit: str
    truth: str
    note: str = ""
    bound: bool = False

    @property
    def off(self) -> float:
        """Deviation [unit]; infinite where the value seen is not finite."""
        if not np.isfinite(self.seen):
            return float("inf")
        return max(0.0, self.seen - self.expected) if self.bound else abs(self.seen - self.expected)

    @property
    def share(self) -> float:
        """Deviation over tolerance: at most 1 where the check passed."""
        if self.bound and self.expected > 0.0 and np.isfinite(self.seen):
            return max(self.seen, 0.0) / self.expected
        if self.tolerance > 0.0:
            return self.off / self.tolerance
        return 0.0 if self.passed else float("inf")

    @property
    def passed(self) -> bool:
        """Whether the value seen is within the tolerance."""
        return self.off <= self.tolerance


@dataclass(frozen=True)
class Outcome:
    """Results of a regime: its rows, and arrays by name for the figures."""

    rows: list[Row]
    curves: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Regime:
    """A situation in which ray methods fail: `key` for options and files, `title` for reports, and the function `run`
    (quick) that returns its checks."""

    key: str
    title: str
    run: Callable[[bool], Outcome]


def at_most(name: str, seen: float, most: float, unit: str, truth: str, note: str = "") -> Row:
    """Return a row that passes while `seen` does not exceed `most`."""
    return Row(name, most, float(seen), 0.0, unit, truth, note, bound=True)


def same_db(name: str, seen: float, exact: float, tolerance: float, truth: str, note: str = "") -> Row:
    """Return a row on two powers (or cross-sections): their ratio in dB, 0 expected."""
    ratio = float(seen) / float(exact) if exact > 0.0 else float("nan")
    level = 10.0 * float(np.log10(ratio)) if ratio > 0.0 else float("nan")
    return Row(name, 0.0, level, tolerance, "dB", truth, note)


def amplitudes(
    geometry: Geometry,
    leg: Leg,
    out: Leg,
    step: int = 3,
    bounces: int = 3,
    jitter: float = 0.0,
    max_edge: float | None = None,
    only: int = 0,
) -> Complexes:
    """Return the scattering matrix (2, 2) [m] of one launch, all bounces added.

    Args: step of `refinements` (0 coarse to 5); jitter of the lattice of cuts; max_edge [m] of first tubes, if not
    that of the step; only: that number of bounces alone.
    """
    rule = list(refinements(geometry, FREQUENCY))[step]
    rule = replace(rule, jitter=jitter, max_edge=rule.max_edge if max_edge is None else max_edge)
    by_bounce = scattering(geometry, leg, out, FREQUENCY, bounces, rule)
    return np.asarray(by_bounce[only - 1] if only else by_bounce.sum(axis=0))


def geometry_of(mesh: Any, material: Any = "pec") -> Geometry:
    """Return the geometry of one body at the origin."""
    return Geometry(facets_of(mesh, material, FREQUENCY))


def far(azimuth_deg: float, elevation_deg: float = 0.0) -> Leg:
    """Return the leg of a plane wave from a direction [deg]."""
    return Leg(end=direction(np.radians(azimuth_deg), np.radians(elevation_deg)), far=True)


def moved(facets: Facets, turn: Floats, shift: Floats) -> Facets:
    """Return facets turned by a matrix (3, 3) about the origin, then shifted (3,) [m]."""
    turned: Facets = facets.replace(
        vertices=facets.vertices @ turn.T + shift, normals=facets.normals @ turn.T, origin=facets.origin + shift
    )
    return turned


def rectangle(corner: Any, u: Any, v: Any) -> tuple[Floats, NDArray[np.int64]]:
    """Return vertices and faces of a rectangle spanned by u, v [m], facing u x v."""
    c, a, b = (np.asarray(x, float) for x in (corner, u, v))
    return np.array([c, c + a, c + a + b, c + b]), np.array([[0, 1, 2], [0, 2, 3]])


def sheet(*pieces: tuple[Floats, NDArray[np.int64]], mend: bool = True) -> Mesh:
    """Return one mesh of several pieces (vertices, faces); `mend` checks their winding as for a file."""
    base, vertices, faces = 0, [], []
    for v, f in pieces:
        vertices.append(v)
        faces.append(f + base)
        base += len(v)
    all_v, all_f = np.concatenate(vertices), np.concatenate(faces)
    if mend:
        return make_mesh(all_v, all_f)
    c = all_v[all_f]
    n = np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0])
    n = n / np.linalg.norm(n, axis=1, keepdims=True)
    return make_mesh(all_v, all_f, normals=np.repeat(n[:, None], 3, axis=1))


def plate_far(width: float, height: float, azimuth_deg: float) -> float:
    """Return sigma [m2] of a conducting plate off broadside in azimuth (Balanis 2012, eq. 11-44)."""
    t = np.radians(azimuth_deg)
    cosine = 0.0 if azimuth_deg == 90.0 else float(np.cos(t))
    return float(4 * np.pi * (width * height * cosine / LAMBDA * np.sinc(K * width * np.sin(t) / np.pi)) ** 2)


def plate_near(width: float, height: float, distance: float) -> float:
    """Return sigma [m2] of a plate seen from `distance` [m] on its axis: quadrature of exp(-2jkr) cos / r^2.

    Physical optics (Balanis 2012, sec. 7.10), 4 pi D^4 |E|^2, by Gauss-Legendre panels of at most 2 cycles of phase.
    Raises: ArithmeticError unless two grids agree.
    """
    values = []
    for finer in (1.0, 1.4):
        nodes = []
        for edge in (width, height):
            cycles = 2.0 * (np.hypot(0.5 * edge, distance) - distance) / LAMBDA
            panels = int(np.ceil(finer * (1.5 * cycles + 0.5 * edge / distance + 2)))
            x, w = np.polynomial.legendre.leggauss(16)
            # Finer towards the rim, where the phase varies faster; r ds is even in s.
            start = np.sqrt(np.linspace(0.0, 1.0, panels + 1)) if cycles > 4 else np.linspace(0.0, 1.0, panels + 1)
            half = 0.5 * np.diff(start)[:, None]
            s = (start[:-1, None] + half * (1 + x)).ravel() * 0.5 * edge
            nodes.append((s, (half * w).ravel() * edge))
        (y, wy), (z, wz) = nodes
        total = 0j
        for i in range(0, len(y), 256):
            r = np.sqrt(y[i : i + 256, None] ** 2 + z**2 + distance**2)
            total += np.sum(wy[i : i + 256, None] * wz * distance / r**3 * np.exp(-2j * K * (r - distance)))
        values.append(K / (2 * np.pi) * total)
    if abs(values[0] - values[1]) > 1e-5 * abs(values[1]):
        raise ArithmeticError("the reference quadrature has not converged")
    return float(4 * np.pi * distance**4 * abs(values[1]) ** 2)
