"""Directions of several plane waves at once: the set that explains most of what an array of any form receives.

Where the elements fill no line or rectangle side lobes are high: the strongest beam of a sum of waves may be that of
none of them, and turns that move one wave at a time then end beside the set that explains most. Sets are sought
here on a grid of beams, with the best partner of each beam by a closed form, and the best of them refined.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.processing.climb_kernels import refine_sets, snapshots_for
from raychan.processing.spectra import BEAMS_PER_BEAM, Beside, beams_of, between, explained_beside, peaks, squared
from raychan.radar.aperture import Aperture

Floats = NDArray[np.float64]
Complexes = NDArray[np.complexfloating[Any, Any]]

FEW = 4
"""Elements to an echo: side lobes of smaller rectangles are high, too. Of 40 threes before 3 x 3, a beam width or more
apart, 3 are wrong without, none with."""
# Sets refined, and sets that lack waves. Three like waves on six of twenty places half a wavelength apart, 60 trials of
# 33 dB: wrong are 16 with 16 and 16, 4 with 16 and 256, 3 with 32 or 64 and 256.
_SETS, _UNFINISHED = 32, 256
_MANY, _FIRST = 128, 256
"""Sets refined, and first beams tried, of few elements to an echo. Of 60 pairs of 36 dB on 6 places in a plane 11 are
wrong with 32 and 52, 10 with 128 and 52, 2 with 32 and 256; of 40 threes on 8 places 14 with 32 and 256, 9 with 128."""
_PER_BEAM = BEAMS_PER_BEAM
"""Of 712 pairs, threes and fours of 33 dB before 6 to 22 places 38 are wrong with 8 to a beam width, 28 with 4."""
_PAIRS = 1 << 18  # of beams tried: all of a line of 30 wavelengths, else those of the strongest beams (not measured)
_SAME = 0.5  # beam widths: sets whose waves are all nearer are one (not measured)
_BATCH = 1 << 22  # beams times sets at once, 32 MB
_ROUNDS = 20  # of refining a set by turns (not measured)
_STILL = 1e-5  # beam widths: a wave that moves less has arrived
_KEPT = 4  # searches kept: a cell's, of one wave more, and of the same again where they are judged (not measured)
_BETTER = 1e-9  # of the power: less is rounding


def joint(data: Complexes, aperture: Aperture, start: Floats) -> Floats:
    """Return the cosines (k, 2) of the k waves that explain most of snapshots (n, a), `start` if none explain more.

    Source: Ziskind and Wax 1988 (alternating projection), from several sets of the grid in place of one."""
    total = float(squared(data).sum())
    best, most = start, explained(data, aperture, start)
    sets, left = candidates(data, aperture, len(start))
    if len(sets) and total - left[0] > most + _BETTER * total:
        best, most = sets[0].copy(), total - float(left[0])
    return _searched_anew(data, aperture, best, most, _BETTER * total)


def candidates(data: Complexes, aperture: Aperture, count: int) -> tuple[Floats, Floats]:
    """Return sets (s, count, 2) of waves that explain most of snapshots (n, a), each refined, and the power (s,) that
    they leave, least first."""
    return _kept(data.tobytes(), len(data), aperture, count)


@lru_cache(maxsize=_KEPT)
def _kept(data: bytes, rows: int, aperture: Aperture, count: int) -> tuple[Floats, Floats]:
    """Return what `candidates` does, by the bytes of the snapshots: those who judge a cell ask again."""
    snapshots = np.frombuffer(data, np.complex128).reshape(rows, -1).copy()
    sets = _on_grid(snapshots, aperture, count)
    left = _refine(snapshots, aperture, sets)
    order = np.argsort(left, kind="stable")
    return sets[order], left[order]


def explained(data: Complexes, aperture: Aperture, at: Floats) -> float:
    """Return the power that waves from cosines (k, 2) explain of snapshots (n, a), by least squares."""
    return float(squared(data @ _basis(aperture.steering(at)).conj().T).sum())


def _basis(waves: Complexes) -> Complexes:
    """Return orthonormal rows (k, a) that span waves (k, a)."""
    return np.asarray(np.linalg.qr(waves.T)[0].T)


def _beside(data: Complexes, aperture: Aperture, others: Floats) -> Beside:
    """Return the power that a wave explains of snapshots (n, a) beside others from cosines (k, 2)."""
    basis = _basis(aperture.steering(others))
    return Beside(data - (data @ basis.conj().T) @ basis, basis)


def _on_grid(data: Complexes, aperture: Aperture, count: int) -> Floats:
    """Return sets of beams (s, count, 2) on a grid that explain most of snapshots (n, a)."""
    beams = aperture.spread(_PER_BEAM) if aperture.deep else aperture.grid(_PER_BEAM).points
    size = len(aperture.elements)
    slack = 2.0 * between(aperture, _PER_BEAM) * float(squared(data).sum())
    values = explained_beside(data[None], np.zeros((1, 0, size), complex), aperture, beams)[:, 0]
    refined, first = (_MANY, _FIRST) if size <= FEW * count else (_SETS, _SETS)
    rows = np.argsort(-values, kind="stable")[: max(first, _PAIRS // len(beams))]
    sets, values = beams[rows, None], values[rows]
    for held in range(1, count):
        last = held + 1 == count
        kept = refined if last else _UNFINISHED
        some, more = _with_each(data, aperture, beams, sets, values, slack if last else np.inf)
        sets, values = _longer(aperture, some, sets, more, kept, slack if last else np.inf)
    return sets


def _with_each(
    data: Complexes, aperture: Aperture, beams: Floats, sets: Floats, values: Floats, slack: float
) -> tuple[Floats, Floats]:
    """Return those (b, 2) of beams that may add most to sets (s, k, 2) of values (s,), and what sets explain of
    snapshots (n, a) with each of them (s, b): all within `slack` of the most, as far as memory allows."""
    bases = np.array([_basis(aperture.steering(at)) for at in sets])
    rests = data - (data @ bases.conj().transpose(0, 2, 1)) @ bases
    found, gained, tops = np.zeros((0, 2)), np.zeros((0, len(sets))), np.zeros(0)
    batch = max(1, _BATCH // len(sets))
    for some in (beams[i : i + batch] for i in range(0, len(beams), batch)):
        more = values + explained_beside(rests, bases, aperture, some)
        found, gained, tops = (np.concatenate(x) for x in ((found, some), (gained, more), (tops, more.max(axis=1))))
        if len(found) > batch:
            near = tops > tops.max() - slack
            found, gained, tops = found[near], gained[near], tops[near]
            if len(found) > batch:
                most = np.sort(np.argsort(-tops, kind="stable")[:batch])
                found, gained, tops = found[most], gained[most], tops[most]
    return found, np.ascontiguousarray(gained.T)


def _longer(
    aperture: Aperture, beams: Floats, sets: Floats, values: Floats, kept: int, slack: float
) -> tuple[Floats, Floats]:
    """Return at most `kept` sets (s, k + 1, 2) of highest values, at most `slack` below the first, and these, from sets
    (r, k, 2) and their values (r, b) with one more of beams (b, 2)."""
    found: list[Floats] = []
    most: list[float] = []
    # The best beam of each set is found again only where some of its beams were taken away.
    columns, tops = values.argmax(axis=1), values.max(axis=1)
    beside: dict[bytes, NDArray[np.bool_]] = {}
    least = max(0.0, tops.max(initial=0.0) - slack)
    while len(found) < kept and tops.max(initial=0.0) > least:
        row = int(tops.argmax())
        column = columns[row]
        most.append(float(tops[row]))
        found.append(np.concatenate([sets[row], beams[column, None]]))
        near = aperture.apart(sets[:, :, None], found[-1]) < _SAME
        # Found again are those that lack one wave of it, with a beam near to that.
        for lacked, wave in enumerate(found[-1]):
            same = np.flatnonzero(np.asarray(np.delete(near, lacked, axis=2).any(axis=2)).all(axis=1))
            if (key := wave.tobytes()) not in beside:
                beside[key] = aperture.apart(beams, wave) < _SAME
            values[np.ix_(same, beside[key])] = 0.0
            columns[same], tops[same] = values[same].argmax(axis=1), values[same].max(axis=1)
    return np.array(found).reshape(-1, sets.shape[1] + 1, 2), np.array(most)


def _refine(data: Complexes, aperture: Aperture, sets: Floats) -> Floats:
    """Move the waves of sets (s, k, 2) by turns to where they explain most of snapshots (n, a); return what sets leave
    (s,)."""
    width = np.where(np.isfinite(aperture.beamwidth), aperture.beamwidth, 1.0)
    left, beams = np.empty(len(sets)), beams_of(aperture, aperture.grid(_PER_BEAM))
    refine_sets(sets, left, snapshots_for(data), beams, _ROUNDS, _STILL * width)
    return left


def _searched_anew(data: Complexes, aperture: Aperture, at: Floats, value: float, least: float) -> Floats:
    """Return cosines (k, 2) of which none, sought anew over all directions, explains more beside the others."""
    for _ in range(_ROUNDS):
        for k in range(len(at)):
            form = _beside(data, aperture, np.delete(at, k, axis=0))
            tried = at.copy()
            tried[k] = peaks(form, aperture, 1)[0]
            if explained(data, aperture, tried) > value + least:
                _refine(data, aperture, tried[None])
                at, value = tried, explained(data, aperture, tried)
                break
        else:
            break
    return at
