"""Slow time: lengths and gains of traced routes at later instants, after their bodies have moved; no ray is traced.

A footprint moves with its body; the lengths through its corners and the phase integral over it are computed again for
each instant. Over plane mirrors a length is that to the image points of both ends in the planes as they then lie: exact
for any turn as long as the same surfaces are met and seen. A curved mirror is replaced by its tangent plane at the
vertex. Waves spread as their ways to and from the scatterer grow; obliquity keeps its value at the time of tracing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.channel.fields_along import mirrored, slot
from raychan.channel.transfer import transfer
from raychan.compile.jit import njit
from raychan.em.phase_integral import triangle_terms
from raychan.parallel import parallel_for
from raychan.records import REFLECT, SCATTER, Facets, Routes
from raychan.units import C0
from raychan.vectors import copy_to, distance, less, row

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
_LINEAR = 1e-4  # rad: a part of a footprint is integrated in closed form if its phase is linear to this (not measured)


@dataclass(frozen=True)
class Poses:
    """Poses of bodies and radar at instants t: a point x of body b moves to turn[t, b] @ (x - origin[b]) +
    place[t, b]."""

    origin: Floats
    """Body origins (b, 3) [m] at the time of tracing."""
    turn: Floats
    """Rotations (t, b, 3, 3) since then."""
    place: Floats
    """Body origins (t, b, 3) [m]."""
    tx: Floats
    """Where the waves start (t, 3) [m]."""
    rx: Floats
    """Where they end (t, 3) [m]."""


_SOON = 1e-4  # s: interval of the difference quotient that gives a rate; its error is far below a rate cell


def corner_rates(
    routes: Routes, rows: NDArray[np.int64], facets: Facets, tx_velocity: Floats, rx_velocity: Floats
) -> Floats:
    """Return range rates (r, 3) [m/s] through the corners of some footprints: half the rate of the route's length.

    Rates differ over a body that turns or crosses. The terms of neighbouring tubes at a shared corner cancel; over slow
    time they cancel only if both have the rate of that corner.
    Args: rows (r,) of the routes; tx_velocity, rx_velocity (3,) [m/s] of the ends.
    """
    late = _SOON * np.array([-0.5, 0.5])[:, None, None]
    poses = Poses(
        origin=facets.origin,
        turn=np.array([[_turned(s) for s in t * facets.spin] for t in late]).reshape(2, -1, 3, 3),
        place=facets.origin + late * facets.velocity,
        tx=routes.tx + late[:, 0] * np.asarray(tx_velocity, float),
        rx=routes.rx + late[:, 0] * np.asarray(rx_velocity, float),
    )
    out = np.empty((len(rows), 3))

    def some(at: slice) -> None:
        _corner_rates(
            rows[at], routes.vertices, routes.normals, routes.kind, routes.body, routes.scatter, routes.points,
            poses.origin, poses.turn, poses.place, poses.tx, poses.rx, out[at],
        )  # fmt: skip

    parallel_for(len(rows), some)
    return out


def _turned(turn: Floats) -> Floats:
    """Return the matrix (3, 3) of a small turn [rad] about a vector, to second order."""
    x, y, z = turn
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + cross + 0.5 * cross @ cross


def strengths(routes: Routes, facets: Facets, radar: Any, frequency: float) -> Complexes:
    """Return the gains (n, 3) of routes at the corners of their footprints, with neither carrier phase nor the phase
    integral over these: their sum is the mean. Without a footprint the first is the gain."""
    n = len(routes.kind)
    bare: Routes = routes.replace(lengths=np.zeros((n, 6)), length=np.zeros(n), taper=np.ones((n, 3)))
    ends: list[Any] = [lambda d, f=f: np.asarray(f(d))[:, None] for f in (radar.tx_field, radar.rx_field)]
    gain = transfer(bare, facets, frequency, *ends, corners=True)[:, 0, 0]
    # The air's loss hardly changes within a frame: 1 m of path is 0.001 dB, in the heaviest rain 0.03 dB.
    return gain * np.exp(-facets.attenuation * routes.length)[:, None] if facets.attenuation else gain


def extrapolated(routes: Routes, strength: Complexes, poses: Poses, frequency: float) -> tuple[Floats, Complexes]:
    """Return lengths [m] and amplitudes (t, n, 3) of routes at later instants, a part for each corner of the footprint.

    Routes without a footprint, or with one that is short in range at all instants, have a single part: the others have
    amplitude 0. A route's parts are the same at all instants, so that its lengths have no jumps: these would be rates.
    Args: strength (n, 3) from `strengths`; poses of bodies and radar at the instants; frequency [Hz].
    """
    shape = (len(poses.tx), len(routes.kind), 3)
    lengths, amplitudes = np.empty(shape), np.empty(shape, np.complex128)
    columns = (
        routes.vertices, routes.normals, routes.kind, routes.body, routes.scatter, routes.points, routes.lengths,
        routes.length, routes.taper, strength,
    )  # fmt: skip
    when = poses.origin, poses.turn, poses.place, poses.tx, poses.rx, 2.0 * np.pi * frequency / C0

    def some(rows: slice) -> None:
        _carry(*(routes.tx, routes.rx, *(c[rows] for c in columns), *when, lengths[:, rows], amplitudes[:, rows]))

    parallel_for(shape[1], some)
    return lengths, amplitudes


@njit(cache=True, forceinline=True, uncounted=True)
def _moved(x, b, t, origin, turn, place):  # type: ignore[no-untyped-def]
    """Return where a point that moves with body b is at instant t."""
    x = _turned_by(less(x, row(origin, b)), t, b, turn)
    return x[0] + place[t, b, 0], x[1] + place[t, b, 1], x[2] + place[t, b, 2]


@njit(cache=True, forceinline=True, uncounted=True)
def _turned_by(x, t, b, turn):  # type: ignore[no-untyped-def]
    """Return a vector of body b at instant t."""
    return (
        turn[t, b, 0, 0] * x[0] + turn[t, b, 0, 1] * x[1] + turn[t, b, 0, 2] * x[2],
        turn[t, b, 1, 0] * x[0] + turn[t, b, 1, 1] * x[1] + turn[t, b, 1, 2] * x[2],
        turn[t, b, 2, 0] * x[0] + turn[t, b, 2, 1] * x[1] + turn[t, b, 2, 2] * x[2],
    )


@njit(cache=True, forceinline=True, uncounted=True)
def _part_lengths(vertices, normals, kind, body, points, i, at, used, t, origin, turn, place, tx, rx, out):  # type: ignore[no-untyped-def]
    """Write the lengths (p + 1,) [m] at instant t of route i, which has `used` slots, through the first p points of its
    footprint in slot `at`, and through its vertex there; return over what its wave spreads: the product of the ways to
    that vertex and from it [m^2], without a vertex the length [m]."""
    forth, back = row(tx, t), row(rx, t)
    last = len(out) - 1
    for j in range(at):
        if kind[i, j] == REFLECT:
            n = _turned_by(slot(normals, i, j), t, body[i, j], turn)
            forth = mirrored(forth, _moved(slot(vertices, i, j), body[i, j], t, origin, turn, place), n)
    if at == used:
        for c in range(len(out)):
            out[c] = distance(forth, back)
        return out[last]
    for j in range(used - 1, at, -1):
        if kind[i, j] == REFLECT:
            n = _turned_by(slot(normals, i, j), t, body[i, j], turn)
            back = mirrored(back, _moved(slot(vertices, i, j), body[i, j], t, origin, turn, place), n)
    b = body[i, at]
    centre = _moved(slot(vertices, i, at), b, t, origin, turn, place)
    there, again = distance(forth, centre), distance(back, centre)
    out[last] = there + again
    for c in range(last):
        out[c] = out[last]
        if kind[i, at] == SCATTER:
            p = _moved(slot(points, i, c), b, t, origin, turn, place)
            out[c] = distance(forth, p) + distance(back, p)
    return there * again


@njit(cache=True, nogil=True)
def _corner_rates(  # type: ignore[no-untyped-def]
    rows, vertices, normals, kind, body, scatter, points, origin, turn, place, tx, rx, out
):
    _each_rate(
        rows, vertices, normals, kind, body, scatter, points, origin, turn, place, tx, rx, out, np.empty(4), np.empty(4)
    )


@njit(cache=True, uncounted=True)
def _each_rate(  # type: ignore[no-untyped-def]
    rows, vertices, normals, kind, body, scatter, points, origin, turn, place, tx, rx, out, now, then
):
    """Do what `_corner_rates` does, with room for lengths (4,) now and then."""
    d = kind.shape[1]
    for r in range(len(rows)):
        i = rows[r]
        used = 0
        while used < d and kind[i, used] > 0:
            used += 1
        for t in range(2):
            _part_lengths(
                vertices, normals, kind, body, points, i, scatter[i], used, t, origin, turn, place, tx, rx, now
            )
            if t == 0:
                copy_to(then, now)
        for c in range(3):
            out[r, c] = 0.5 * (now[c] - then[c]) / _SOON


APART = 3e-4
"""m of path: a footprint whose corners and centre differ by more gives each corner its own delay (cost not measured).
Over slow time the centre counts, too: of a tall one seen at half its height the corners are alike, and the middle is
nearer. In `channel.paths`, at one instant, the corners decide: plates of 1 and 2 m at 10 m, so seen over 1 to 4 GHz,
are as far from their sums over points with the centre as without (within 0.1 dB, at -33 to -60 dB)."""


@njit(cache=True, nogil=True)
def _carry(  # type: ignore[no-untyped-def]
    tx, rx, vertices, normals, kind, body, scatter, points, lengths, length, taper, strength, origin, turn, place, txs,
    rxs, k, out_lengths, out,
):  # fmt: skip
    n, d = kind.shape
    still = np.zeros((1, origin.shape[0], 3, 3))
    for b in range(origin.shape[0]):
        still[0, b, 0, 0] = still[0, b, 1, 1] = still[0, b, 2, 2] = 1.0
    here, end, ending = origin.reshape((1, *origin.shape)), tx.reshape((1, 3)), rx.reshape((1, 3))
    now, then, phases, terms = np.empty(7), np.empty(7), np.empty(6), np.empty(3, np.complex128)
    centres = np.empty((2, txs.shape[0]))
    for i in range(n):
        used = 0
        while used < d and kind[i, used] > 0:
            used += 1
        at = scatter[i] if scatter[i] >= 0 else used
        spread = _part_lengths(
            vertices, normals, kind, body, points, i, at, used, 0, origin, still, here, end, ending, then
        )  # fmt: skip
        # Within half a wavelength waves grow no more.
        least = min(spread, (np.pi / k) ** (1 + (at < used)))
        wide = at < used and kind[i, at] == SCATTER
        split = False
        for t in range(txs.shape[0]):
            over = _part_lengths(
                vertices, normals, kind, body, points, i, at, used, t, origin, turn, place, txs, rxs, now
            )  # fmt: skip
            centre = length[i] + now[6] - then[6]
            centres[0, t], centres[1, t] = centre, spread / max(over, least)
            if not wide:
                continue
            low, high = centre, centre
            for c in range(6):
                total = lengths[i, c] + now[c] - then[c]
                phases[c] = k * total
                if c < 3:
                    out_lengths[t, i, c] = total
                    low, high = min(low, total), max(high, total)
            split = split or high - low > APART
            triangle_terms(phases, _LINEAR, terms)
            for c in range(3):
                out[t, i, c] = 3.0 * centres[1, t] * strength[i, c] * taper[i, c] * terms[c]
        if split:
            continue
        for t in range(txs.shape[0]):
            if wide:
                whole = out[t, i, 0] + out[t, i, 1] + out[t, i, 2]
            else:
                whole = centres[1, t] * strength[i, 0] * np.exp(-1j * k * centres[0, t])
            out_lengths[t, i, :] = centres[0, t]
            out[t, i, :] = 0.0
            out[t, i, 0] = whole
