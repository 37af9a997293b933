"""Fields along a route: over its mirrors and layers, with the Fresnel coefficients of its own ray or of one beside it
(numba kernels)."""

from __future__ import annotations

from raychan.compile.jit import njit
from raychan.em.fresnel import coefficients
from raychan.em.physical_optics import incident
from raychan.em.polarization import made_of, onto
from raychan.records import TRANSMIT
from raychan.vectors import row


@njit(cache=True, forceinline=True, uncounted=True)
def vec(a):  # type: ignore[no-untyped-def]
    """Return the vector of an array (3,)."""
    return a[0], a[1], a[2]


@njit(cache=True, error_model="numpy", forceinline=True, uncounted=True)
def heading(a, b):  # type: ignore[no-untyped-def]
    """Return the unit vector from a to b; x where they are one point."""
    x, y, z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    s = (x * x + y * y + z * z) ** 0.5
    if s == 0.0:
        return 1.0, 0.0, 0.0
    return x / s, y / s, z / s


@njit(cache=True, forceinline=True, uncounted=True)
def cosine(k, n):  # type: ignore[no-untyped-def]
    """Return the cosine between a ray along k and the normal n, on whichever side."""
    return abs(k[0] * n[0] + k[1] * n[1] + k[2] * n[2])


@njit(cache=True, forceinline=True, uncounted=True)
def slot(a, i, j):  # type: ignore[no-untyped-def]
    """Return the vector in slot j of route i of a (n, d, 3): a view of it would count a reference."""
    return a[i, j, 0], a[i, j, 1], a[i, j, 2]


@njit(cache=True, uncounted=True)
def over_mirrors(  # type: ignore[no-untyped-def]
    e, ways, ahead, i, first, stop, step, vertices, normals, kind, facet, material, used, end, table, k, cosines, begun
):
    """Send fields e (4 p, 3) of route i that travel along `ahead` over mirrors and layers first, first + step, ...
    short of stop, in place; return the direction in which they leave the last.

    Their coefficients are those of the way itself; of several ways, p fields of each, those at cosines of incidence
    (n, d), rows from `begun` on.
    """
    kinds, eps, thickness, roughness = table
    part = len(e) // 4
    for j in range(first, stop, step):
        normal, m, through = slot(normals, i, j), material[facet[i, j]], kind[i, j] == TRANSMIT
        s, p_in, p_out, _ = incident(ahead, normal)
        p = p_in if through else p_out
        for c in range(ways):
            at = cosines[begun + c, j] if ways > 1 else cosine(ahead, normal)
            r_s, r_p, t_s, t_p = coefficients(kinds[m], eps[m], thickness[m], roughness[m], at, k)
            by_s, by_p = (t_s, t_p) if through else (r_s, r_p)
            for f in range(c * part, (c + 1) * part):
                one = row(e, f)
                e[f, 0], e[f, 1], e[f, 2] = made_of(s, p, by_s * onto(one, s), by_p * onto(one, p_in))
        ahead = heading(slot(vertices, i, j), slot(vertices, i, j + step) if j + step < used else vec(end))
    return ahead


@njit(cache=True, forceinline=True, uncounted=True)
def mirrored(x, on, n):  # type: ignore[no-untyped-def]
    """Return x mirrored at the plane through `on` of normal n."""
    h = 2.0 * ((x[0] - on[0]) * n[0] + (x[1] - on[1]) * n[1] + (x[2] - on[2]) * n[2])
    return x[0] - h * n[0], x[1] - h * n[1], x[2] - h * n[2]


@njit(cache=True, forceinline=True, uncounted=True)
def curved(n, f):  # type: ignore[no-untyped-def]
    """Tell whether the normals at the corners of facet f differ, n (f, 3, 3)."""
    apart = 0.0
    for c in range(3):
        apart += abs(n[f, 0, c] - n[f, 1, c]) + abs(n[f, 0, c] - n[f, 2, c])
    return apart > 0.0
