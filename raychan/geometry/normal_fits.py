"""Least-squares fits of many small groups of points at once (numba kernel)."""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit


@njit(cache=True, nogil=True, error_model="numpy")
def eliminated(basis, weight, z, at, n, least):  # type: ignore[no-untyped-def]
    """Return the normal equations m (n, k, k), y (n, k) of weighted fits of z (p,) in a basis (p, k), scaled to a unit
    diagonal and eliminated to upper triangles; by what each unknown was scaled (n, k); and which fits (n,) all of whose
    pivots are above the least: the others have unit equations.

    Args: weight (p,); at (p,) the fit to which each point belongs.
    """
    k = basis.shape[1]
    m, y, size, able = np.zeros((n, k, k)), np.zeros((n, k)), np.empty((n, k)), np.ones(n, np.bool_)
    for p in range(len(at)):
        f = at[p]
        for i in range(k):
            scaled = basis[p, i] * weight[p]
            for j in range(i, k):
                m[f, i, j] += scaled * basis[p, j]
            y[f, i] += scaled * z[p]
    for f in range(n):
        for i in range(k):
            size[f, i] = math.sqrt(max(m[f, i, i], 1e-300))
        for i in range(k):
            y[f, i] /= size[f, i]
            for j in range(i, k):
                m[f, i, j] /= size[f, i] * size[f, j]
                m[f, j, i] = m[f, i, j]
        able[f] = _eliminate(m, y, f, k, least)
    return m, y, size, able


@njit(cache=True, forceinline=True)
def _eliminate(m, y, f, k, least):  # type: ignore[no-untyped-def]
    """Eliminate below the diagonal of equations f in place; return False, and leave unit ones, where a pivot is not
    above the least."""
    for i in range(k):
        if not m[f, i, i] > least:
            for r in range(k):
                y[f, r] = 0.0
                for c in range(k):
                    m[f, r, c] = 1.0 if r == c else 0.0
            return False
        for r in range(i + 1, k):
            factor = m[f, r, i] / m[f, i, i]
            for c in range(i, k):
                m[f, r, c] -= factor * m[f, i, c]
            y[f, r] -= factor * y[f, i]
    return True
