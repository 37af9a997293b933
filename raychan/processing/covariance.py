"""Covariance of snapshots over the receivers, with averaging that tells coherent echoes apart.

Echoes in one cell of a map are fully coherent: one snapshot has rank one, however many they are. Sub-arrays of a
uniform array (spatial smoothing) and the array read backwards (forward-backward averaging) restore the rank.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.radar.aperture import Aperture

Floats = NDArray[np.float64]
Complexes = NDArray[np.complexfloating[Any, Any]]

SUB_ARRAY = 2.0 / 3.0
"""Sub-array rows over the array's: longer ones are finer, shorter ones tell more coherent echoes apart (not measured;
Hua and Sarkar 1990 find a third to two thirds best)."""


@dataclass(frozen=True, eq=False)
class Covariance:
    """A covariance matrix and the aperture that it belongs to."""

    matrix: Complexes
    """(p, p), p the elements of `aperture`."""
    aperture: Aperture
    snapshots: int
    """How many were averaged, sub-arrays counted, backward ones not."""
    backward: bool
    """Whether the array was read backwards too."""

    @property
    def eigen(self) -> tuple[Floats, Complexes]:
        """Eigenvalues (p,), greatest first, and eigenvectors (p, p) in columns."""
        values, vectors = np.linalg.eigh(self.matrix)
        return values[::-1], vectors[:, ::-1]


def covariance(snapshots: Complexes, aperture: Aperture, smoothing: float | None = None) -> Covariance:
    """Return the covariance of snapshots (n, a), averaged forwards and backwards where the array is symmetric.

    Args: smoothing, rows of a sub-array over those of the array (1: none); None takes SUB_ARRAY for fewer snapshots
    than elements, where they fill a line or rectangle, else 1 (`doa` smooths coherent waves of more, too).
    Source: Shan, Wax and Kailath 1985 (smoothing); Pillai and Kwon 1989 (forward-backward).
    """
    if smoothing is None:
        smoothing = SUB_ARRAY if aperture.table is not None and len(snapshots) < snapshots.shape[1] else 1.0
    if not 0.0 < smoothing <= 1.0:
        raise ValueError(f"smoothing = {smoothing!r}: must lie between 0 and 1")
    rows = [np.arange(snapshots.shape[1])]
    if smoothing < 1.0:
        if aperture.table is None:
            raise ValueError("smoothing: the elements must be a uniform line or rectangle")
        size = [max(1, int(np.ceil(smoothing * n - 1e-9))) for n in aperture.table.shape]
        starts = np.ndindex(*(n - m + 1 for n, m in zip(aperture.table.shape, size, strict=True)))
        rows = [aperture.table[i : i + size[0], k : k + size[1]].ravel() for i, k in starts]
    axes = aperture.scans if sum(aperture.scans) == 1 else None  # a short part of a line is one, too
    part = Aperture(aperture.elements[rows[0]], aperture.wavelength, axes) if smoothing < 1.0 else aperture
    data = np.concatenate([snapshots[:, index] for index in rows])
    matrix = data.T @ data.conj() / len(data)
    turned = mirrored(part)
    if turned is not None:
        matrix = 0.5 * (matrix + matrix.conj()[np.ix_(turned, turned)])
    return Covariance(matrix, part, len(data), turned is not None)


def mirrored(aperture: Aperture) -> NDArray[np.int64] | None:
    """Return the element (a,) opposite to each about the array's centre; None where the array is not symmetric."""
    elements = aperture.elements
    opposite = elements.min(axis=0) + elements.max(axis=0) - elements
    apart = np.linalg.norm(opposite[:, None] - elements[None], axis=2)
    found = apart.argmin(axis=1)
    fits = apart[np.arange(len(found)), found].max() <= 1e-3 * aperture.wavelength
    return found if fits and len(np.unique(found)) == len(found) else None
