"""Fields along a route: over its mirrors and layers, with the Fresnel coefficients of its own ray or of one beside it
(numba kernels)."""

from __future__ import annotations

from raychan.compile.jit import njit
from raychan.em.fresnel import coefficients
from raychan.em.polarization import reflect, transmit
from raychan.records import TRANSMIT


@njit(cache=True)
def vec(a):  # type: ignore[no-untyped-def]
    """Return the vector of an array (3,)."""
    return a[0], a[1], a[2]


@njit(cache=True)
def heading(a, b):  # type: ignore[no-untyped-def]
    """Return the unit vector from a to b; x where they are one point."""
    x, y, z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    s = (x * x + y * y + z * z) ** 0.5
    if s == 0.0:
        return 1.0, 0.0, 0.0
    return x / s, y / s, z / s


@njit(cache=True)
def cosine(k, n):  # type: ignore[no-untyped-def]
    """Return the cosine between a ray along k and the normal n, on whichever side."""
    return abs(k[0] * n[0] + k[1] * n[1] + k[2] * n[2])


@njit(cache=True, forceinline=True)
def over_mirrors(  # type: ignore[no-untyped-def]
    e, ahead, i, first, stop, step, vertices, normals, kind, material, used, end, table, k, cosines
):
    """Send fields e (p, 3) of route i that travel along `ahead` over mirrors and layers first, first + step, ... short
    of stop, in place; return the direction in which they leave the last. Their coefficients are those at cosines of
    incidence (d,), or at those of the way itself where there are none."""
    for j in range(first, stop, step):
        normal = vec(normals[i, j])
        at = cosines[j] if len(cosines) > 0 else cosine(ahead, normal)
        c = coefficients_at(table, material[i, j], at, k)
        passed(e, ahead, normal, c, kind[i, j] == TRANSMIT)
        ahead = heading(vertices[i, j], vertices[i, j + step] if j + step < used else end)
    return ahead


@njit(cache=True, forceinline=True)
def coefficients_at(table, row, cos_i, k):  # type: ignore[no-untyped-def]
    """Return the Fresnel coefficients of a material at a cosine of incidence."""
    kind, eps, thickness, roughness = table
    return coefficients(kind[row], eps[row], thickness[row], roughness[row], cos_i, k)


@njit(cache=True, forceinline=True)
def passed(e, k, normal, c, through):  # type: ignore[no-untyped-def]
    """Send fields e (p, 3) that travel along k through a layer or off a mirror, in place."""
    for p in range(len(e)):
        after = transmit(vec(e[p]), k, normal, c[2], c[3]) if through else reflect(vec(e[p]), k, normal, c[0], c[1])
        e[p, 0], e[p, 1], e[p, 2] = after


@njit(cache=True)
def incidence(point, end, i, first, stop, step, vertices, normals, kind, out):  # type: ignore[no-untyped-def]
    """Write the cosines of incidence (d,) on mirrors and layers first, first + step, ... short of stop of route i for
    the ray that comes from `end` over the same planes to a point; return its direction there."""
    image = vec(end)
    for j in range(first, stop, step):
        if kind[i, j] != TRANSMIT:
            image = mirrored(image, vec(vertices[i, j]), vec(normals[i, j]))
    arriving = heading(image, point)
    ahead = arriving
    for j in range(stop - step, first - step, -step):
        n = vec(normals[i, j])
        out[j] = cosine(ahead, n)
        if kind[i, j] != TRANSMIT:
            ahead = mirrored(ahead, (0.0, 0.0, 0.0), n)
    return arriving


@njit(cache=True, forceinline=True)
def mirrored(x, on, n):  # type: ignore[no-untyped-def]
    """Return x mirrored at the plane through `on` of normal n."""
    h = 2.0 * ((x[0] - on[0]) * n[0] + (x[1] - on[1]) * n[1] + (x[2] - on[2]) * n[2])
    return x[0] - h * n[0], x[1] - h * n[1], x[2] - h * n[2]
