"""Folding: whether an echo appears in a map at its true place, at an alias, or as a mirror image of real sampling."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.records import Complexes, Detections, Paths, RangeDoppler
from raychan.run.explanation.point_spread import PointSpread
from raychan.units import C0

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_NEAR = 4.0  # resolution cells: wider than the main lobe of any window; farther paths add by side lobes only
_EQUAL = 1.0 + 1e-6  # factor on the power of unfolded places, so that they win over equal folded ones


@dataclass(frozen=True)
class Truth:
    """True place of the paths behind a cell: range [m] at mid frame and range rate [m/s]; NaN where unknown."""

    range: float = math.nan
    rate: float = math.nan
    folded: bool = False
    """Whether they appear elsewhere: at an alias, or as a mirror image of real sampling."""


UNKNOWN = Truth()


@dataclass(frozen=True)
class Shown:
    """A place in the map, range [m] and rate [m/s] (None for one in the profile), and the rate reported for it."""

    range: float
    rate: float | None
    at_rate: float


def peaks_of(found: Detections, rdmap: RangeDoppler, response: PointSpread) -> Floats:
    """Return where in the map detections (d,) peak, between its cells: ranges [m] and rates [m/s] (d, 2). What the
    receiver took off the range of a folded rate is put back: peaks stand where the beat does."""
    folded = response.periods[1] * np.rint((found.rate - rdmap.rate[found.cell[:, 0]]) / response.periods[1])
    return np.stack([found.range + folded * response.drift, found.rate - folded], axis=1)


def truth(paths: Paths, rows: Ints, strongest: int, response: PointSpread, shown: Shown) -> Truth:
    """Return the true place of the paths of one chain that feed a cell.

    Of all places that alias to the cell it is the one with most power; range and rate are power-weighted means over the
    paths there. Args: rows of the chain's paths; strongest, the row that contributes most to the cell.
    """
    found: list[tuple[float, Truth]] = []
    for mirrored in (False, True) if response.mirrors and shown.rate is not None else (False,):
        folds, near = ambiguities(paths, rows, response, shown, mirrored)
        taken = rows[near]
        side_lobe = not near.any()
        if side_lobe:  # of the strongest path; it reaches round the ends of the map without being folded
            taken, folds, near = np.array([strongest]), np.zeros((1, 2), np.int64), np.ones(1, bool)
        power = _powers(paths, taken, response, shown, mirrored)
        at, rate = response.stands(*_moving(paths, taken), shown.rate is not None)
        folds = folds[near]
        # As a rule all are at one place, which sorting them takes longest to tell.
        alone = bool((folds == folds[0]).all())
        places, place = (
            (folds[:1], np.zeros(len(folds), int)) if alone else np.unique(folds, axis=0, return_inverse=True)
        )
        for i, whole in enumerate(places):
            weight = power * (place.ravel() == i)
            total = float(weight.sum())
            if total > 0.0:
                folded = _outside(at[0], rate[0], response, shown) if side_lobe else mirrored or bool(whole.any())
                found.append((total, Truth(float(weight @ at) / total, float(weight @ rate) / total, folded)))
    # Of equal ones (a target at range 0 is its own mirror image) the unfolded place.
    return max(found, key=lambda one: one[0] * (1.0 if one[1].folded else _EQUAL), default=(0.0, UNKNOWN))[1]


def _outside(at: float, rate: float, response: PointSpread, shown: Shown) -> bool:
    """Return whether the peak of an echo at a range [m] and rate [m/s] is folded, one of whose side lobes is shown."""
    if not 0.0 <= at <= response.periods[0] / (2.0 if response.mirrors else 1.0):
        return True
    # A receiver that tells folds apart may have counted some.
    period = response.periods[1]
    return shown.rate is not None and round(rate / period) != round((shown.at_rate - shown.rate) / period)


def aliased(at: Floats, shown: float, response: PointSpread) -> tuple[Floats, NDArray[np.bool_]]:
    """Return the distance (n,) [m] of the nearest alias of echoes at ranges `at` (n,) [m] from a range shown [m], and
    whether that alias is folded."""
    period = response.periods[0]
    signs = np.array([[1.0], [-1.0]] if response.mirrors else [[1.0]])
    off = signs * at - shown
    whole = np.rint(off / period)
    away = np.abs(off - whole * period)
    near, row = np.argmin(away, axis=0), np.arange(len(at))
    return away[near, row], (whole[near, row] != 0.0) | (near > 0)


def _moving(paths: Paths, rows: Ints) -> tuple[Floats, Floats]:
    """Return the delays (n,) [s] and range rates (n,) [m/s] of some paths."""
    return paths.length[rows] / C0, 0.5 * paths.length_rate[rows]


def ambiguities(
    paths: Paths, rows: Ints, response: PointSpread, shown: Shown, mirrored: bool, reach: Any = _NEAR
) -> tuple[Ints, NDArray[np.bool_]]:
    """Return the ambiguity numbers (n, 2) of range and rate between paths and the place shown, and whether the paths
    lie within the main lobe about it, `reach` resolution cells, once these are removed."""
    at, rate = response.stands(*_moving(paths, rows), shown.rate is not None)
    sign = -1.0 if mirrored else 1.0
    away, smear = np.zeros((len(rows), 2)), np.zeros(len(rows))
    away[:, 0] = sign * at - shown.range
    if shown.rate is not None:
        # Each row of the map is corrected for its own Doppler within the ramp; other rates keep the difference.
        away[:, 0] += (sign * rate - shown.rate) * response.drift
        away[:, 1] = sign * rate - shown.at_rate
        # An echo that migrates over range cells spreads over as many rate cells.
        smear = 0.5 * np.abs(rate) * response.waveform.frame_duration / response.resolutions[0]
    whole = np.rint(away / response.periods)
    rest = np.abs(away - whole * response.periods) / response.resolutions
    return whole.astype(np.int64), np.asarray((rest <= reach + smear[:, None]).all(axis=1))


def _powers(paths: Paths, rows: Ints, response: PointSpread, shown: Shown, mirrored: bool) -> Floats:
    """Return the powers (n,) that paths, or their mirror images, contribute to the cell shown."""
    return np.abs(waves_shown(paths, rows, paths.amplitude[rows], response, shown, mirrored)) ** 2


def waves_shown(
    paths: Paths, rows: Ints, amplitude: Complexes, response: PointSpread, shown: Shown, mirrored: bool
) -> Complexes:
    """Return what paths of such amplitudes (n,) contribute to the cell shown; of mirror images the conjugate."""
    delay, rate = _moving(paths, rows)
    if shown.rate is None:
        return amplitude * response.in_profile(delay, shown.range)[0]
    sign = -1.0 if mirrored else 1.0
    return response.image_in_cell(amplitude, delay, rate, sign * shown.range, sign * shown.rate)[0]
