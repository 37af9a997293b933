"""Bounds on what whole facets may scatter in a preview, before any tube is made of them (numba kernels)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.em.fresnel import coefficients
from raychan.geometry.curved_patches import place_on
from raychan.parallel import parallel_for
from raychan.tracing.image_paths import weight
from raychan.tracing.legs import Leg
from raychan.tracing.radiation import PhaseFacets
from raychan.tracing.tubes import slices
from raychan.vectors import distance, length_to
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

_PARALLEL_FROM = 4096  # facets from which on a second thread pays; not measured
NEAR = 0.5
"""Of its distance: what a facet that is bounded by its middle may measure. Larger ones may be much nearer elsewhere,
and seen by the beam there alone; not measured."""
_UNBOUNDED = 1e6  # 1/m: more than anything scatters


class _Lit(NamedTuple):
    """What facets (n,) are to the leg that lights them: middle (n, 3) [m], lengths (n, 3) [m] to their corners, `gain`
    (n,) of the leg's antenna, `size` (n,) [1] of what they scatter in phase, over the distance back."""

    middle: Floats
    lengths: Floats
    gain: Floats
    size: Floats


def facet_bounds(
    geometry: Geometry, leg: Leg, outs: list[Leg], facet: Ints, wavenumber: float
) -> list[tuple[Floats, Floats]]:
    """Return, for each leg out, the bound (n,) [1/m] on what whole facets (n,) that a leg lights may scatter, and the
    length (n,) [m] of the two-way path: those of `radiation.phases_of` for tubes as large as facets. What measures more
    than `NEAR` of its distance is not bounded: it gets more than anything scatters.

    Args: no leg is far; wavenumber [rad/m].
    """
    f, n = geometry.facets, len(facet)
    shape = PhaseFacets(f.vertices, geometry.edge_curvature, geometry.lossy, *geometry.material_columns)
    lit = _Lit(np.empty((n, 3)), np.empty((n, 3)), *np.empty((2, n)))
    found = [(np.empty(n), np.empty(n)) for _ in outs]

    def some(rows: slice) -> None:
        part = slices(lit, rows)
        light(facet[rows], shape, f.normals, leg.antenna, wavenumber, part)
        for out, (bound, length) in zip(outs, found, strict=True):
            same = out is leg
            ends = leg.image, out.antenna, same
            bounds(facet[rows], f.vertices, part, ends, wavenumber, bound[rows], length[rows])

    parallel_for(n, some, _PARALLEL_FROM)
    return found


@njit(cache=True, forceinline=True)
def _reflection(f, facets, normals, k, wavenumber):  # type: ignore[no-untyped-def]
    """Return the larger of |R_s|, |R_p| at the middle of facet f for a ray along k (3,)."""
    along, size = 0.0, 0.0
    for c in range(3):
        n = normals[f, 0, c] + normals[f, 1, c] + normals[f, 2, c]
        along += n * k[c]
        size += n * n
    kind, eps, thickness, roughness = facets.materials
    m = facets.material[f]
    cosine = abs(along) / math.sqrt(size)
    r_s, r_p, _, _ = coefficients(kind[m], eps[m], thickness[m], roughness[m], cosine, wavenumber)
    return max(abs(r_s), abs(r_p))


@njit(cache=True, nogil=True, error_model="numpy")
def light(facet, facets, normals, leg, wavenumber, out):  # type: ignore[no-untyped-def]
    """Write what facets (n,) are to the leg that lights them.

    Args: facets as `radiation.PhaseFacets`; normals (f, 3, 3) at their corners; leg, antenna of the leg (see
    `image_paths.weight`); out as `_Lit`.
    """
    middle, lengths, gain, size = out
    image = leg[0][len(leg[2])]
    k, look = np.empty(3), np.empty(3)
    for i in range(len(facet)):
        f = facet[i]
        v, p = facets.vertices[f], middle[i]
        place_on(v, facets.edge_curvature[f], 1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0, p)
        there, across = length_to(p, image, False), 0.0
        for c in range(3):
            lengths[i, c] = length_to(v[c], image, False)
            k[c] = (p[c] - image[c]) / there
        for c in range(3):
            a, b = (c + 1) % 3, (c + 2) % 3
            twice = (v[1, a] - v[0, a]) * (v[2, b] - v[0, b]) - (v[1, b] - v[0, b]) * (v[2, a] - v[0, a])
            across += twice * k[c]
        gain[i] = weight(p, *leg, look)
        size[i] = wavenumber / (4.0 * math.pi) * abs(across) * gain[i] / there
        if facets.lossy[f]:
            size[i] *= _reflection(f, facets, normals, k, wavenumber)
        if max(distance(v[0], v[1]), distance(v[1], v[2]), distance(v[2], v[0])) > NEAR * there:
            size[i] = _UNBOUNDED


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def _specular_share(v, image, lengths, out_image, backs, wavenumber):  # type: ignore[no-untyped-def]
    """Return what share of a facet of corners v (3, 3) may be in phase about a point at which the two-way length along
    an edge is least or most; 0 where no edge has one.

    Args: image, out_image (3,) [m]; lengths, backs (3,) [m] from there to the corners. Along an edge on which the
    phase bends by b from end to end that is sqrt(2 pi / b) of it (stationary phase), where the facet may be twice as
    wide as in the mean.
    """
    share = 0.0
    for c in range(3):
        d, begin, end = (c + 1) % 3, 0.0, 0.0
        for x in range(3):
            along = v[d, x] - v[c, x]
            begin += along * ((v[c, x] - image[x]) / lengths[c] + (v[c, x] - out_image[x]) / backs[c])
            end += along * ((v[d, x] - image[x]) / lengths[d] + (v[d, x] - out_image[x]) / backs[d])
        if begin * end < 0.0:
            share = max(share, min(1.0, 2.0 * math.sqrt(2.0 * math.pi / (wavenumber * abs(end - begin)))))
    return share


@njit(cache=True, nogil=True, error_model="numpy")
def bounds(facet, vertices, lit, ends, wavenumber, bound, length):  # type: ignore[no-untyped-def]
    """Write the bound (n,) [1/m] on what facets (n,) scatter to a leg out, and the two-way length (n,) [m].

    Args: vertices (f, 3, 3) [m]; lit as `_Lit`; ends: image (3,) [m] of the leg in, antenna of that out, whether both
    are one.
    """
    here, out, same = ends
    middle, lengths, gain, size = lit
    image, look, backs = out[0][len(out[2])], np.empty(3), np.empty(3)
    for i in range(len(facet)):
        v, p, bounded = vertices[facet[i]], middle[i], size[i] < _UNBOUNDED
        low, high, whole = np.inf, -np.inf, 0.0
        for c in range(3):
            backs[c] = lengths[i, c] if same else length_to(v[c], image, False)
            way = lengths[i, c] + backs[c]
            low, high, whole = min(low, way), max(high, way), whole + way
        length[i] = whole / 3.0
        back = gain[i] if same else weight(p, *out, look)
        share = 1.0 / (1.0 + 0.5 * wavenumber * (high - low))
        share = max(share, _specular_share(v, here, lengths[i], image, backs, wavenumber))
        bound[i] = size[i] * back / length_to(p, image, False) * share if bounded else _UNBOUNDED
