"""One detection through several runs of nearly the same scene: matched by range, range rate and bodies."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from raychan.run.explanation.labels import whole
from raychan.run.result import Result
from raychan.units import dbm

Floats = NDArray[np.float64]

GATE = 1.5
"""Cells of range and of range rate within which a detection may be the same: the peak of two echoes in one cell moves
by up to a cell as their phases turn (not measured)."""
NOISE = "noise"


@dataclass(frozen=True)
class Sighting:
    """A detection in one run. `level_dbm` is of its paths alone: the thermal noise is not in it."""

    range: float
    rate: float
    azimuth: float
    level_dbm: float
    error_db: float
    label: str
    bodies: str
    """The leading chain."""
    met: frozenset[str]
    """The bodies of all chains in its cell: of equal echoes in one cell, their phases decide which leads."""


@dataclass
class Track:
    """A detection through runs: the first sighting, and all by the number of their run."""

    first: Sighting
    seen: dict[int, Sighting] = field(default_factory=dict)

    def column(self, name: str) -> Floats:
        """Return a number of each sighting (k,), runs in order."""
        return np.array([getattr(self.seen[run], name) for run in sorted(self.seen)], float)


def sightings(result: Result) -> list[Sighting]:
    """Return the detections of a run, strongest first; of what no path explains the level is that of the map."""
    found, out = result.detections, []
    for i, why in enumerate(result.provenance):
        level = why.predicted if why.contributions else why.power
        azimuth = float(found.azimuth[i])
        met = frozenset(b for part in why.contributions for b in _chain(part.chain)) or frozenset([why.bodies])
        place = float(found.range[i]), float(found.rate[i]), azimuth
        out.append(Sighting(*place, float(dbm(max(level, 1e-40))), why.error_db, why.label, why.bodies, met))
    return out


def follow(tracks: list[Track], run: int, result: Result, begin: bool = True) -> None:
    """Add the detections of a run to the tracks that they match; with `begin` the others begin tracks of their own."""
    found = sightings(result)
    for one, track in zip(found, _matched(tracks, found, result), strict=True):
        if track is None:
            if not begin:
                continue
            tracks.append(track := Track(one))
        track.seen[run] = one


def _matched(tracks: list[Track], found: list[Sighting], result: Result) -> list[Track | None]:
    """Return the track of each detection, each track at most once: the nearest pairs in all, in squares of cells."""
    if not tracks or not found:
        return [None] * len(found)
    wave = result.receiver.waveform
    there, here = ([(s.range, s.rate) for s in x] for x in ([t.first for t in tracks], found))
    away = np.abs(np.array(there)[:, None] - np.array(here)[None])
    # A rate at one end of the unambiguous ones is next to that at the other.
    period = 2.0 * result.rdmap.unambiguous_rate
    away[..., 1] = np.minimum(away[..., 1], np.abs(period - away[..., 1]))
    away /= (wave.range_resolution, wave.rate_resolution)
    apart = np.array([[_apart(t.first, s) for s in found] for t in tracks])
    allowed = (away <= GATE).all(axis=2) & np.isfinite(apart)
    cost = np.where(allowed, (away**2).sum(axis=2) + np.where(allowed, apart, 0.0), 1e6)
    out: list[Track | None] = [None] * len(found)
    for i, j in zip(*linear_sum_assignment(cost), strict=True):
        if allowed[i, j]:
            out[j] = tracks[i]
    return out


def _apart(one: Sighting, other: Sighting) -> float:
    """Return how much two detections differ in bodies and azimuth: 0 for the same leading chain, 1 for others of which
    the cells share a body, infinite else; and the sine between their azimuths, in tenths, squared."""
    if not one.met & other.met:
        return math.inf
    a, b = (_chain(s.bodies.split(" > ")) for s in (one, other))
    turned = one.azimuth - other.azimuth
    return float(a not in (b, b[::-1])) + (0.0 if math.isnan(turned) else (10.0 * math.sin(turned)) ** 2)


def _chain(names: Sequence[str]) -> tuple[str, ...]:
    return tuple(whole(name.strip("()")) for name in names)
