"""Measured antenna patterns, and the figures of merit of any antenna."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from raychan.poses import angles, direction
from raychan.radar.antenna import Antenna, check, directions, polarized
from raychan.radar.declared import reals
from raychan.units import undb

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_MOST_BYTES = 100_000_000  # a grid of tenths of a degree over the sphere
_ROUNDED = 1e-3  # rad, by which pi may be rounded in a grid
_CUTS = ("plane", "angle_deg", "gain_dbi")
_SPHERE = ("azimuth_deg", "elevation_deg", "gain_dbi")


class PatternError(ValueError):
    """A pattern file that cannot be used: names file, row and column."""


@dataclass(frozen=True, eq=False)
class MeasuredAntenna:
    """A pattern on a grid of azimuth and elevation, linear in dB between its points and constant beyond its edges.

    Args: azimuth (a,) and elevation (e,) [rad], increasing, within +-pi and +-pi/2; gain_db (a, e) [dBi]; phase (a, e)
    [rad]; polarization V or H. `MeasuredAntenna.load` reads one from a CSV file, in degrees.
    Raises: ValueError for values that cannot be.

    >>> grid = np.radians([-90.0, 0.0, 90.0])
    >>> MeasuredAntenna(grid, grid, np.zeros((3, 3)), np.zeros((3, 3))).polarization
    'V'
    """

    azimuth: Floats
    """Azimuths (a,), increasing [rad]."""
    elevation: Floats
    """Elevations (e,), increasing [rad]."""
    gain_db: Floats
    """Gain (a, e) in dBi."""
    phase: Floats
    """Phase (a, e) [rad]."""
    polarization: str = "V"

    def __post_init__(self) -> None:
        check(self.polarization)
        for name in ("azimuth", "elevation", "gain_db", "phase"):
            value = reals(f"MeasuredAntenna.{name}", getattr(self, name))
            if not np.isfinite(value).all():
                raise ValueError(f"MeasuredAntenna.{name}: finite numbers are wanted")
            value.flags.writeable = False
            object.__setattr__(self, name, value)
        for name, most in (("azimuth", math.pi), ("elevation", 0.5 * math.pi)):
            knots = getattr(self, name)
            far = float(np.abs(knots).max(initial=0.0))
            if far > most + _ROUNDED:
                allowed = f"radians within +-{most:.4g} are wanted, as np.radians gives them of degrees"
                raise ValueError(f"MeasuredAntenna.{name}: holds {far:.6g}; {allowed}")
            if knots.ndim != 1 or len(knots) < 2 or (np.diff(knots) <= 0.0).any():
                raise ValueError(f"MeasuredAntenna.{name}: 2 or more angles [rad] are wanted, increasing")
        wanted = len(self.azimuth), len(self.elevation)
        for name in ("gain_db", "phase"):
            if getattr(self, name).shape != wanted:
                raise ValueError(f"MeasuredAntenna.{name} of shape {getattr(self, name).shape}: {wanted} is wanted")

    @classmethod
    def load(cls, path: str | Path, polarization: str = "V") -> MeasuredAntenna:
        """Read a CSV file: two cuts (plane az|el, angle_deg, gain_dbi) or a full grid.

        A grid has azimuth_deg, elevation_deg, gain_dbi and may have phase_deg. Of two cuts the pattern is their sum
        in dB less the mean of their values at boresight. Beyond its knots a cut or grid keeps its last value.
        Raises: PatternError naming file, row and column.
        """
        path = Path(path)
        if "\0" in str(path):
            raise PatternError(f"path = {str(path)!r}: a name without a zero byte is wanted")
        try:
            if path.exists() and (not path.is_file() or path.stat().st_size > _MOST_BYTES):
                raise PatternError(f"{path}: must be a file of at most {_MOST_BYTES // 1_000_000} MB")
            with open(path, newline="", encoding="utf-8-sig") as file:
                rows = list(csv.DictReader(file, skipinitialspace=True))
                columns = set(rows[0]) if rows else set()
        except (OSError, UnicodeDecodeError, csv.Error) as error:
            raise PatternError(f"{path}: cannot be read: {error}") from error
        if not rows:
            raise PatternError(f"{path}: no rows")
        if columns >= set(_CUTS):
            return _from_cuts(path, rows, polarization)
        if columns >= set(_SPHERE):
            return _from_grid(path, rows, polarization, "phase_deg" in columns)
        raise PatternError(
            f"{path}, row 1: the columns must be {', '.join(_CUTS)} or {', '.join(_SPHERE)}[, phase_deg]"
        )

    def field(self, direction: ArrayLike) -> Complexes:
        """Return sqrt(gain) along theta-hat and phi-hat (n, 2) of unit directions (n, 3)."""
        azimuth, elevation = angles(directions(direction))
        i, s = _place(self.azimuth, azimuth)
        k, t = _place(self.elevation, elevation)
        corners = [
            (i, k, (1 - s) * (1 - t)),
            (i + 1, k, s * (1 - t)),
            (i, k + 1, (1 - s) * t),
            (i + 1, k + 1, s * t),
        ]
        gain = sum(w * self.gain_db[a, e] for a, e, w in corners)
        size = np.sqrt(undb(gain))
        if self.phase.any():
            # Phasors, not angles, are averaged, so that a wrap between two knots does no harm.
            turn = sum(w * np.exp(1j * self.phase[a, e]) for a, e, w in corners)
            size = size * np.exp(1j * np.angle(turn))
        return polarized(size, self.polarization)


def _place(knots: Floats, at: Floats) -> tuple[NDArray[np.int64], Floats]:
    low = np.clip(np.searchsorted(knots, at, side="right") - 1, 0, len(knots) - 2)
    return low, np.clip((at - knots[low]) / (knots[low + 1] - knots[low]), 0.0, 1.0)


def _number(path: Path, row: int, column: str, text: str | None, limit: float = math.inf) -> float:
    try:
        value = float(text or "")
    except ValueError:
        raise PatternError(f"{path}, row {row}, column {column}: {text!r} is not a number") from None
    if not (math.isfinite(value) and abs(value) <= limit):
        allowed = f"must lie within +-{limit:g}" if math.isfinite(limit) else "must be finite"
        raise PatternError(f"{path}, row {row}, column {column}: {value:g} {allowed}")
    return value


def _from_cuts(path: Path, rows: list[dict[str, str]], polarization: str) -> MeasuredAntenna:
    cuts: dict[str, dict[float, float]] = {"az": {}, "el": {}}
    for number, row in enumerate(rows, start=2):
        plane = (row["plane"] or "").strip()
        if plane not in cuts:
            raise PatternError(f"{path}, row {number}, column plane: {plane!r} must be az or el")
        angle = _number(path, number, "angle_deg", row["angle_deg"], 180.0 if plane == "az" else 90.0)
        if angle in cuts[plane]:
            raise PatternError(f"{path}, row {number}, column angle_deg: {angle:g} deg was given before")
        cuts[plane][angle] = _number(path, number, "gain_dbi", row["gain_dbi"])
    for plane, cut in cuts.items():
        if len(cut) < 2:
            raise PatternError(f"{path}, column plane: the cut {plane} needs two rows or more, {len(cut)} given")
    az, el = (np.array(sorted(cut.items())) for cut in cuts.values())
    ahead = 0.5 * (np.interp(0.0, *az.T) + np.interp(0.0, *el.T))
    gain = az[:, 1][:, None] + el[:, 1][None, :] - ahead
    return MeasuredAntenna(np.radians(az[:, 0]), np.radians(el[:, 0]), gain, np.zeros_like(gain), polarization)


def _from_grid(path: Path, rows: list[dict[str, str]], polarization: str, phased: bool) -> MeasuredAntenna:
    known: dict[tuple[float, float], tuple[float, float]] = {}
    for number, row in enumerate(rows, start=2):
        azimuth = _number(path, number, "azimuth_deg", row["azimuth_deg"], 180.0)
        elevation = _number(path, number, "elevation_deg", row["elevation_deg"], 90.0)
        if (azimuth, elevation) in known:
            raise PatternError(
                f"{path}, row {number}: azimuth {azimuth:g}, elevation {elevation:g} deg was given before"
            )
        phase = _number(path, number, "phase_deg", row["phase_deg"]) if phased else 0.0
        known[azimuth, elevation] = _number(path, number, "gain_dbi", row["gain_dbi"]), math.radians(phase)
    az, el = (np.array(sorted({key[i] for key in known})) for i in (0, 1))
    if min(len(az), len(el)) < 2 or len(known) != len(az) * len(el):
        raise PatternError(
            f"{path}: {len(known)} rows do not fill a grid of {len(az)} azimuths by {len(el)} elevations, both >= 2"
        )
    values = np.array([[known[a, e] for e in el] for a in az])
    return MeasuredAntenna(np.radians(az), np.radians(el), values[..., 0], values[..., 1], polarization)


@dataclass(frozen=True)
class Characteristics:
    """Figures of merit of an antenna in its two principal planes; a side lobe is NaN where there is none."""

    gain_dbi: float
    hpbw_h_deg: float
    hpbw_v_deg: float
    sll_h_db: float
    sll_v_db: float


def characteristics(antenna: Antenna) -> Characteristics:
    """Return gain, half-power beam widths and highest side lobes of an antenna, from its pattern.

    Planes: azimuth over the full circle at elevation 0; elevation over the full circle at azimuth 0.
    """
    turn = np.linspace(-np.pi, np.pi, 72_001)
    level = np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=1)
    upright = np.stack([np.cos(turn), np.zeros_like(turn), np.sin(turn)], axis=1)
    with np.errstate(divide="ignore"):
        cuts = [10.0 * np.log10((np.abs(antenna.field(d)) ** 2).sum(axis=1)) for d in (level, upright)]
    widths, lobes = zip(*(_beam(np.degrees(turn), cut) for cut in cuts), strict=True)
    return Characteristics(float(max(cut.max() for cut in cuts)), widths[0], widths[1], lobes[0], lobes[1])


def gain_dbi(antenna: Antenna, azimuth: float = 0.0, elevation: float = 0.0) -> float:
    """Return the gain in dBi towards azimuth and elevation [rad]; -inf where there is none."""
    power = float((np.abs(antenna.field(direction(azimuth, elevation)[None])) ** 2).sum())
    return 10.0 * math.log10(power) if power > 0.0 else -math.inf


def _beam(angle: Floats, cut: Floats) -> tuple[float, float]:
    """Return half-power width [deg] and highest side lobe [dB] of a cut over the full circle."""
    # Among equal peaks (a grating lobe, or a flat pattern) the one nearest to the boresight is the beam.
    top = np.flatnonzero(cut >= cut.max() - 1e-6)
    peak = int(top[np.argmin(np.abs(angle[top]))])
    relative = np.maximum(cut - cut[peak], -300.0)
    half = 10.0 * math.log10(0.5)
    width, lobe = 0.0, -math.inf
    step = float(angle[1] - angle[0])
    for side in (relative[peak:], relative[peak::-1]):
        below = np.flatnonzero(side < half)
        if not len(below):
            return 360.0, math.nan
        i = int(below[0])
        width += step * (i - 1 + float((side[i - 1] - half) / (side[i - 1] - side[i])))
        rising = np.flatnonzero(np.diff(side[i:]) > 1e-9)
        if len(rising):
            lobe = max(lobe, float(side[i + int(rising[0]) :].max()))
    return width, lobe if math.isfinite(lobe) else math.nan
