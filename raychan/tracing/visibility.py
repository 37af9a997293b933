"""Sight: where to aim at tubes, and what the rays say of each (numba loops).

Everywhere: points (n, 4, 3) [m] corners and centres of tubes on facets (n,); image (3,) [m] that the rays come from, or
the unit direction towards it when far.
"""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit

_DRAWN = 0.98  # of the way from the centre: corners lie on edges that other facets share


@njit(cache=True, nogil=True)
def put_down(points, facet, bary, curved, vertices):  # type: ignore[no-untyped-def]
    """Return the points, those on curved facets put down on the flat ones by their corners' bary (n, 3, 3)."""
    out = points.copy()
    for i in range(len(facet)):
        f = facet[i]
        if not curved[f]:
            continue
        for c in range(3):
            total = 0.0
            for q in range(3):
                at = 0.0
                for j in range(3):
                    at += bary[i, q, j] * vertices[f, j, c]
                out[i, q, c] = at
                total += at
            out[i, 3, c] = total / 3.0
    return out


@njit(cache=True, forceinline=True)
def _slack(true, first, normal, image, far):  # type: ignore[no-untyped-def]
    """Return by how much [m] a tube's own neighbours may stand before it: some of what it rises over its facet."""
    hover, slope, size = 0.0, 0.0, 0.0
    for q in range(4):
        rise = 0.0
        for c in range(3):
            rise += (true[q, c] - first[c]) * normal[c]
        hover = max(hover, abs(rise))
    for c in range(3):
        k = image[c] if far else true[3, c] - image[c]
        slope += k * normal[c]
        size += k * k
    return 1e-5 + 3.0 * hover / max(abs(slope) / math.sqrt(size), 0.05)


@njit(cache=True, nogil=True, error_model="numpy")
def aims(points, true, facet, first, normal, image, far, centres, corners):  # type: ignore[no-untyped-def]
    """Return the rays (r,) to cast: aim (r, 3) [m], facet and slack (r,) [m]; and the slack (n,) [m] of each tube.

    Args: true (n, 4, 3) [m] the points on the true surface; first, normal (m, 3) of the facets; centres whether those
    of all tubes are wanted, which then come first; corners (n,) of which tubes the corners are.
    """
    n = len(facet)
    at = n if centres else 0
    r = at + 3 * np.count_nonzero(corners)
    aim, target, near, slack = np.empty((r, 3)), np.empty(r, np.int32), np.empty(r), np.empty(n)
    for i in range(n):
        f = facet[i]
        slack[i] = _slack(true[i], first[f], normal[f], image, far)
        if centres:
            target[i], near[i] = f, slack[i]
            for c in range(3):
                aim[i, c] = points[i, 3, c]
        if corners[i]:
            for q in range(3):
                target[at], near[at] = f, slack[i]
                for c in range(3):
                    aim[at, c] = points[i, 3, c] + _DRAWN * (points[i, q, c] - points[i, 3, c])
                at += 1
    return aim, target, near, slack


@njit(cache=True, nogil=True)
def read_rays(seen, blocker, centre_seen, centre_blocker, corners, matters, gaps, smooth):  # type: ignore[no-untyped-def]
    """Return of tubes whether some ray is seen, whether only some are, and where to look for what parts them.

    Args: seen, blocker (3 c,) of the rays to the tubes' corners, where these were cast (n,); the centre's, seen and
    blocker (n,), speak for the others; matters (n,); gaps whether to look at tubes that two bodies hide, between which
    there may be a gap: behind one smooth patch (m,) there is none.
    """
    n = len(corners)
    some, mixed, look = np.empty(n, np.bool_), np.empty(n, np.bool_), np.empty(n, np.bool_)
    at = 0
    for i in range(n):
        whole, block = centre_seen[i], centre_blocker[i]
        some[i], one = whole, block >= 0
        if corners[i]:
            for q in range(at, at + 3):
                some[i] |= seen[q]
                whole &= seen[q]
                one = one and blocker[q] >= 0 and smooth[blocker[q]] == smooth[block]
            at += 3
        mixed[i] = some[i] and not whole
        look[i] = matters[i] and (some[i] or (gaps and not one))
    return some, mixed, look


@njit(cache=True, nogil=True, error_model="numpy")
def partly_seen(  # type: ignore[no-untyped-def]
    look, points, facet, seen, blocker, centre_seen, centre_blocker, corners, plane, image, far
):
    """Return of the tubes to `look` at (n,) their numbers, points, what each ray met, and the planes of that.

    Args as for `read_rays`; plane (m,) of the facets. Returns: rows (k,); points (k, 4, 3) [m]; met (k, 4) blockers, -1
    for the tube's own surface; planes (k, 4) of these, -1 unknown; source (k, 3) [m], back (k, 3) the direction
    towards it; own (k, 3) unit normals of the tubes.
    """
    k = np.count_nonzero(look)
    rows, at, met, planes = (
        np.empty(k, np.int64),
        np.empty((k, 4, 3)),
        np.empty((k, 4), np.int32),
        np.empty((k, 4), np.int32),
    )
    source, back, own = np.empty((k, 3)), np.empty((k, 3)), np.empty((k, 3))
    j, ray = 0, 0
    for i in range(len(look)):
        if look[i]:
            rows[j] = i
            for q in range(4):
                cast = q < 3 and corners[i]
                free = seen[ray + q] if cast else centre_seen[i]
                block = blocker[ray + q] if cast else centre_blocker[i]
                met[j, q] = block
                planes[j, q] = plane[block] if block >= 0 else (plane[facet[i]] if free else -1)
                for c in range(3):
                    at[j, q, c] = points[i, q, c]
            size, area = 0.0, 0.0
            for c in range(3):
                a, b = (c + 1) % 3, (c + 2) % 3
                own[j, c] = (at[j, 1, a] - at[j, 0, a]) * (at[j, 2, b] - at[j, 0, b])
                own[j, c] -= (at[j, 1, b] - at[j, 0, b]) * (at[j, 2, a] - at[j, 0, a])
                area += own[j, c] ** 2
                source[j, c] = image[c]
                back[j, c] = image[c] if far else image[c] - at[j, 3, c]
                size += back[j, c] ** 2
            for c in range(3):
                own[j, c] /= max(math.sqrt(area), 1e-300)
                back[j, c] /= math.sqrt(size)
            j += 1
        if corners[i]:
            ray += 3
    return rows, at, met, planes, source, back, own


GONE, READY, BENT, SHADED = 0, 1, 2, 3


@njit(cache=True, nogil=True)
def sort_out(facing, seen, some, mixed, rough, matters):  # type: ignore[no-untyped-def]
    """Return what is to be done with each tube (n,): let go, keep, halve where its phase bends, or divide where only a
    part of it is seen.

    Args: facing (n,) whether it faces the end; seen (n,) by its centre ray, `some` (n,) by any, `mixed` (n,) in part;
    rough (n,) see `phases`; matters (n,) whether it may be cut.
    """
    out = np.empty(len(seen), np.int8)
    for i in range(len(seen)):
        out[i] = READY if seen[i] else GONE
        if matters[i]:
            # Bends come first: they need an edge of their own.
            if some[i] and rough[i] > 1.0:
                out[i] = BENT
            elif mixed[i]:
                # Beyond the horizon no shadow's edge is known to cut along.
                out[i] = SHADED if facing[i] else BENT
    return out
