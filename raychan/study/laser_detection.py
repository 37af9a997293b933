"""How often a scan on a rolling and pitching deck meets a fixed target: by amplitude of the motion and by bearing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from raychan.run.files.output import csv_bytes, write_whole
from raychan.study.laser_deck import Deck, ranges, standing
from raychan.world.body import Body

Floats = NDArray[np.float64]
Progress = Callable[[str, float], None]

DISTANCE, WIDTH, HEIGHT, MOUNT = 40.0, 2.0, 10.0, 5.0
"""The tower: distance of its face, width, height; height of the scanner [m]."""
BEARINGS = (0.0, 45.0, 90.0)
"""Of the tower, to port of the bow [deg]."""
AMPLITUDES = np.arange(0.0, 20.5, 1.0)
"""Of roll or pitch [deg]."""
GRID = np.arange(0.0, 20.5, 2.0)
"""Of both at once, for the tower at 45 deg."""


@dataclass(frozen=True)
class Detection:
    """Detection probability of a tower at a bearing [deg] at amplitudes of roll and pitch [deg]."""

    bearing: float
    roll: float
    pitch: float
    probability: float


def tower(bearing: float) -> Deck:
    """Return a level scanner in the open sea, a square tower at a bearing [deg] whose face is turned to it."""
    a, half = np.radians(bearing), 0.5 * WIDTH
    outline = [[0.0, -half], [WIDTH, -half], [WIDTH, half], [0.0, half]]
    body = Body(
        name="tower", shape="prism", params={"outline": outline, "height": HEIGHT}, yaw_deg=bearing,
        position=(DISTANCE * float(np.cos(a)), DISTANCE * float(np.sin(a)), 0.0),
    )  # fmt: skip
    return Deck(targets=standing([body], 0.5, 1.0), pose=np.array([0.0, 0.0, 0.0, 0.0, 0.0, MOUNT]))


def probability(deck: Deck, roll: float, pitch: float, scans: int, rng: np.random.Generator) -> float:
    """Return the share of scans in which a beam meets the tower, at amplitudes of roll and pitch [deg].

    Both are sines of random phase, stratified, independent of each other; the deck stands still within a scan.
    """
    phases = [(rng.permutation(scans) + rng.uniform(size=scans)) / scans for _ in range(2)]
    poses = np.tile(deck.pose, (scans, 1))
    poses[:, 0] += np.radians(roll) * np.sin(2.0 * np.pi * phases[0])
    poses[:, 1] += np.radians(pitch) * np.sin(2.0 * np.pi * phases[1])
    return float((ranges(deck, poses)[1] == 0).any(axis=1).mean())


def abeam_in_closed_form(amplitude: Floats) -> Floats:
    """Return the detection probability of a tower abeam by amplitude [deg] of roll: a beam at 90 deg is raised by the
    roll, so the tower is met while |roll| < e, its half height's elevation: 2/pi asin(e / amplitude)."""
    least = np.degrees(np.arctan(min(MOUNT, HEIGHT - MOUNT) / DISTANCE))
    return np.asarray(2.0 / np.pi * np.arcsin(np.minimum(1.0, least / np.maximum(amplitude, 1e-9))))


def detections(scans: int = 400, seed: int = 0, progress: Progress | None = None) -> list[Detection]:
    """Return the detection probability over AMPLITUDES of roll, and of pitch, at all BEARINGS, and over GRID.

    Args: scans for each; seed: equal ones give equal numbers; progress is told the share done.
    Raises: ValueError for no scan.
    """
    if scans < 1:
        raise ValueError(f"{scans} scans; allowed: at least 1")
    rng = np.random.default_rng(seed)
    jobs = [(b, float(a), 0.0) for b in BEARINGS for a in AMPLITUDES]
    jobs += [(b, 0.0, float(a)) for b in BEARINGS for a in AMPLITUDES[1:]]
    jobs += [(BEARINGS[1], float(r), float(p)) for r in GRID[1:] for p in GRID[1:]]
    decks, made = {b: tower(b) for b in BEARINGS}, []
    for k, (bearing, roll, pitch) in enumerate(jobs):
        if progress:
            progress("detection", k / len(jobs))
        made.append(Detection(bearing, roll, pitch, probability(decks[bearing], roll, pitch, scans, rng)))
    if progress:
        progress("detection", 1.0)
    return made


def write_csv(made: list[Detection], path: Path) -> Path:
    """Write the table as CSV and return its path."""
    heads = ("bearing_deg", "roll_deg", "pitch_deg", "probability")
    rows = [(f"{d.bearing:g}", f"{d.roll:g}", f"{d.pitch:g}", f"{d.probability:.4f}") for d in made]
    return write_whole(path, csv_bytes([heads, *rows]))
