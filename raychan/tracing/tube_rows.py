"""Rows of the columns of tubes (numba kernels)."""

from __future__ import annotations

import numpy as np

from raychan.compile.jit import njit
from raychan.tracing.tubes import TubeColumns
from raychan.vectors import copy_to


@njit(cache=True, nogil=True)
def room_for_tubes(n, first):  # type: ignore[no-untyped-def]
    """Return columns of n tubes, to be written. Args: first whether they stand on their first surface."""
    return TubeColumns(
        np.empty((n, 4, 3)),
        np.empty((n, 4, 3)),
        np.empty((n, 4)),
        np.empty((n, 4, 3)),
        np.empty(n, np.int32),
        np.empty(n),
        np.empty(n),
        np.empty(n, np.bool_),
        np.empty((n, 3 if first else 0, 3)),
        np.empty(n, np.int8),
        np.empty(n, np.int8),
        np.empty(n, np.int8),
        np.empty(n, np.int32),
    )


@njit(cache=True, nogil=True, uncounted=True)
def copy_tubes(tubes, rows, out, at):  # type: ignore[no-untyped-def]
    """Write the tubes `rows` (m,) into the columns `out`, from row `at` on."""
    for j in range(len(rows)):
        i, o = rows[j], at + j
        for q in range(4):
            out.length[o, q] = tubes.length[i, q]
            for c in range(3):
                out.points[o, q, c], out.k[o, q, c] = tubes.points[i, q, c], tubes.k[i, q, c]
                out.normals[o, q, c] = tubes.normals[i, q, c]
        for q in range(out.bary.shape[1]):
            copy_to(out.bary[o, q], tubes.bary[i, q])
        out.facet[o], out.spread[o] = tubes.facet[i], tubes.spread[i]
        copy_history(tubes, i, out, o)


@njit(cache=True, forceinline=True, uncounted=True)
def copy_history(tubes, i, out, o):  # type: ignore[no-untyped-def]
    """Write into row o of the columns `out` those of tube i that its parts share."""
    out.strength[o], out.flat[o], out.slots[o] = tubes.strength[i], tubes.flat[i], tubes.slots[i]
    out.bounces[o], out.caustics[o], out.last[o] = tubes.bounces[i], tubes.caustics[i], tubes.last[i]
