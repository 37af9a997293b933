"""Rays on a regular lattice over directions, as peers shoot them: phase constant over a ray, or linear over its tube.

All rays share the physics of the rest: Fresnel reflection with polarisation, physical optics at every hit, shadow
rays back to the receiver. They see flat facets, so curved bodies are given to them finely meshed.
Sources: Ling, Chou, Lee, IEEE Trans. AP 37(2), 1989 (shooting and bouncing rays); design 4.2 (tubes).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.em.fresnel import coefficients
from raychan.em.physical_optics import huygens
from raychan.em.polarization import reflect
from raychan.records import MIRROR, SCATTERER
from raychan.tracing.legs import Leg
from raychan.units import C0
from raychan.world.ray_caster import RayCaster

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
FieldOf = Callable[[Floats], Complexes]

_CHUNK = 1 << 16


@dataclass(frozen=True)
class Window:
    """Directions q = axis + u across + v up, u and v within limits; all that the targets fill."""

    axis: Floats
    across: Floats
    up: Floats
    low: Floats
    high: Floats

    @staticmethod
    def onto(end: Floats, points: Floats, axis: Floats) -> Window:
        """Return the smallest window seen from `end` (3,) [m] that holds points (n, 3) [m] ahead of it."""
        axis = axis / np.linalg.norm(axis)
        across = np.cross([0.0, 0.0, 1.0], axis)
        across = across / np.linalg.norm(across)
        up = np.cross(axis, across)
        d = points - end
        depth = d @ axis
        ahead = depth > 0.5
        uv = np.column_stack([d @ across, d @ up])[ahead] / depth[ahead, None]
        return Window(axis, across, up, uv.min(axis=0), uv.max(axis=0))

    def lattice(self, rays: int) -> tuple[Floats, int, int]:
        """Return the steps (2,) and counts of a lattice of about `rays` square cells."""
        size = self.high - self.low
        step = np.sqrt(np.prod(size) / rays)
        nu, nv = np.maximum(1, np.ceil(size / step)).astype(int)
        return size / (nu, nv), int(nu), int(nv)


@dataclass(frozen=True)
class Echo:
    """What came back of some rays: field over the free wave `amplitude` (n,), `length` [m], `rate` [m/s], `away` and
    `look` (n, 3) unit directions of departure and arrival."""

    amplitude: Complexes
    length: Floats
    rate: Floats
    away: Floats
    look: Floats


def echoes(
    tracer: RayCaster,
    window: Window,
    outs: list[Leg],
    tx_field: FieldOf,
    rx_field: FieldOf,
    frequency: float,
    rays: int,
    bounces: int,
    tubes: bool,
    velocity: Floats | None = None,
) -> Iterator[Echo]:
    """Yield the echoes of a lattice of rays from outs[0].end, chunk by chunk.

    Args: outs the ways back, straight first, at most one mirror each; fields of the antennas (n, 3); rays of the
    first flight; tubes: integrate the phase over each ray's footprint, one sinc an axis, else take it constant.
    """
    f, k = tracer.facets, 2.0 * np.pi * frequency / C0
    end, own = np.asarray(outs[0].end, float), np.zeros(3) if velocity is None else np.asarray(velocity, float)
    (du, dv), nu, nv = window.lattice(rays)
    m = f.materials
    for start in range(0, nu * nv, _CHUNK):
        index = np.arange(start, min(start + _CHUNK, nu * nv))
        u = window.low[0] + (index // nv + 0.5) * du
        v = window.low[1] + (index % nv + 0.5) * dv
        q = window.axis + u[:, None] * window.across + v[:, None] * window.up
        qu, qv = np.tile(window.across, (len(q), 1)), np.tile(window.up, (len(q), 1))
        d = q / np.linalg.norm(q, axis=1)[:, None]
        away, e = d.copy(), np.ascontiguousarray(tx_field(d), np.complex128)
        p, length, rate = np.tile(end, (len(q), 1)), np.zeros(len(q)), -d @ own
        skip = np.full(len(q), -1, np.int32)
        for bounce in range(1, bounces + 1):
            hit, t = tracer.cast(p, d, skip)
            ok = np.flatnonzero((hit >= 0) & np.isfinite(t))
            if not len(ok):
                break
            q, qu, qv, d, away, e = q[ok], qu[ok], qv[ok], d[ok], away[ok], e[ok]
            hit, length, rate = hit[ok], length[ok] + t[ok], rate[ok]
            p = p[ok] + t[ok, None] * d
            n = tracer.normal[hit]
            n = np.where((np.einsum("ij,ij->i", n, d) > 0.0)[:, None], -n, n)
            material, body = f.material[hit].astype(np.int64), f.body[hit]
            speed = f.velocity[body]
            for out in outs:
                rows = np.flatnonzero((f.role[body] == SCATTERER) & (bounce + len(out.mirrors) <= bounces))
                rows = _seen(tracer, out, p, n, hit, rows, bounce)
                if not len(rows):
                    continue
                along, back = out.rays(p[rows])
                along, (look, g) = np.ascontiguousarray(along), _receiver(tracer, out, p[rows], rx_field, k)
                amplitude = np.empty(len(rows), np.complex128)
                _scatter(
                    q[rows], qu[rows], qv[rows], d[rows], length[rows], n[rows], e[rows], along, back, g,
                    material[rows], m.kind, m.eps, m.thickness, m.roughness, k, du, dv, tubes, amplitude,
                )  # fmt: skip
                last = own - 2.0 * (own @ out.mirrors[0].normal) * out.mirrors[0].normal if out.mirrors else own
                change = np.einsum("ij,ij->i", speed[rows], d[rows] + along) - along @ last
                yield Echo(amplitude, length[rows] + back, 0.5 * (rate[rows] + change), away[rows], look)
            if bounce < bounces:
                before = d.copy()
                _turn(q, qu, qv, d, n, e, material, m.kind, m.eps, m.thickness, m.roughness, k)
                rate = rate + np.einsum("ij,ij->i", speed, before - d)
                skip = hit


def _seen(
    tracer: RayCaster, out: Leg, p: Floats, n: Floats, hit: NDArray[np.int32], rows: NDArray[np.int64], bounce: int
) -> NDArray[np.int64]:
    """Return those of `rows` whose points face the end of `out` and see it."""
    along, _ = out.rays(p[rows])
    rows = rows[np.einsum("ij,ij->i", along, n[rows]) < 0.0]
    if bounce == 1 and not out.mirrors:
        return rows  # the ray itself came that way
    point, stop = p[rows], out.mirror_points(p[rows])[:, 0] if out.mirrors else np.tile(out.end, (len(rows), 1))
    d = stop - point
    reach = np.linalg.norm(d, axis=1)
    d /= reach[:, None]
    met, t = tracer.cast(point, d, hit[rows])
    clear = (met < 0) | (t >= reach - 1e-4)
    if out.mirrors:
        clear &= (met >= 0) & (tracer.facets.role[tracer.facets.body[np.maximum(met, 0)]] == MIRROR)
    return rows[clear]


def _receiver(tracer: RayCaster, out: Leg, p: Floats, rx_field: FieldOf, k: float) -> tuple[Floats, Complexes]:
    """Return where the receiver looks (n, 3) and its field at points p (n, 3) over the leg."""
    towards = out.mirror_points(p)[:, 0] if out.mirrors else p
    look = towards - out.end
    look /= np.linalg.norm(look, axis=1)[:, None]
    g = np.ascontiguousarray(rx_field(look), np.complex128)
    if out.mirrors:
        mirror, m = out.mirrors[0], tracer.facets.materials
        row = int(tracer.facets.material[mirror.facet])
        mirrored = np.tile(mirror.normal, (len(p), 1))
        spare = look.copy()
        _turn(
            spare.copy(), spare.copy(), spare.copy(), spare, mirrored, g, np.full(len(p), row, np.int64),
            m.kind, m.eps, m.thickness, m.roughness, k,
        )  # fmt: skip
    return look, g


@njit(cache=True)
def _three(a):  # type: ignore[no-untyped-def]
    return a[0], a[1], a[2]


@njit(cache=True)
def _dot(a, b):  # type: ignore[no-untyped-def]
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True)
def _step(q, n, qx, t):  # type: ignore[no-untyped-def]
    """Return how the footprint moves on its facet when the direction q moves along qx."""
    share = _dot(qx, n) / _dot(q, n)
    return t * (qx[0] - share * q[0]), t * (qx[1] - share * q[1]), t * (qx[2] - share * q[2])


@njit(cache=True)
def _sinc(x):  # type: ignore[no-untyped-def]
    return 1.0 - x * x / 6.0 if abs(x) < 1e-4 else np.sin(x) / x


@njit(cache=True, nogil=True)
def _scatter(  # type: ignore[no-untyped-def]
    q, qu, qv, d, length, n, e, along, back, g, material, kind, eps, thickness, rough, k, du, dv, tubes, out
):
    for i in range(len(length)):
        a, normal, k_in, k_out = _three(q[i]), _three(n[i]), _three(d[i]), _three(along[i])
        t = length[i] / np.sqrt(_dot(a, a))
        pu, pv = _step(a, normal, _three(qu[i]), t), _step(a, normal, _three(qv[i]), t)
        x = pu[1] * pv[2] - pu[2] * pv[1]
        y = pu[2] * pv[0] - pu[0] * pv[2]
        z = pu[0] * pv[1] - pu[1] * pv[0]
        area = np.sqrt(x * x + y * y + z * z) * du * dv
        m = material[i]
        ci = coefficients(kind[m], eps[m], thickness[m], rough[m], abs(_dot(k_in, normal)), k)
        co = coefficients(kind[m], eps[m], thickness[m], rough[m], abs(_dot(k_out, normal)), k)
        couple = huygens(_three(e[i]), k_in, _three(g[i]), k_out, normal, (ci[0], ci[1]), (co[0], co[1]))
        if tubes:
            slope = (k_in[0] + k_out[0], k_in[1] + k_out[1], k_in[2] + k_out[2])
            area *= _sinc(0.5 * k * du * _dot(pu, slope)) * _sinc(0.5 * k * dv * _dot(pv, slope))
        phase = np.exp(-1j * k * (length[i] + back[i]))
        out[i] = (-0.25j * k / np.pi) * couple * area / (length[i] * back[i]) * phase


@njit(cache=True, nogil=True)
def _turn(q, qu, qv, d, n, e, material, kind, eps, thickness, rough, k):  # type: ignore[no-untyped-def]
    """Reflect directions and fields at planes of normal n, in place."""
    for i in range(len(d)):
        normal, k_in = _three(n[i]), _three(d[i])
        m = material[i]
        c = coefficients(kind[m], eps[m], thickness[m], rough[m], abs(_dot(k_in, normal)), k)
        field = reflect(_three(e[i]), k_in, normal, c[0], c[1])
        e[i, 0], e[i, 1], e[i, 2] = field
        for x in (q, qu, qv, d):
            twice = 2.0 * _dot(_three(x[i]), normal)
            for j in range(3):
                x[i, j] -= twice * normal[j]
