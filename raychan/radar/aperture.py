"""The receivers as an aperture: which angles they measure, how finely, and where grating lobes make them ambiguous.

A direction is given by its cosines (u, w) along the antenna's y and z: u = cos(elevation) sin(azimuth), w =
sin(elevation). A plane wave from there has the phase 2 pi / wavelength times (element . direction) at an element.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.radar.lobes import Lobes, of_places, on_rectangle
from raychan.radar.measured import SAME, beam_width, common_pitch, measured

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Complexes = NDArray[np.complexfloating[Any, Any]]

_EDGE = 1e-9
ALIKE = 1e-4
"""Of a beam's power: lobes that lose less are as strong, however weak the noise; places within SAME lose 4e-5."""
SAME_EDGE = 1e-6
"""Of a squared cosine: +90 and -90 deg are one to elements half a wavelength apart."""
_KEPT = 1 << 21  # steering values kept between searches, 32 MB; more are made anew each time


@dataclass(frozen=True, eq=False)
class Grid:
    """Directions on a grid along y and z."""

    u: Floats
    """Cosines (m,) along y."""
    w: Floats
    """Cosines (n,) along z."""
    visible: NDArray[np.bool_]
    """Which of (m, n) are directions of real waves."""
    wraps: tuple[bool, bool]
    """Whether the grid spans a whole period of grating lobes along y and z."""

    @cached_property
    def points(self) -> Floats:
        """Cosines (g, 2) of the visible directions."""
        u, w = np.meshgrid(self.u, self.w, indexing="ij")
        return np.stack([u[self.visible], w[self.visible]], axis=1)

    @property
    def step(self) -> Floats:
        """Distance (2,) of neighbours; 0 along an axis of one point."""
        return np.array([x[1] - x[0] if len(x) > 1 else 0.0 for x in (self.u, self.w)])


@dataclass(frozen=True, eq=False)
class Aperture:
    """Elements (a, 3) [m] in the antenna's frame, at a wavelength [m].

    A line along y measures azimuth (elevation 0 is assumed), a line along z elevation, a slanted line that of the
    nearer axis; elements that spread along y and z, not on one line, measure both; others measure nothing. Directions
    are taken ahead of the antenna. With depth (along x) and one angle all beams are of elevation, or azimuth, 0, and
    fit no wave from elsewhere. A part of an array may be told which cosines the whole measures, `axes`.
    """

    elements: Floats
    wavelength: float
    axes: tuple[bool, bool] | None = None

    def __post_init__(self) -> None:
        elements = np.asarray(self.elements, np.float64)
        if elements.ndim != 2 or elements.shape[1] != 3 or not len(elements):
            raise ValueError(f"elements: numbers of shape (a, 3) wanted, {elements.shape} given")
        if not (np.isfinite(elements).all() and np.isfinite(self.wavelength) and self.wavelength > 0.0):
            raise ValueError("elements and wavelength: finite numbers, the wavelength positive")
        object.__setattr__(self, "elements", elements)

    @cached_property
    def scans(self) -> tuple[bool, bool]:
        """Whether the cosine along y, and that along z, is measured."""
        return measured(self.elements, self.wavelength) if self.axes is None else self.axes

    @cached_property
    def places(self) -> Floats:
        """Places (a, 2) [m] along y and z from the first of each; 0 along an axis whose cosine is not measured."""
        return (self.elements[:, 1:] - self.elements[:, 1:].min(axis=0)) * self.scans

    @cached_property
    def index(self) -> Ints:
        """Place (a, 2) of each element on the lattice along y and z."""
        return np.rint(self.places / np.where(self.pitch > 0.0, self.pitch, 1.0)).astype(np.int64)

    @cached_property
    def pitch(self) -> Floats:
        """Lattice spacing (2,) [m] along y and z: the greatest of which all spacings are multiples; 0 for one row."""
        return np.array([common_pitch(x, SAME * self.wavelength) for x in self.places.T])

    @cached_property
    def period(self) -> Floats:
        """Distance (2,) of grating lobes in the cosines along y and z: wavelength / pitch (Van Trees 2002, 2.4)."""
        return np.divide(self.wavelength, self.pitch, out=np.full(2, np.inf), where=self.pitch > 0.0)

    @cached_property
    def wraps(self) -> tuple[bool, bool]:
        """Whether directions repeat by grating lobes, at the edges too, along y and z: not where depth loses more."""
        deep = (2.0 * np.pi / self.wavelength) ** 2 * float(self.elements[:, 0].var()) > ALIKE
        y, z = (
            scanned and period <= 2.0 * (1.0 + _EDGE) and not deep
            for scanned, period in zip(self.scans, self.period, strict=True)
        )
        return bool(y), bool(z)

    @cached_property
    def repeats(self) -> Floats:
        """Distance (2,) of directions quite alike in the cosines along y and z; infinite where there are none."""
        return np.where(self.wraps, self.period, np.inf)

    @cached_property
    def depth(self) -> float:
        """Extent along x, ahead [wavelengths]."""
        return float(np.ptp(self.elements[:, 0])) / self.wavelength

    @cached_property
    def deep(self) -> bool:
        """Whether beams near the edge of what is visible are narrow in the cosines: the cosine ahead falls by sqrt(2 s)
        over the last s of them, which turns the phase between front and back elements by more than a quarter of a
        turn where s is a quarter of a beam width."""
        return any(self.scans) and self.depth * float(np.sqrt(8.0 * self.beamwidth.min())) > 1.0

    @cached_property
    def beamwidth(self) -> Floats:
        """Distance (2,) of the first null from the peak of a beam, in cosines along y and z; infinite where they are
        not measured."""
        return np.array([beam_width(x, self.wavelength) for x in self.places.T])

    @cached_property
    def table(self) -> Ints | None:
        """Elements (ny, nz) by their place where they fill a rectangle on the lattice, else None."""
        size = self.index.max(axis=0) + 1
        flat = self.index[:, 0] * size[1] + self.index[:, 1]
        if np.prod(size) != len(flat) or len(np.unique(flat)) != len(flat) or not self.flat:
            return None
        out = np.empty(size, np.int64)
        out[self.index[:, 0], self.index[:, 1]] = np.arange(len(flat))
        return out

    @property
    def flat(self) -> bool:
        """Whether all elements stand in one plane across the look ahead."""
        return self.depth <= SAME

    @cached_property
    def lobes(self) -> Lobes:
        """Grating lobes of the elements, as if they were flat."""
        if self.table is not None:
            return on_rectangle(self.period, self.beamwidth)
        return of_places(self.places / self.wavelength, self.beamwidth)

    @cached_property
    def skewed(self) -> Floats:
        """Grating lobes (l, 2) quite like the main lobe and not a period along y or z away; none unless flat."""
        if not self.flat or self.table is not None or not any(self.scans):
            return np.zeros((0, 2))
        cell = self.repeats * (1.0 - SAME_EDGE)
        return self.lobes.at[(self.lobes.lost <= ALIKE) & (np.abs(self.lobes.at) < cell).all(axis=1)]

    @property
    def uniform(self) -> bool:
        """Whether the elements are a uniform line along y or z."""
        return self.table is not None and sum(self.scans) == 1

    def steering(self, cosines: Floats) -> Complexes:
        """Return the phasors (n, a) that plane waves from cosines (n, 2) have at the elements."""
        u, w = np.asarray(cosines, np.float64).T
        ahead = np.sqrt(np.maximum(1.0 - u**2 - w**2, 0.0))
        phase = np.stack([ahead, u, w], axis=1) @ self.elements.T
        return np.asarray(np.exp(2j * np.pi / self.wavelength * phase))

    def grid(self, per_beam: int) -> Grid:
        """Return directions, `per_beam` to a beam width, over what is visible or, if smaller, one period."""
        axes = []
        for scanned, wrap, width, period in zip(self.scans, self.wraps, self.beamwidth, self.period, strict=True):
            if not scanned:
                axes.append(np.zeros(1))
            elif wrap:
                n = max(2, int(np.ceil(per_beam * period / width - 1e-6)))
                axes.append((np.arange(n) - n // 2) * (period / n))
            else:
                axes.append(np.linspace(-1.0, 1.0, max(2, int(np.ceil(2.0 * per_beam / width))) + 1))
        inside = axes[0][:, None] ** 2 + axes[1][None, :] ** 2 <= 1.0 + _EDGE
        return Grid(axes[0], axes[1], inside, self.wraps)

    def spread(self, per_beam: int) -> Floats:
        """Return directions (g, 2) at equal angles of `per_beam` to a beam of the whole extent, deep or wide, over what
        is visible."""
        inverse = np.divide(1.0, self.beamwidth, out=np.zeros(2), where=np.array(self.scans))
        step = 1.0 / (per_beam * float(np.linalg.norm([self.depth, *inverse])))
        off = np.linspace(0.0, 0.5 * np.pi, int(np.ceil(0.5 * np.pi / step)) + 1)
        if not all(self.scans):
            sines = np.sin(np.concatenate([-off[:0:-1], off]))
            return np.outer(sines, self.scans)
        rings = []
        for sine in np.sin(off):
            count = max(1, int(np.ceil(2.0 * np.pi * sine / step)))
            turn = 2.0 * np.pi / count * np.arange(count)
            rings.append(sine * np.stack([np.cos(turn), np.sin(turn)], axis=1))
        return np.concatenate(rings)

    @cached_property
    def spreads(self) -> dict[int, tuple[Floats, Ints]]:
        """Directions (g, 2) of searches over `spread`, by its `per_beam`, and which (g, k) lie beside each."""
        return {}

    def moved(self, cosines: Floats, axis: int, by: Any) -> Floats:
        """Return cosines (n, 2) moved along an axis by distances (n,) or one for all: of a deep array by angles, in the
        plane that it scans, or, of both axes, from boresight (0) and round it (1)."""
        if not self.deep:
            out = np.array(cosines)
            out[:, axis] += by
            return out
        both, by = all(self.scans), np.asarray(by, float).reshape(-1, 1)
        size = np.linalg.norm(cosines, axis=1, keepdims=True) if both else cosines[:, axis, None]
        along = np.tile([1.0, 0.0] if both else np.eye(2)[axis], (len(cosines), 1))
        along = np.divide(cosines, size, out=along, where=size > 0.0) if both else along
        if both and axis == 1:
            aside = np.stack([-along[:, 1], along[:, 0]], axis=1)
            return np.asarray(cosines * np.cos(by) + aside * np.sin(by))
        # What would lead behind the antenna ends at its side.
        turned = np.clip(np.arcsin(np.clip(size, -1.0, 1.0)) + by, -0.5 * np.pi, 0.5 * np.pi)
        return np.asarray(along * np.sin(turned))

    def scanned(self, per_beam: int) -> Complexes | None:
        """Return the steering vectors (n, a) of the points of a grid, kept for other searches; None of so many that
        memory should not hold them."""
        if per_beam not in self._scanned:
            points = self.grid(per_beam).points
            small = len(points) * len(self.elements) <= _KEPT
            self._scanned[per_beam] = self.steering(points) if small else None
        return self._scanned[per_beam]

    @cached_property
    def _scanned(self) -> dict[int, Complexes | None]:
        return {}

    def canonical(self, cosines: Floats) -> Floats:
        """Return the aliases of cosines (n, 2) that are nearest to boresight."""
        out, period = np.array(cosines, np.float64), np.where(self.wraps, self.period, 1.0)
        if any(self.wraps):  # else it takes half of a search's time to no effect
            out -= np.where(self.wraps & (np.abs(out) > 0.5 * period), np.rint(out / period), 0.0) * period
        if not len(self.skewed):
            return out
        away, at = self._skewed_tree.query(out)
        beyond = away**2 < (out**2).sum(axis=-1) - SAME_EDGE  # of equal ones that which was given
        return np.where(beyond[..., None], out - self.skewed[at], out)

    @cached_property
    def _skewed_tree(self) -> Any:
        """The skewed lobes by their place: thousands, where few elements are wide in wavelengths."""
        from scipy.spatial import cKDTree  # takes long to import, and most arrays need none of it

        return cKDTree(self.skewed)

    def visible(self, cosines: Floats) -> Floats:
        """Return the directions of real waves that look like cosines (n, 2), or else the nearest at the edge.

        What a search finds beyond +90 deg may be a wave from the other side, a grating lobe away."""
        other = self.canonical(cosines)
        real = (other**2).sum(axis=1, keepdims=True) <= 1.0
        at = np.where(real, other, cosines)
        return np.asarray(at / np.maximum(np.linalg.norm(at, axis=1, keepdims=True), 1.0))

    def apart(self, one: Floats, other: Floats) -> Floats:
        """Return how far directions (..., 2) look apart, in beam widths: past +90 deg may lie -90 deg."""
        width = np.where(np.isfinite(self.beamwidth), self.beamwidth, 1.0)
        return np.asarray(np.linalg.norm(self.canonical(one - other) / width, axis=-1))

    def angles(self, cosines: Floats) -> tuple[Floats, Floats]:
        """Return azimuth and elevation (n,) [rad] of cosines (n, 2); NaN where the array does not measure them."""
        u, w = np.asarray(cosines, np.float64).reshape(-1, 2).T
        none = np.full(len(u), np.nan)
        elevation = np.arcsin(np.clip(w, -1.0, 1.0))
        level = np.sqrt(np.maximum(1.0 - w**2, 0.0))
        sine = np.divide(u, level, out=np.zeros(len(u)), where=level > 0.0)
        azimuth = np.arcsin(np.clip(sine, -1.0, 1.0))
        return azimuth if self.scans[0] else none, elevation if self.scans[1] else none


def cosines(azimuth: Any, elevation: Any = 0.0) -> Floats:
    """Return the cosines (n, 2) along y and z of azimuths and elevations (n,) [rad]."""
    az, el = np.broadcast_arrays(np.atleast_1d(np.asarray(azimuth, float)), np.asarray(elevation, float))
    return np.stack([np.cos(el) * np.sin(az), np.sin(el)], axis=1)
