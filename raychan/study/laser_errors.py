"""What errors of the recorded pose do to ranges that are computed from it: Monte Carlo beside first order.

A scan is recorded at one pose; from the pose that the ship's sensors tell, another scan is computed. The difference of
both, beam by beam, is the range error: of attitude, position, and of a record that is late (time skew).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from raychan.dynamics.ship import KNOT
from raychan.run.files.output import csv_bytes, write_whole
from raychan.sensors.laser import SEA
from raychan.study.laser_deck import POSE, Deck, ranges, slopes, standing, stratified
from raychan.world.body import Body

Floats = NDArray[np.float64]
Progress = Callable[[str, float], None]

SOURCES = (*POSE, "delay")
UNITS = dict(zip(SOURCES, ("deg", "deg", "deg", "m", "m", "m", "s"), strict=True))
TYPICAL = dict(zip(SOURCES, (0.5, 0.5, 1.0, 0.75, 0.75, 0.5, 0.1), strict=True))
"""Deviations, in UNITS, of what the ship paper's yacht carries: a positioner of 0.5 to 1 m (printed); attitude, compass
and delay are assumed."""
LEVELS = {"deg": np.geomspace(0.01, 5.0, 10), "m": np.geomspace(0.01, 5.0, 10), "s": np.geomspace(2e-3, 0.5, 10)}
"""Deviations that are charted, by unit."""
BODIES = {"sea": SEA, "quay": 0}
ALL = "all, typical"
APART = 0.1
"""From this share off 1 on, the ratio of Monte Carlo to first order counts as departed."""
_HEADS = (
    "body", "source", "unit", "sigma", "beams", "first_order_m", "monte_carlo_m", "ratio", "mean_error_m", "lost_share",
)  # fmt: skip


@dataclass(frozen=True)
class Effect:
    """The range error on one body by one source (or all): deviations [m] over draws, as root mean square over beams.

    Fields: sigma of the source in its unit, NaN for all; beams that meet the body at the true pose; mean_error [m] over
    draws and beams; lost: share of draws and beams that no longer meet the body.
    """

    body: str
    source: str
    unit: str
    sigma: float
    beams: int
    first_order: float
    monte_carlo: float
    mean_error: float
    lost: float

    @property
    def ratio(self) -> float:
        """Monte Carlo over first order."""
        return self.monte_carlo / self.first_order if self.first_order > 0.0 else np.nan


def harbour() -> Deck:
    """Return a scanner 5 m over the sea, heeled by 10 deg in a turn, beside a quay 40 m ahead to port.

    It rolls by 5 deg/s, pitches by 2, turns by 1, at 20 knots ahead. The quay's face is 12 m wide and 20 m high.
    """
    outline = [[0.0, 0.0], [6.0, 0.0], [6.0, 12.0], [0.0, 12.0]]
    quay = Body(name="quay", shape="prism", params={"outline": outline, "height": 20.0}, position=(40.0, 17.0, 0.0))
    rates = np.radians([5.0, 2.0, 1.0])
    return Deck(
        targets=standing([quay], 0.5, 1.0),
        pose=np.array([np.radians(10.0), 0.0, 0.0, 0.0, 0.0, 5.0]),
        rates=np.array([*rates, 20.0 * KNOT, 0.0, 0.0]),
    )


def pose_errors(deck: Deck, source: str, errors: Floats) -> Floats:
    """Return the errors (m, 6) of the pose for errors (m,) [rad, m, s] of a source; a late record lags behind."""
    if source == "delay":
        return -np.outer(errors, deck.rates)
    found = np.zeros((len(errors), 6))
    found[:, POSE.index(source)] = errors
    return found


def si(source: str, value: Floats | float) -> Floats | float:
    """Return a value of a source's unit in SI."""
    return np.radians(value) if UNITS[source] == "deg" else value


def effects(
    deck: Deck | None = None, draws: int = 2000, seed: int = 0, progress: Progress | None = None
) -> list[Effect]:
    """Return the effect of each source at each of LEVELS, and of all at TYPICAL values, on each body.

    Args: deck, by default `harbour`; draws of each; seed: equal ones give equal numbers; progress is told the share.
    Raises: ValueError for fewer than 2 draws.
    """
    if draws < 2:
        raise ValueError(f"{draws} draws; allowed: at least 2")
    deck, rng = deck or harbour(), np.random.default_rng(seed)
    steep = slopes(deck)
    steep = np.column_stack([steep, -steep @ deck.rates])
    jobs = [(s, level) for s in SOURCES for level in LEVELS[UNITS[s]]] + [(ALL, np.nan)]
    made = []
    for k, (source, level) in enumerate(jobs):
        if progress:
            progress("errors", k / len(jobs))
        deviation = np.zeros(len(SOURCES))
        for s in SOURCES if source == ALL else (source,):
            deviation[SOURCES.index(s)] = si(s, TYPICAL[s] if source == ALL else level)
        off = sum(
            pose_errors(deck, s, d * stratified(draws, rng)) for s, d in zip(SOURCES, deviation, strict=True) if d > 0.0
        )
        made += _compared(deck, source, float(level), np.asarray(off), np.sqrt((steep * deviation) ** 2 @ np.ones(7)))
    if progress:
        progress("errors", 1.0)
    return made


def _compared(deck: Deck, source: str, level: float, off: Floats, first_order: Floats) -> list[Effect]:
    """Return the effects of pose errors (m, 6), whose first-order deviations (n,) [m] are given."""
    (true,), (of,) = ranges(deck, deck.pose[None])
    found, body = ranges(deck, deck.pose + off)
    made = []
    for name, number in BODIES.items():
        beams = of == number
        same = body[:, beams] == number
        error = np.where(same, found[:, beams] - true[beams], 0.0)
        count = np.maximum(same.sum(axis=0), 1)
        mean = error.sum(axis=0) / count
        spread = (np.where(same, error - mean, 0.0) ** 2).sum(axis=0) / count
        made.append(
            Effect(
                body=name,
                source=source,
                unit=UNITS.get(source, ""),
                sigma=level,
                beams=int(beams.sum()),
                first_order=float(np.sqrt((first_order[beams] ** 2).mean())),
                monte_carlo=float(np.sqrt(spread.mean())),
                mean_error=float(mean.mean()),
                lost=float(1.0 - same.mean()),
            )
        )
    return made


def departures(made: Sequence[Effect]) -> dict[tuple[str, str], float | None]:
    """Return by body and source the sigma from which on Monte Carlo is off first order by more than APART, None where
    the largest is not; sources without a first-order effect are left out."""
    found: dict[tuple[str, str], float | None] = {}
    for e in sorted((e for e in made if e.source != ALL and e.first_order > 0.0), key=lambda e: e.sigma):
        key = e.body, e.source
        if abs(e.ratio - 1.0) <= APART:
            found[key] = None
        elif found.setdefault(key, None) is None:
            found[key] = e.sigma
    return found


def skew(rate: float, delays: Floats) -> tuple[Floats, Floats]:
    """Return what a late record of the roll does to the range of the sea abeam: simulated, and rate times delay.

    Args: rate [deg/s] of roll, at 10 deg; delays (d,) [s] of the record. The beam points to starboard.
    Returns: errors [m] (d,) as simulated, NaN where nothing is met, and by the slope of the range times rate and delay.
    """
    deck = harbour()
    (true, *_), slope = ranges(deck, deck.pose[None])[0][0], float(slopes(deck)[0, 0])
    late = np.radians(rate) * np.asarray(delays, float)
    met = ranges(deck, deck.pose + pose_errors(deck, "roll", -late))[0][:, 0]
    return np.where(np.isfinite(met), met - true, np.nan), -slope * late


def write_csv(made: Sequence[Effect], path: Path) -> Path:
    """Write the table as CSV and return its path."""
    rows = [
        (e.body, e.source, e.unit, *_digits(e.sigma), str(e.beams),
         *_digits(e.first_order, e.monte_carlo, e.ratio, e.mean_error, e.lost))
        for e in made
    ]  # fmt: skip
    return write_whole(path, csv_bytes([_HEADS, *rows]))


def _digits(*values: float) -> list[str]:
    return ["" if np.isnan(v) else f"{v:.6g}" for v in values]
