"""Kernels that find maxima next to directions: of Bartlett's spectrum, of one echo or of several by turns, and of what
a wave explains beside others (see processing.spectra and processing.doa)."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.processing.fold_kernels import canonical, make_visible, solve_in_place

Floats = NDArray[np.float64]

ALONE = 0.1  # of a beam's power that others must leave it: as a quarter of a beam width does (not measured)
_RIDGE = 1e-13  # of a wave's power: waves that come to lie on each other have amplitudes nevertheless (not measured)


class Beams(NamedTuple):
    """Beams as kernels take them: parts (p, a, 3) [waves], of which places are the sums; distance [waves] of the
    sources, infinite of plane waves; period (2,), infinite where directions do not repeat along y
    or z; skewed (l, 2) lobes quite like the main one; steps (2, 2), the first distances of a search, one along each of
    two axes, 0 along one that is not measured; how often they are halved; whether the array is deep; whether it
    measures both cosines."""

    parts: Floats
    distance: float
    period: Floats
    skewed: Floats
    steps: Floats
    shrinks: int
    deep: bool
    both: bool


@njit(cache=True, nogil=True)
def _point(wave, beams, u, w):  # type: ignore[no-untyped-def]
    """Write the phasors (a,) of a wave from cosines u and w along y and z."""
    ahead, away = math.sqrt(max(1.0 - u * u - w * w, 0.0)), beams.distance
    for i in range(len(wave)):
        nearer = 0.0
        for places in beams.parts:
            x, y, z = places[i, 0], places[i, 1], places[i, 2]
            along = x * ahead + y * u + z * w
            if away < math.inf:
                over = 2.0 * away * along - (x * x + y * y + z * z)
                along = over / (away + math.sqrt(max(away * away - over, 0.0)))
            nearer += along
        phase = 2.0 * math.pi * nearer
        wave[i] = complex(math.cos(phase), math.sin(phase))


@njit(cache=True, nogil=True)
def _seen(rows, wave):  # type: ignore[no-untyped-def]
    """Return the sum of the powers that a beam towards a wave (a,) sees of rows (n, a)."""
    total = 0.0
    for n in range(len(rows)):
        seen = 0j
        for i in range(len(wave)):
            seen += wave[i].conjugate() * rows[n, i]
        total += seen.real**2 + seen.imag**2
    return total


@njit(cache=True, nogil=True)
def _power(snapshots, basis, beams, u, w, wave):  # type: ignore[no-untyped-def]
    """Return the power that a wave from cosines u and w explains of snapshots (n, a) beside others of orthonormal rows
    basis (k, a); scratch: wave (a,)."""
    _point(wave, beams, u, w)
    alone = len(wave) - _seen(basis, wave)
    return _seen(snapshots, wave) / alone if alone > ALONE * len(wave) else 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def gains_beside(gains, at, rests, bases, beams):  # type: ignore[no-untyped-def]
    """Write the power (b, s) that waves from cosines at (b, 2) explain beside each of sets of others, of which
    orthonormal rows bases (s, k, a) are and which leave snapshots rests (s, n, a). Args: beams as `Beams`."""
    wave = np.empty(beams.parts.shape[1], np.complex128)
    for b in range(len(at)):
        _point(wave, beams, at[b, 0], at[b, 1])
        for s in range(len(rests)):
            alone = len(wave) - _seen(bases[s], wave)
            gains[b, s] = _seen(rests[s], wave) / alone if alone > ALONE * len(wave) else 0.0


@njit(cache=True, nogil=True)
def _moved(u, w, axis, steps, beams):  # type: ignore[no-untyped-def]
    """Return cosines u and w moved along an axis by so many of its first steps, of a deep array as Aperture.moved
    does."""
    over, up = steps * beams.steps[axis, 0], steps * beams.steps[axis, 1]
    if not beams.deep:
        return u + over, w + up
    by = over if axis == 0 else up
    size = math.sqrt(u * u + w * w) if beams.both else (u if axis == 0 else w)
    along, aside = (1.0, 0.0) if axis == 0 or beams.both else (0.0, 1.0)
    if beams.both and size > 0.0:
        along, aside = u / size, w / size
    if beams.both and axis == 1:
        return u * math.cos(by) - aside * math.sin(by), w * math.cos(by) + along * math.sin(by)
    turned = math.sin(min(max(math.asin(min(max(size, -1.0), 1.0)) + by, -0.5 * math.pi), 0.5 * math.pi))
    return along * turned, aside * turned


@njit(cache=True, nogil=True)
def _climb(at, snapshots, basis, beams, wave, tried):  # type: ignore[no-untyped-def]
    """Move cosines at (2,) to the maximum next to them of `_power`, and return that; scratch: wave (a,), tried (2,)."""
    period, skewed = beams.period, beams.skewed
    best = _power(snapshots, basis, beams, at[0], at[1], wave)
    for s in range(beams.shrinks):
        for axis in range(2):
            step = 0.5**s
            if beams.steps[axis, 0] == 0.0 and beams.steps[axis, 1] == 0.0:
                continue
            # Beyond the visible edge the power goes on as smoothly, or as it does at the other edge.
            u, w = _moved(at[0], at[1], axis, -step, beams)
            u, w = canonical(u, w, period, skewed)
            below = _power(snapshots, basis, beams, u, w, wave)
            u, w = _moved(at[0], at[1], axis, step, beams)
            u, w = canonical(u, w, period, skewed)
            above = _power(snapshots, basis, beams, u, w, wave)
            bend = below - 2.0 * best + above
            shift = 0.5 * (below - above) / bend if bend < 0.0 else np.sign(above - below)
            tried[0], tried[1] = _moved(at[0], at[1], axis, min(max(shift, -1.0), 1.0) * step, beams)
            make_visible(tried, period, skewed)
            value = _power(snapshots, basis, beams, tried[0], tried[1], wave)
            if value > best:
                best, at[0], at[1] = value, tried[0], tried[1]
    return best


@njit(cache=True, nogil=True, error_model="numpy")
def climb_beams(at, best, snapshots, basis, beams):  # type: ignore[no-untyped-def]
    """Move cosines at (k, 2) to the maxima next to them of what a wave explains, and write that, best (k,).

    Args: snapshots (n, a), which others of orthonormal rows basis (m, a) leave; beams as `Beams`."""
    wave, tried = np.empty(beams.parts.shape[1], np.complex128), np.empty(2)
    for k in range(len(at)):
        best[k] = _climb(at[k], snapshots, basis, beams, wave, tried)


@njit(cache=True, nogil=True)
def _all_but(own, rest, snapshots, waves, gram, amplitude):  # type: ignore[no-untyped-def]
    """Write what waves (k, a), fitted to snapshots (n, a) by least squares, leave of them, and wave `own` with it;
    scratch: gram (k, k), amplitude (k,)."""
    count, many = waves.shape
    for n in range(len(snapshots)):
        for j in range(count):
            amplitude[j] = 0.0
            for i in range(many):
                amplitude[j] += waves[j, i].conjugate() * snapshots[n, i]
            for m in range(count):
                gram[j, m] = _RIDGE * many if j == m else 0.0
                for i in range(many):
                    gram[j, m] += waves[j, i].conjugate() * waves[m, i]
        solve_in_place(gram, amplitude)
        for i in range(many):
            rest[n, i] = snapshots[n, i]
            for j in range(count):
                if j != own:
                    rest[n, i] -= amplitude[j] * waves[j, i]


@njit(cache=True, nogil=True, error_model="numpy")
def refine_beams(at, snapshots, beams, rounds, still):  # type: ignore[no-untyped-def]
    """Move cosines at (k, 2) by turns, each to the maximum of the power that the others' waves leave of snapshots
    (n, a), until none moves by more than `still` (2,), but at most `rounds` times. Args: beams as `Beams`."""
    count, many = len(at), beams.parts.shape[1]
    waves, wave, tried = np.empty((count, many), np.complex128), np.empty(many, np.complex128), np.empty(2)
    gram, amplitude = np.empty((count, count), np.complex128), np.empty(count, np.complex128)
    rest, before, none = np.empty_like(snapshots), np.empty_like(at), np.empty((0, many), np.complex128)
    for k in range(count):
        _point(waves[k], beams, at[k, 0], at[k, 1])
    for _ in range(rounds):
        before[:] = at
        for k in range(count):
            _all_but(k, rest, snapshots, waves, gram, amplitude)
            _climb(at[k], rest, none, beams, wave, tried)
            _point(waves[k], beams, at[k, 0], at[k, 1])
        moved = False
        for k in range(count):
            moved |= abs(at[k, 0] - before[k, 0]) >= still[0] or abs(at[k, 1] - before[k, 1]) >= still[1]
        if not moved:
            break


@njit(cache=True, nogil=True)
def _outside(own, basis, rest, snapshots, waves):  # type: ignore[no-untyped-def]
    """Write orthonormal rows basis (k, a) that span waves (k, a) but for wave `own` (none if -1), 0 for one that the
    others span, and what they leave of snapshots (n, a); return the power of that."""
    total = 0.0
    for j in range(len(waves)):
        basis[j] = waves[j] * (0.0 if j == own else 1.0)
        for m in range(j):
            shared = 0j
            for i in range(waves.shape[1]):
                shared += basis[m, i].conjugate() * basis[j, i]
            for i in range(waves.shape[1]):
                basis[j, i] -= shared * basis[m, i]
        size = 0.0
        for i in range(waves.shape[1]):
            size += basis[j, i].real ** 2 + basis[j, i].imag ** 2
        for i in range(waves.shape[1]):
            basis[j, i] = basis[j, i] / math.sqrt(size) if size > _RIDGE * waves.shape[1] else 0j
    for n in range(len(snapshots)):
        rest[n] = snapshots[n]
        for j in range(len(waves)):
            seen = 0j
            for i in range(waves.shape[1]):
                seen += basis[j, i].conjugate() * rest[n, i]
            for i in range(waves.shape[1]):
                rest[n, i] -= seen * basis[j, i]
        for i in range(waves.shape[1]):
            total += rest[n, i].real ** 2 + rest[n, i].imag ** 2
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def refine_sets(at, left, snapshots, beams, rounds, still):  # type: ignore[no-untyped-def]
    """Move the waves of sets at (s, k, 2) by turns, each to where it explains most of snapshots (n, a) beside the
    others, until none moves by more than `still` (2,), but at most `rounds` times; write what sets leave, left (s,)."""
    sets, count = at.shape[:2]
    many = beams.parts.shape[1]
    waves, basis = np.empty((count, many), np.complex128), np.empty((count, many), np.complex128)
    wave, tried = np.empty(many, np.complex128), np.empty(2)
    rest, before = np.empty_like(snapshots), np.empty((count, 2))
    for s in range(sets):
        for k in range(count):
            _point(waves[k], beams, at[s, k, 0], at[s, k, 1])
        for _ in range(rounds):
            before[:] = at[s]
            for k in range(count):
                _outside(k, basis, rest, snapshots, waves)
                _climb(at[s, k], rest, basis, beams, wave, tried)
                _point(waves[k], beams, at[s, k, 0], at[s, k, 1])
            moved = False
            for k in range(count):
                moved |= abs(at[s, k, 0] - before[k, 0]) >= still[0] or abs(at[s, k, 1] - before[k, 1]) >= still[1]
            if not moved:
                break
        left[s] = _outside(-1, basis, rest, snapshots, waves)


def snapshots_for(data: NDArray[Any]) -> NDArray[np.complex128]:
    """Return snapshots (n, a) as kernels take them."""
    return np.ascontiguousarray(data, np.complex128)
