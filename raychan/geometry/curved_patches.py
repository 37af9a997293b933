"""Patches of curved surfaces: Nagata's quadratic triangles through corners and corner normals of facets, and rays to
them (numba kernels). Source: Nagata (2005), Computer Aided Geometric Design 22(4), eq. 10.

Everywhere: v, n, b (m, 3, 3) corners, corner normals and edge curvatures of the facets; image (3,) the source's mirror
image [m], or the unit direction towards it when far; bary (n, 3, 3) corners of patches on their facets.
"""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit
from raychan.vectors import distance, dot, largest, length_to, twice_area_across

_STEPS, _CLOSE = 12, 1e-9  # most steps from a plane to its patch, and the m by which the last one moves at most
_BESIDE = 0.5  # of a facet's barycentric range: so far beside the facet its patch goes on; not measured


@njit(cache=True, forceinline=True, uncounted=True)
def copy_corners(out, w):  # type: ignore[no-untyped-def]
    """Write the corners w (3, 3) into out."""
    for c in range(3):
        out[c, 0], out[c, 1], out[c, 2] = w[c, 0], w[c, 1], w[c, 2]


@njit(cache=True, forceinline=True, uncounted=True)
def place_on(v, b, x, y, z, p):  # type: ignore[no-untyped-def]
    """Write into p the point of the curved surface at barycentric (x, y, z)."""
    xy, yz, zx = x * y, y * z, z * x
    for c in range(3):
        p[c] = x * v[0, c] + y * v[1, c] + z * v[2, c] - xy * b[0, c] - yz * b[1, c] - zx * b[2, c]


@njit(cache=True, forceinline=True, uncounted=True)
def weights_at(v, x, y, z):  # type: ignore[no-untyped-def]
    """Return the barycentric coordinates of a point (x, y, z) [m] above or below a facet of corners v (3, 3)."""
    ax, ay, az = v[1, 0] - v[0, 0], v[1, 1] - v[0, 1], v[1, 2] - v[0, 2]
    bx, by, bz = v[2, 0] - v[0, 0], v[2, 1] - v[0, 1], v[2, 2] - v[0, 2]
    x, y, z = x - v[0, 0], y - v[0, 1], z - v[0, 2]
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    twice = nx * nx + ny * ny + nz * nz
    one = (x * (by * nz - bz * ny) + y * (bz * nx - bx * nz) + z * (bx * ny - by * nx)) / twice
    two = (x * (ny * az - nz * ay) + y * (nz * ax - nx * az) + z * (nx * ay - ny * ax)) / twice
    return 1.0 - one - two, one, two


@njit(cache=True, forceinline=True, uncounted=True)
def distance_to_patch(v, b, normal, o, k, flat):  # type: ignore[no-untyped-def]
    """Return the distance [m] at which a ray from o along k meets the patch over a facet (v, b: corners, curvatures),
    whose plane it meets after `flat`; that distance where it passes beside the patch, or almost along it."""
    t, slope = flat, dot(k, normal)
    before, missed_before = flat, 0.0
    off = 0.0, 0.0, 0.0
    for step in range(_STEPS):
        # Moved back by the patch's offset there, the ray meets the plane.
        x, y, z = weights_at(
            v, o[0] + t * k[0] - off[0], o[1] + t * k[1] - off[1], o[2] + t * k[2] - off[2]
        )  # fmt: skip
        if min(x, min(y, z)) < -_BESIDE or max(x, max(y, z)) > 1.0 + _BESIDE:
            break
        xy, yz, zx = -x * y, -y * z, -z * x
        off = (
            xy * b[0, 0] + yz * b[1, 0] + zx * b[2, 0],
            xy * b[0, 1] + yz * b[1, 1] + zx * b[2, 1],
            xy * b[0, 2] + yz * b[1, 2] + zx * b[2, 2],
        )
        missed = flat + dot(off, normal) / slope - t
        if abs(missed) < _CLOSE:
            return t
        # By the secant of what the last two steps missed it by.
        bend = missed_before - missed
        last, ahead = t, missed
        if step > 0 and abs(bend) > 1e-3 * abs(missed):
            ahead = missed * (t - before) / bend
        t, before, missed_before = t + ahead, last, missed
    return flat


@njit(cache=True, forceinline=True, uncounted=True)
def rise_off_chord(a, b, at_a, at_b, t, out):  # type: ignore[no-untyped-def]
    """Write how far (3,) [m] a curved surface lies off the chord from a to b (3,) at the share t of it, by the unit
    normals at_a, at_b (3,) at its ends; return whether it does."""
    rise, size = 0.0, 0.0
    for c in range(3):
        rise += 0.5 * t * (1.0 - t) * (at_b[c] - at_a[c]) * (b[c] - a[c])
        size += (at_a[c] + at_b[c]) ** 2
    scale = rise / math.sqrt(size) if size > 0.0 else 0.0
    for c in range(3):
        out[c] = scale * (at_a[c] + at_b[c])
    return scale != 0.0


@njit(cache=True, forceinline=True, uncounted=True)
def middle(w):  # type: ignore[no-untyped-def]
    """Return the barycentric coordinates of a patch's centre."""
    return (
        (w[0, 0] + w[1, 0] + w[2, 0]) / 3.0,
        (w[0, 1] + w[1, 1] + w[2, 1]) / 3.0,
        (w[0, 2] + w[1, 2] + w[2, 2]) / 3.0,
    )


@njit(cache=True, forceinline=True, uncounted=True)
def _normal_on(n, x, y, z, out):  # type: ignore[no-untyped-def]
    """Write into out the unit normal of the curved surface at barycentric (x, y, z)."""
    for c in range(3):
        out[c] = x * n[0, c] + y * n[1, c] + z * n[2, c]
    size = math.sqrt(dot(out, out))
    for c in range(3):
        out[c] /= size


@njit(cache=True, forceinline=True, uncounted=True)
def _ray(p, image, far, k):  # type: ignore[no-untyped-def]
    """Write into k the direction in which a ray from the source travels at p; return its length [m]."""
    if far:
        k[0], k[1], k[2] = -image[0], -image[1], -image[2]
        return -dot(p, image)
    k[0], k[1], k[2] = p[0] - image[0], p[1] - image[1], p[2] - image[2]
    length = math.sqrt(dot(k, k))
    k[0] /= length
    k[1] /= length
    k[2] /= length
    return length


@njit(cache=True, forceinline=True, uncounted=True)
def _length_across(p, q, image, far):  # type: ignore[no-untyped-def]
    """Return the length of pq across the rays from the image [m]."""
    whole, along, size = 0.0, 0.0, 0.0
    for c in range(3):
        d = q[c] - p[c]
        k = image[c] if far else 0.5 * (p[c] + q[c]) - image[c]
        whole += d * d
        along += d * k
        size += k * k
    return math.sqrt(max(whole - along * along / max(size, 1e-300), 0.0))


@njit(cache=True, nogil=True, error_model="numpy")
def edge_to_cut(  # type: ignore[no-untyped-def]
    facet, bary, v, n, b, image, far, out_image, out_far, wavenumber, phase, turn, max_edge, most_bend,
    widest, across, least,
):  # fmt: skip
    """Return at which edge (n,) to bisect each patch so that its two-way phase comes nearer to a quadratic; -1: none.

    All limits on phase and normal grow with half the span of phase: where it runs, a patch scatters less.

    Args: phase [rad] by which the quadratic through corners and edge middles may miss the centre; turn [rad] of the
    normal; max_edge [m], across the rays of the first leg if `across`, of patches that may scatter `least` [1/m] or
    more, all in phase under a unit field at 1 m; most_bend [rad] of the phase along an edge; widest [rad] under which
    an end may see an edge.
    """
    out = np.empty(len(facet), np.int8)
    p, normal, total = np.empty((7, 3)), np.empty((4, 3)), np.empty(7)
    for i in range(len(facet)):
        f, w = facet[i], bary[i]
        for c in range(3):
            d = (c + 1) % 3
            place_on(v[f], b[f], w[c, 0], w[c, 1], w[c, 2], p[c])
            _normal_on(n[f], w[c, 0], w[c, 1], w[c, 2], normal[c])
            place_on(
                v[f], b[f], 0.5 * (w[c, 0] + w[d, 0]), 0.5 * (w[c, 1] + w[d, 1]), 0.5 * (w[c, 2] + w[d, 2]), p[3 + c]
            )
        x, y, z = middle(w)
        place_on(v[f], b[f], x, y, z, p[6])
        _normal_on(n[f], x, y, z, normal[3])
        low, high = np.inf, -np.inf
        for q in range(7):
            total[q] = wavenumber * (length_to(p[q], image, far) + length_to(p[q], out_image, out_far))
            if q < 6:
                low, high = min(low, total[q]), max(high, total[q])
        bend0 = total[3] - 0.5 * (total[0] + total[1])
        bend1 = total[4] - 0.5 * (total[1] + total[2])
        bend2 = total[5] - 0.5 * (total[2] + total[0])
        miss = total[6] - (total[0] + total[1] + total[2]) / 3.0 - (bend0 + bend1 + bend2) * (4.0 / 9.0)
        bend0, bend1, bend2 = abs(bend0), abs(bend1), abs(bend2)
        off = max(abs(miss) / phase, max(bend0, bend1, bend2) / most_bend)
        turned = 0.0
        for c in range(3):
            turned = max(turned, distance(normal[c], normal[3]) / turn)
        if across:
            e0, e1 = _length_across(p[0], p[1], image, far), _length_across(p[1], p[2], image, far)
            e2 = _length_across(p[2], p[0], image, far)
        else:
            e0, e1, e2 = distance(p[0], p[1]), distance(p[1], p[2]), distance(p[2], p[0])
        limit = 1.0 + 0.5 * (high - low)
        if off > limit:
            out[i] = largest(bend0, bend1, bend2)
        elif turned > limit:
            # Where the phase is quadratic, only a cut across the turn of the normal lessens it.
            n0, n1 = distance(normal[0], normal[1]), distance(normal[1], normal[2])
            out[i] = largest(n0, n1, distance(normal[2], normal[0]))
        elif max(e0, e1, e2) > max_edge and _in_phase(p, image, far, out_image, out_far, wavenumber) >= least:
            out[i] = largest(e0, e1, e2)
        else:
            out[i] = _widest_edge(p, image, far, widest)
            if out[i] < 0:
                out[i] = _widest_edge(p, out_image, out_far, widest)
    return out


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def _in_phase(p, image, far, out_image, out_far, wavenumber):  # type: ignore[no-untyped-def]
    """Return what a patch of corners p (7, 3), the last its centre, may scatter [1/m], all in phase: k A / (2 pi r r')
    of its area across the rays (see `radiation.phases`)."""
    if far:
        across = twice_area_across(p, (image[0], image[1], image[2]))
    else:
        k = p[6, 0] - image[0], p[6, 1] - image[1], p[6, 2] - image[2]
        across = twice_area_across(p, k) / length_to(p[6], image, False) ** 2
    if not out_far:
        across /= length_to(p[6], out_image, False)
    return wavenumber / (4.0 * math.pi) * abs(across)


@njit(cache=True, forceinline=True)
def _widest_edge(p, image, far, widest):  # type: ignore[no-untyped-def]
    """Return the edge of a patch of corners p (7, 3) that is seen under the largest angle from the image, if that is
    larger than `widest`; else -1."""
    if far or widest == np.inf:
        return -1
    e0, e1 = _length_across(p[0], p[1], image, far), _length_across(p[1], p[2], image, far)
    e2 = _length_across(p[2], p[0], image, far)
    return largest(e0, e1, e2) if max(e0, e1, e2) > widest * length_to(p[6], image, far) else -1


@njit(cache=True, nogil=True, error_model="numpy")
def edge_of_fan(facet, bary, n, fan):  # type: ignore[no-untyped-def]
    """Return at which edge (n,) to bisect each patch that spreads reflected rays by more than `fan` [rad]; -1: none."""
    out, normal = np.empty(len(facet), np.int8), np.empty((3, 3))
    for i in range(len(facet)):
        f, w = facet[i], bary[i]
        for c in range(3):
            _normal_on(n[f], w[c, 0], w[c, 1], w[c, 2], normal[c])
        n0, n1, n2 = distance(normal[0], normal[1]), distance(normal[1], normal[2]), distance(normal[2], normal[0])
        # A ray turns by twice the turn of the normal.
        out[i] = largest(n0, n1, n2) if 2.0 * max(n0, n1, n2) > fan else -1
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def halved(facet, bary, edge, rows, jitter, level):  # type: ignore[no-untyped-def]
    """Return (facet, bary) of both halves of the patches `rows` (m,), cut from a point of `edge` (n,) to the opposite
    corner.

    The point is the middle, or a share `jitter` of the edge to either side of it.
    """
    m = len(rows)
    facets, barys = np.empty(2 * m, facet.dtype), np.empty((2 * m, 3, 3))
    for j in range(m):
        i = rows[j]
        a, c = edge[i], (edge[i] + 1) % 3
        # To which side is pseudo-random, by facet and level, and the same in every run.
        share = 0.5 + (jitter if ((facet[i] * 40503 >> 7) + level) & 1 else -jitter)
        facets[2 * j], facets[2 * j + 1] = facet[i], facet[i]
        copy_corners(barys[2 * j], bary[i])
        copy_corners(barys[2 * j + 1], bary[i])
        for x in range(3):
            cut = share * bary[i, a, x] + (1.0 - share) * bary[i, c, x]
            barys[2 * j, c, x], barys[2 * j + 1, a, x] = cut, cut
    return facets, barys


@njit(cache=True, nogil=True, error_model="numpy")
def rays_on(facet, bary, v, n, b, is_open, image, far):  # type: ignore[no-untyped-def]
    """Return points (n, 4, 3) [m], directions (n, 4, 3), lengths (n, 4) [m] and normals (n, 4, 3) of the rays from the
    source to corners and centre of each patch; normals of facets lit from both sides (`is_open`) face the source."""
    m = len(facet)
    p, k, length, normal = np.empty((m, 4, 3)), np.empty((m, 4, 3)), np.empty((m, 4)), np.empty((m, 4, 3))
    write_rays_on(facet, bary, v, n, b, is_open, image, far, p, k, length, normal)
    return p, k, length, normal


@njit(cache=True, nogil=True, error_model="numpy", uncounted=True)
def write_rays_on(facet, bary, v, n, b, is_open, image, far, p, k, length, normal):  # type: ignore[no-untyped-def]
    """Write what `rays_on` returns."""
    for i in range(len(facet)):
        f, w = facet[i], bary[i]
        for q in range(4):
            if q == 3:
                x, y, z = middle(w)
            else:
                x, y, z = w[q, 0], w[q, 1], w[q, 2]
            place_on(v[f], b[f], x, y, z, p[i, q])
            _normal_on(n[f], x, y, z, normal[i, q])
            length[i, q] = _ray(p[i, q], image, far, k[i, q])
        if is_open[f] and dot(normal[i, 3], k[i, 3]) > 0.0:
            for q in range(4):
                for c in range(3):
                    normal[i, q, c] = -normal[i, q, c]
