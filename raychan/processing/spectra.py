"""Spectra over direction (Bartlett, Capon, MUSIC) and their peaks.

Each spectrum rises with a Hermitian form a^H Q a of the steering vector a, a smooth function of direction: its maxima
are found on a grid and then between the points by parabolas.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from raychan.parallel import parallel_for
from raychan.processing.climb_kernels import ALONE, Beams, climb_beams, gains_beside, snapshots_for
from raychan.processing.covariance import Covariance
from raychan.processing.near_field import NearAperture
from raychan.processing.twins import alike, beam, nearest_boresight, neighbours
from raychan.radar.aperture import Aperture, Grid

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Complexes = NDArray[np.complexfloating[Any, Any]]


class Form(Protocol):
    """From steering vectors (n, a) to values (n,): greater is better."""

    @property
    def none(self) -> float:
        """Value of a direction from which no wave comes."""

    def __call__(self, steering: Complexes) -> Floats:
        """Return the values (n,)."""


PER_BEAM = 8
"""Grid points per beam width: maxima of MUSIC nearer than two points are one (not measured)."""
BEAMS_PER_BEAM = 4
"""The same of Bartlett's, whose maxima lie a beam width apart."""
_LOADING = 1e-9  # of the mean eigenvalue: keeps the inverse of a covariance without noise
_FEW_LOADING = 1e-2  # the same for fewer than 2 p snapshots (Reed, Mallett and Brennan 1974), whose least eigenvalues
# are chance: echoes 20 dB weaker than the strongest are lost (not measured)
_ONE = 0.02  # beam widths: twins, refined each by itself, are nearer (1/128 of a step, then a parabola)
_ON = 0.1  # of _ONE: the nearest twins lie on each other (not measured)
_STARTS = 64  # of climbs for each maximum sought, at most (not measured)
_BATCH = 1 << 21  # steering values at once, 32 MB
_KEPT = 1 << 18  # directions of a deep array that are kept from search to search, with those beside each, 23 MB
_FEWEST = 2000  # beams worth a second thread (not measured)
_SHRINKS = 7  # steps of the search between grid points, each half as wide: to 1/128 of a step, then by parabola
_WIDEST = 0.25  # cosine: the longest first step along the ridge of an array that is all but a line (not measured)


@dataclass(frozen=True, eq=False)
class Bartlett:
    """The power of a beam [W] over snapshots (n, a): |a^H x|^2 / a^2 (Van Trees 2002, section 6.7)."""

    snapshots: Complexes
    none: ClassVar[float] = 0.0

    def __call__(self, steering: Complexes) -> Floats:
        """Return the power (n,) of beams of steering vectors (n, a)."""
        return np.asarray(squared(steering.conj() @ self.snapshots.T).mean(axis=1) / steering.shape[1] ** 2)


@dataclass(frozen=True, eq=False)
class Beside:
    """The power that a wave explains beside others of orthonormal rows basis (k, a), which leave snapshots (n, a)."""

    snapshots: Complexes
    basis: Complexes
    none: ClassVar[float] = 0.0

    def __call__(self, steering: Complexes) -> Floats:
        """Return the power (n,) that waves of steering vectors (n, a) explain; 0 where others leave too little."""
        alone = steering.shape[1] - squared(steering @ self.basis.conj().T).sum(axis=1)
        power = squared(steering.conj() @ self.snapshots.T).sum(axis=1)
        return np.where(alone > ALONE * steering.shape[1], power / np.maximum(alone, 1e-300), 0.0)


@dataclass(frozen=True, eq=False)
class Capon:
    """Minus the inverse of the power that Capon's beam lets through (Capon 1969): -a^H R^-1 a [1/W]."""

    inverse: Complexes
    none: float

    def __call__(self, steering: Complexes) -> Floats:
        """Return the values (n,) of steering vectors (n, a)."""
        return np.asarray(-np.einsum("ni,ij,nj->n", steering.conj(), self.inverse, steering, optimize=True).real)


@dataclass(frozen=True, eq=False)
class Music:
    """Minus the share of the steering vector outside of a signal subspace (a, k) (Schmidt 1986, eq. 6)."""

    signal: Complexes
    none: ClassVar[float] = -1.0

    def __call__(self, steering: Complexes) -> Floats:
        """Return the values (n,) of steering vectors (n, a)."""
        # As 1 less the share in the signal subspace a source's own value would be rounding: the projection is taken.
        rest = steering - (steering @ self.signal.conj()) @ self.signal.T
        return np.asarray(-(rest.real**2 + rest.imag**2).sum(axis=1) / steering.shape[1])


def squared(wave: Complexes) -> Floats:
    """Return the power of complex values."""
    return np.asarray(wave.real**2 + wave.imag**2)


def capon(found: Covariance) -> Capon:
    """Return Capon's spectrum of a covariance, loaded so that it has an inverse."""
    size = len(found.matrix)
    share = _LOADING if found.snapshots >= 2 * size else _FEW_LOADING
    load = share * float(np.trace(found.matrix).real) / size
    inverse = np.linalg.inv(found.matrix + max(load, 1e-300) * np.eye(size))
    return Capon(inverse, -size * float(np.linalg.norm(inverse, 2)))


def music(found: Covariance, sources: int) -> Music:
    """Return the spectrum of MUSIC of a covariance and so many sources."""
    return Music(found.eigen[1][:, :sources])


def peaks(form: Form, aperture: Aperture, count: int, per_beam: int = PER_BEAM) -> Floats:
    """Return the cosines (k, 2) along y and z of at most `count` greatest maxima of a form, greatest first.

    Args: per_beam, grid points to a beam width."""
    if aperture.deep:
        return _deep_peaks(form, aperture, count, per_beam)
    grid = aperture.grid(per_beam)
    values = np.full(grid.visible.shape, -np.inf)
    values[grid.visible] = _over(form, aperture, grid, per_beam)
    modes = ["wrap" if wrap else "constant" for wrap in grid.wraps]
    top = (values >= maximum_filter(values, size=3, mode=modes, cval=-np.inf)) & np.isfinite(values)
    m, n = np.nonzero(top)
    start = np.stack([grid.u[m], grid.w[n]], axis=1)[_promising(values[m, n], form, aperture, count, per_beam)]
    found, heights = climb(form, aperture, start, grid)
    found = aperture.canonical(found[np.argsort(-heights, kind="stable")])
    # Along an oblique ridge points of the grid are greater than their neighbours, and climb to one maximum; so do
    # directions that look alike to a tilted array.
    return found[:count] if aperture.table is not None else _once(nearest_boresight(aperture, found), aperture, count)


def _over(form: Form, aperture: Aperture, grid: Grid, per_beam: int) -> Floats:
    """Return the values (g,) of a form over the points of an aperture's grid, `per_beam` to a beam width."""
    if (known := aperture.scanned(per_beam)) is not None:
        return form(known)
    return _at(form, aperture, grid.points)


def _at(form: Form, aperture: Aperture, at: Floats) -> Floats:
    """Return the values (g,) of a form towards cosines (g, 2)."""
    if not isinstance(form, Bartlett | Beside):
        batch = max(1, _BATCH // len(aperture.elements))
        return np.concatenate([form(aperture.steering(at[i : i + batch])) for i in range(0, len(at), batch)])
    rows, size = form.snapshots.shape
    basis = form.basis if isinstance(form, Beside) else np.zeros((0, size), complex)
    gains = explained_beside(form.snapshots[None], basis[None], aperture, at)[:, 0]
    return gains if isinstance(form, Beside) else gains / (rows * size)


def explained_beside(rests: Complexes, bases: Complexes, aperture: Aperture, at: Floats) -> Floats:
    """Return the power (g, s) that waves from cosines (g, 2) explain beside sets of others of orthonormal rows bases
    (s, k, a), which leave snapshots rests (s, n, a)."""
    out, at = np.empty((len(at), len(rests))), np.ascontiguousarray(at)
    beams = beams_of(aperture, aperture.grid(PER_BEAM))
    rests, bases = snapshots_for(rests), snapshots_for(bases)
    parallel_for(len(at), lambda rows: gains_beside(out[rows], at[rows], rests, bases, beams), _FEWEST)
    return out


def _promising(values: Floats, form: Form, aperture: Aperture, count: int, per_beam: int) -> Ints:
    """Return which maxima among points of a search, by their values, may have beside them the `count` greatest."""
    order = np.argsort(-values, kind="stable")
    # Each shows as often as its twins are visible; of one echo any of these will do.
    few = 2 * count * (alike(aperture) if count > 1 or aperture.flat else 1)
    if aperture.table is not None or len(order) <= few:  # side lobes of lines and rectangles are far lower
        return order[:few]
    least = form.none + (1.0 - between(aperture, per_beam)) * (values[order[count - 1]] - form.none)
    return order[: max(few, min(int((values >= least).sum()), _STARTS * count))]


def between(aperture: Aperture, per_beam: int) -> float:
    """Return the share of a wave's power that the nearest point of a search may lose, `per_beam` to a beam width."""
    if aperture.deep:
        around = aperture.elements - aperture.elements.mean(axis=0)
        step = beam(aperture) / per_beam * np.sqrt(0.5 if all(aperture.scans) else 0.25)
        off = step * np.linalg.eigh(around.T @ around)[1].T[-1:]
    else:
        step = np.where(np.isfinite(aperture.beamwidth), 0.5 / per_beam * aperture.beamwidth, 0.0)
        off = np.array([[0.0, step[0], step[1]], [0.0, step[0], -step[1]]])
    wave = np.exp(2j * np.pi / aperture.wavelength * aperture.elements @ off.T).mean(axis=0)
    return 1.0 - float(squared(wave).min())


def _once(found: Floats, aperture: Aperture, count: int) -> Floats:
    """Return the first `count` of directions (k, 2) that are not twins of one before."""
    kept: list[Floats] = []
    twin = np.zeros(len(found), bool)
    while len(found) and len(kept) < count:
        if not twin[0]:
            kept.append(found[0])
        apart = aperture.apart(found, found[0])
        twin |= apart < _ONE
        # What lies on it is the twin of no others: of thousands a few places are left.
        further = apart > _ON * _ONE
        found, twin = found[further], twin[further]
    return np.array(kept).reshape(-1, 2)


def _deep_peaks(form: Form, aperture: Aperture, count: int, per_beam: int) -> Floats:
    """Return what `peaks` does of an array so deep that near the edge a grid in the cosines is too coarse."""
    known = aperture.spreads.get(per_beam)
    if known is None:
        at = aperture.spread(per_beam)
        known = at, neighbours(aperture, at)
        if len(at) <= _KEPT:
            aperture.spreads[per_beam] = known
    at, beside = known
    values = _at(form, aperture, at)
    top = np.flatnonzero(values >= values[beside].max(axis=1))
    start = at[top[_promising(values[top], form, aperture, count, per_beam)]]
    found, heights = climb(form, aperture, start, aperture.grid(per_beam))
    return _once(nearest_boresight(aperture, found[np.argsort(-heights, kind="stable")]), aperture, count)


def climb(form: Form, aperture: Aperture, start: Floats, grid: Grid) -> tuple[Floats, Floats]:
    """Return the maxima (k, 2) next to grid points (k, 2), and the form's values (k,) there."""
    at, steps = np.array(start, float), steps_of(aperture, grid)
    if isinstance(form, Bartlett | Beside):
        best, (count, size) = np.empty(len(at)), form.snapshots.shape
        basis = form.basis if isinstance(form, Beside) else np.zeros((0, size), complex)
        climb_beams(at, best, snapshots_for(form.snapshots), snapshots_for(basis), beams_of(aperture, grid))
        return at, best if isinstance(form, Beside) else best / (count * size)
    best = form(aperture.steering(at))
    for _ in range(_SHRINKS):
        for axis in np.flatnonzero(steps.any(axis=1)):
            # Beyond the visible edge the form goes on as smoothly, or as it does at the other edge.
            beside = (_moved(aperture, at, int(axis), sign * steps[axis]) for sign in (-1.0, 1.0))
            below, above = (form(aperture.steering(aperture.canonical(x))) for x in beside)
            bend = below - 2.0 * best + above
            offset = np.divide(0.5 * (below - above), bend, out=np.sign(above - below), where=bend < 0.0)
            shift = np.clip(offset, -1.0, 1.0)[:, None] * steps[axis]
            tried = aperture.visible(_moved(aperture, at, int(axis), shift))
            value = form(aperture.steering(tried))
            better = value > best
            at, best = np.where(better[:, None], tried, at), np.where(better, value, best)
        steps = 0.5 * steps
    return at, best


def _moved(aperture: Aperture, at: Floats, axis: int, by: Floats) -> Floats:
    """Return cosines (n, 2) moved by distances (2,) or (n, 2), of a deep array as Aperture.moved does along an axis."""
    return aperture.moved(at, axis, by[..., axis]) if aperture.deep else at + by


def steps_of(aperture: Aperture, grid: Grid) -> Floats:
    """Return the first distances (2, 2) of a search from points of a grid, one along each of two axes; 0 along one that
    is not measured.

    Axes are those of the main lobe, oblique where the array lies obliquely: a ridge along neither y nor z ends a search
    along these."""
    if aperture.deep or aperture.table is not None or not all(aperture.scans):
        return np.diag(grid.step)
    places = aperture.elements[:, 1:] / aperture.wavelength
    spread, axes = np.linalg.eigh(np.cov(places.T, bias=True))
    # Of as many points to a beam width; a uniform line is sqrt(12) as long as its places deviate.
    share = float((grid.step / aperture.beamwidth).mean())
    length = np.minimum(share / np.sqrt(12.0 * np.maximum(spread, 1e-12)), _WIDEST)
    return np.ascontiguousarray(length[:, None] * axes.T)


def beams_of(aperture: Aperture, grid: Grid) -> Beams:
    """Return an array's beams as kernels take them, to search from points of a grid."""
    parts: tuple[Floats, ...] = (aperture.elements,)
    away = np.inf
    if isinstance(aperture, NearAperture):
        parts, away = aperture.parts, aperture.distance / aperture.wavelength
    skewed, steps = np.ascontiguousarray(aperture.skewed, np.float64), steps_of(aperture, grid)
    return Beams(
        np.stack(parts) / aperture.wavelength,
        away,
        aperture.repeats,
        skewed,
        steps,
        _SHRINKS,
        aperture.deep,
        all(aperture.scans),
    )
