"""Leaks of the ray caster: rays aimed at shared edges, at vertices, and at the corners of tubes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.study.regimes_base import Floats, Outcome, Regime, Row, geometry_of
from raychan.world.meshes.mesh import Mesh
from raychan.world.ray_caster import RayCaster
from raychan.world.shapes import RIGID, build

Ints = NDArray[np.int64]

_CHUNK = 1 << 17  # rays at a time: bounds memory (other sizes not measured)
_SLANT = 0.02  # least cosine of the angle of incidence: flatter rays may rightly miss after rounding
_TARGETS = ("edges", "vertices", "corner rays of tubes")


@dataclass
class _Count:
    """Counts of rays cast, of leaks between faces, and of rays that rounding to float32 moved off all faces."""

    rays: int = 0
    leaks: int = 0
    moved: int = 0


def leaks(quick: bool) -> Outcome:
    """Aim rays from outside at edges that two faces share, at vertices, and 2 % off them; count those that pass
    through.

    A ray that hits too far away is rounded to float32 and intersected with every face in float64. If it meets a nearer
    face, the ray caster leaked; if not, rounding moved it past a silhouette edge."""
    total = 100_000 if quick else 10_000_000
    rng = np.random.default_rng(7)
    rows: list[Row] = []
    counts: list[list[_Count]] = []
    for name in RIGID:
        mesh = build(name)
        geometry = geometry_of(mesh)
        # Half of all rays at edges, a quarter at vertices, a quarter at corner rays.
        wanted = [total // (k * len(RIGID)) + 1 for k in (2, 4, 4)]
        found = [_leaks(geometry, mesh, target, n, rng) for target, n in zip(_TARGETS, wanted, strict=True)]
        counts.append(found)
        rows += [_row(name, target, c) for target, c in zip(_TARGETS, found, strict=True) if c.rays]
    for i, target in enumerate(_TARGETS):
        every = [c[i] for c in counts]
        whole = _Count(sum(c.rays for c in every), sum(c.leaks for c in every), sum(c.moved for c in every))
        rows.append(_row("all shapes", target, whole))
    table = {key: np.array([[vars(c)[key] for c in row] for row in counts]) for key in ("rays", "leaks", "moved")}
    return Outcome(rows, {"shape": list(RIGID), "target": list(_TARGETS), **table})


def _row(name: str, target: str, c: _Count) -> Row:
    notes = []
    if c.leaks:
        notes.append(f"{c.leaks} rays, rounded to float32, meet a nearer face in float64 that Embree does not report")
    if c.moved:
        notes.append(f"{c.moved} were moved past a silhouette edge by rounding to float32")
    what = f"{name}, {target}: {c.rays} rays"
    return Row(what, 0.0, 1e6 * c.leaks / max(c.rays, 1), 0.0, "per million", "topology: no gap", "; ".join(notes))


def _leaks(geometry: RayCaster, mesh: Mesh, target: str, count: int, rng: np.random.Generator) -> _Count:
    """Return the counts for rays from outside at targets (see _TARGETS) whose faces all show the same side."""
    f, v = mesh.faces.astype(np.int64), mesh.vertices
    start, end = f.ravel(), np.roll(f, -1, axis=1).ravel()
    a, b = _shared(start, end, len(v))
    out = _Count()
    if not len(a):
        return out
    fan = _Fan(f, len(v))
    middle, size = v.mean(axis=0), float(np.ptp(v, axis=0).max())
    while out.rays < count:
        e = rng.integers(len(a), size=_CHUNK)
        t = rng.uniform(size=(_CHUNK, 1)) if target == "edges" else np.zeros((_CHUNK, 1))
        aim = v[start[a[e]]] * (1 - t) + v[end[a[e]]] * t
        if target == "corner rays of tubes":
            centre = mesh.corners[a[e] // 3].mean(axis=1)
            aim = centre + 0.98 * (aim - centre)
        d = rng.normal(size=(_CHUNK, 3))
        origin = middle + 2.0 * size * d / np.linalg.norm(d, axis=1, keepdims=True)
        d = aim - origin
        length = np.linalg.norm(d, axis=1)
        d /= length[:, None]
        # A ray past a silhouette edge may rightly miss: all faces round the point must show the same side.
        ca = np.einsum("ij,ij->i", geometry.normal[a[e] // 3], d)
        cb = np.einsum("ij,ij->i", geometry.normal[b[e] // 3], d)
        ok = np.abs(ca) > _SLANT
        if target != "corner rays of tubes":
            ok &= (ca * cb > 0.0) & (np.abs(cb) > _SLANT)
        if target == "vertices":
            low, high = fan.turns(geometry.normal, start[a[e]], d)
            ok &= (low * high > 0.0) & (np.minimum(np.abs(low), np.abs(high)) > _SLANT)
        rows = np.flatnonzero(ok)[: count - out.rays]
        if not len(rows):
            return out
        hit, dist = geometry.cast(origin[rows], d[rows], np.full(len(rows), -1, np.int32))
        # Embree's float32 shifts a ray sideways by about 1e-7 of its coordinates; slant incidence makes that 50 times.
        slack = 1e-6 * size / _SLANT
        late = rows[(hit < 0) | (dist > length[rows] + slack)]
        real = [_meets(geometry.facets.vertices, origin[i], d[i], length[i] + slack) for i in late]
        out.rays += len(rows)
        out.leaks += sum(real)
        out.moved += len(real) - sum(real)
    return out


def _shared(start: Ints, end: Ints, count: int) -> tuple[Ints, Ints]:
    """Return the pairs of half-edges (numbers into start, end) that two faces, and no third, share."""
    key = np.minimum(start, end) * count + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    first = np.flatnonzero(key[order][1:] == key[order][:-1])
    values, uses = np.unique(key, return_counts=True)
    first = first[np.isin(key[order][first], values[uses == 2])]
    return order[first], order[first + 1]


def _meets(corners: Floats, origin: Floats, d: Floats, limit: float) -> bool:
    """Return whether a ray, rounded to float32 about the corners' centre as in the caster, meets a face within `limit`
    [m].

    Source: Moller, Trumbore 1997, in float64.
    """
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    centre = 0.5 * (low + high)
    o = (origin - centre).astype(np.float32).astype(np.float64)
    k = d.astype(np.float32).astype(np.float64)
    c = (corners - centre).astype(np.float32).astype(np.float64)
    e1, e2, r = c[:, 1] - c[:, 0], c[:, 2] - c[:, 0], o - c[:, 0]
    p, q = np.cross(k, e2), np.cross(r, e1)
    det = np.einsum("ij,ij->i", e1, p)
    with np.errstate(divide="ignore", invalid="ignore"):
        u, w = np.einsum("ij,ij->i", r, p) / det, q @ k / det
        t = np.einsum("ij,ij->i", e2, q) / det
    return bool(((u >= 0.0) & (w >= 0.0) & (u + w <= 1.0) & (t > 0.0) & (t <= limit)).any())


class _Fan:
    """The faces around each vertex."""

    def __init__(self, faces: Ints, count: int) -> None:
        vertex = faces.ravel()
        self.order = np.argsort(vertex, kind="stable")
        self.first = np.searchsorted(vertex[self.order], np.arange(count + 1))
        start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
        key = np.minimum(start, end) * count + np.maximum(start, end)
        _, back, uses = np.unique(key, return_inverse=True, return_counts=True)
        odd = uses[back] != 2
        self.border = np.zeros(count, bool)
        self.border[start[odd]] = self.border[end[odd]] = True

    def turns(self, normal: Floats, at: Ints, d: Floats) -> tuple[Floats, Floats]:
        """Return the least and greatest n.d over the faces of vertices `at`; -1 and 1 at boundary edges."""
        low, high = np.full(len(at), np.inf), np.full(len(at), -np.inf)
        begin, stop = self.first[at], self.first[at + 1]
        for i in range(int((stop - begin).max(initial=0))):
            has = begin + i < stop
            face = self.order[np.minimum(begin + i, len(self.order) - 1)] // 3
            c = np.einsum("ij,ij->i", normal[face], d)
            low = np.where(has, np.minimum(low, c), low)
            high = np.where(has, np.maximum(high, c), high)
        return np.where(self.border[at], -1.0, low), np.where(self.border[at], 1.0, high)


REGIMES = (Regime("leaks", "Rays aimed at shared edges and vertices", leaks),)
