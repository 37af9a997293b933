"""What a mesh leaves open and physical optics cannot know, as parts of a cross-section's stated error."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.columns import take
from raychan.world.creases import Readings
from raychan.world.geometry import Geometry
from raychan.world.halving import cubic_off, halved

Floats = NDArray[np.float64]

# The factors were chosen on the shapes of tests/truth/shapes.py of seed 1; the test judges on another.
_FITS = 2.0  # of what the other fit of normals changes: both miss alike in part
_FACETS = 0.005  # of the value: what the quadratic patches behind facets miss although their normals are right
_HALVED = 4.0 / 3.0  # of what halving the facets changes: the rest of a series that halves on with second order
_CUBIC = 0.01  # rad: where the cubic edges of facets are nearer to the quadratic ones, both are the same
_EDGES_DB = 1.2  # of what the doubtful folds as edges change, in dB
_PARTLY = 0.5  # of the field's change: where some of the folds are edges, and not the others
_CREEPING = 2.3  # of x^(4/3) exp(-2.2 x^(1/3)) / k: the creeping wave of a sphere of k a = x, at the most
_RESONANCE = 6.0  # k a under which that falls again, but not what physical optics is off by


@dataclass(frozen=True)
class MeshError:
    """Surfaces that a mesh may stand for beside the one taken: by another fit of its normals, with edges for doubtful
    folds, with smooth folds for doubtful edges, and of facets halved along cubic edges."""

    fitted: Geometry | None
    creased: Geometry | None
    rounded: Geometry | None
    halved: Geometry | None

    @property
    def rays(self) -> int:
        """Rays cast on them so far."""
        return sum(s.rays for s in (self.fitted, self.creased, self.rounded, self.halved) if s is not None)

    def facets(self, first: complex, value: complex, of: Callable[[Geometry], complex]) -> float:
        """Return how far off an amplitude may be, as a share of it, because normals are estimated and facets coarse.

        Args: first the amplitude of the surface taken, by the first launch, value by the last; of returns that of
        another by the first.
        """
        if not (first and value):
            return 0.0
        off = 0.0 if self.fitted is None else _FITS * abs(of(self.fitted) - first) / abs(first) + _FACETS
        # Facets of another size share no tubes with the first launch, so that the better one tells more.
        return off + (0.0 if self.halved is None else _HALVED * abs(of(self.halved) - value) / abs(value))

    def edges_db(self, first: complex, value: complex, of: Callable[[Geometry], complex]) -> float:
        """Return how far off a level [dB] may be because doubtful folds are edges, or the other way round; value by the
        last launch."""
        if not (first and value):
            return 0.0
        said = [0.0]
        for geometry in (self.creased, self.rounded):
            if geometry is None:
                continue
            other = of(geometry)
            partly = 20.0 * np.log10(1.0 + _PARTLY * abs(other - first) / abs(first))
            apart = max(abs(20.0 * np.log10(max(abs(other), 1e-300) / abs(a))) for a in (first, value))
            said += [partly, _EDGES_DB * apart]
        return float(max(said))


def mesh_error(geometry: Geometry, found: Readings, wavenumber: float) -> MeshError:
    """Return the other surfaces of a body by itself, given the readings of its mesh."""
    facets = geometry.facets
    other = (found.fitted, found.creased, found.rounded)
    fitted, creased, rounded = (None if n is None else Geometry(facets.replace(normals=n)) for n in other)
    return MeshError(fitted, creased, rounded, _halved(geometry, found, wavenumber))


def _halved(geometry: Geometry, found: Readings, wavenumber: float) -> Geometry | None:
    """Return the surface of facets halved, None where that is the same; what is in doubt by its folds is left out."""
    facets = geometry.facets
    certain = geometry.curved.copy()
    for normals in (found.creased, found.rounded):
        if normals is not None:
            certain &= (normals == facets.normals).all(axis=(1, 2))
    off = cubic_off(facets.vertices[certain], facets.normals[certain], geometry.edge_curvature[certain])
    if 2.0 * wavenumber * off.max(initial=0.0) < _CUBIC:
        return None
    v, n = halved(facets.vertices, facets.normals)
    every = np.tile(np.arange(len(facets.vertices)), 4)
    # Middles of the edges of a saddle lie inside, by less than its facets are off: they hide nothing more.
    return Geometry(take(facets, every).replace(vertices=v, normals=n), finer_of=geometry)


def creeping(geometry: Geometry, wavenumber: float) -> tuple[float, float]:
    """Return what waves creeping around a body change of its amplitude: at most [m] and at most as a share of it.

    Both are those of the PEC sphere as wide as the body is at its thinnest, Mie's series less physical optics over
    k a = 0.3 to 300; infinite cylinders of both polarisations lie below it. Nothing is said of bodies without curved
    sides, which have no creeping wave, and of open sheets.
    Source: Bowman, Senior, Uslenghi, Electromagnetic and Acoustic Scattering by Simple Shapes, 1969, sec. 10.3.3.
    """
    if not geometry.curved.any() or geometry.both_sides.any():
        return 0.0, 0.0
    size = wavenumber * 0.5 * _thinnest(geometry)
    x = max(size, _RESONANCE)
    wave = _CREEPING * x ** (4.0 / 3.0) * np.exp(-2.2 * np.cbrt(x))
    return float(wave / wavenumber), float(2.0 * wave / max(size, 1e-300))


def _thinnest(geometry: Geometry) -> float:
    """Return the least extent [m] of a body along its principal axes."""
    v = geometry.facets.vertices
    centre = np.average(v.mean(axis=1), axis=0, weights=geometry.area)
    off = (v - centre).reshape(-1, 3)
    weight = np.repeat(geometry.area, 3)
    axes = np.linalg.eigh((off * weight[:, None]).T @ off)[1]
    return float(np.ptp(off @ axes, axis=0).min())
