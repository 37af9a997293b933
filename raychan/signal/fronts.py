"""The spherical waves of paths at both ends, as the elements of an array see them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.parallel import parallel_for
from raychan.radar.array import Wavefronts
from raychan.records import DIFFUSE, POINT, SCATTER, Paths
from raychan.vectors import distance, row

Floats = NDArray[np.float64]

_MANY = 20_000  # paths from which on a second thread pays (not measured)


def fronts_of(paths: Paths) -> Wavefronts:
    """Return the spherical waves of paths at both ends: from the last scatterer's image over the mirrors behind it, of
    parts of footprints from where these are, and of paths without a scatterer from the other end's image."""
    met, at, n = paths.trajectories, paths.trajectory, len(paths.trajectory)
    looks, radii, bare = np.empty((2, n, 3)), np.empty((2, n)), np.empty(n, bool)
    aside = paths.aside if paths.aside.shape[1] else np.zeros((1, 2, 3), np.float32)
    ends = np.array([paths.tx, paths.rx], float)
    way = met.vertices, met.kind, met.departure, met.arrival

    def some(rows: slice) -> None:
        part = aside[rows] if len(aside) == n else aside
        out = looks[:, rows], radii[:, rows], bare[rows]
        _fronts(ends, *way, at[rows], paths.length[rows], part, *out)

    parallel_for(n, some, _MANY)
    fronts = Wavefronts(looks[1], radii[1], looks[0], radii[0], bare)
    return replace(fronts, drift=met.drift[at].astype(float), instant=met.instant[at]) if met.drift.size else fronts


@njit(cache=True, nogil=True, error_model="numpy")
def _fronts(  # type: ignore[no-untyped-def]
    ends, vertices, kind, departure, arrival, trajectory, length, aside, looks, radii, bare
):
    """Write the directions looks (2, n, 3), distances radii (2, n) [m] of the waves of paths at transmitter and
    receiver, and which have no scatterer.

    Args: ends (2, 3) [m]; vertices (w, d, 3), kind (w, d), departure, arrival (w, 3) of trajectories; trajectory,
    length (n,) of paths; aside (n, 2, 3) [m], or one row for all."""
    slots = kind.shape[1]
    for i in range(len(trajectory)):
        t, at = trajectory[i], -1
        for j in range(slots - 1, -1, -1):
            if kind[t, j] == SCATTER or kind[t, j] == POINT or kind[t, j] == DIFFUSE:
                at = j
        bare[i] = at < 0
        for end in range(2):
            look = row(arrival, t) if end == 1 else _double(row(departure, t))
            far = length[i] if at < 0 else _way(row(ends, end), vertices, t, at, 1 if end == 1 else -1)
            x, y, z = look
            a, b, c = _place(aside, i if len(aside) > 1 else 0, end)
            if a != 0.0 or b != 0.0 or c != 0.0:
                x, y, z = far * x + a, far * y + b, far * z + c
                far = math.sqrt(x * x + y * y + z * z)
                near = max(far, 1e-300)
                x, y, z = x / near, y / near, z / near
            looks[end, i, 0], looks[end, i, 1], looks[end, i, 2] = x, y, z
            radii[end, i] = far


@njit(cache=True, nogil=True, error_model="numpy")
def _way(end, vertices, t, at, step):  # type: ignore[no-untyped-def]
    """Return the length of the way from slot `at` of vertices (w, d, 3) of trajectory t to an end; unused slots repeat
    the receiver."""
    total, stop = 0.0, vertices.shape[1] if step == 1 else -1
    here, j = _place(vertices, t, at), at + step
    while j != stop:
        there = _place(vertices, t, j)
        total += distance(here, there)
        here = there
        j += step
    return total + distance(here, end)


@njit(cache=True, error_model="numpy", forceinline=True, uncounted=True)
def _place(a, i, j):  # type: ignore[no-untyped-def]
    """Return the vector in slot j of row i of a (n, d, 3), in double precision."""
    return np.float64(a[i, j, 0]), np.float64(a[i, j, 1]), np.float64(a[i, j, 2])


@njit(cache=True, forceinline=True, uncounted=True)
def _double(a):  # type: ignore[no-untyped-def]
    """Return a vector in double precision."""
    return np.float64(a[0]), np.float64(a[1]), np.float64(a[2])
