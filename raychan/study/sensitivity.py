"""How far each detection moves when bodies turn and move by their makers' tolerances: speckle told from error.

Each draw turns and shifts every body but mirrors such as the ground: independent Gaussian turns about three axes
through its middle, and independent Gaussian shifts along three. The seed of the receiver stays, so what moves is the
channel. A level that a millimetre moves by more than the tolerance, and by more than the launches' own error, is
speckle: more rays tell it for one pose only.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from raychan.run.clock import STAGES
from raychan.run.files.output import csv_bytes, write_whole
from raychan.run.result import Result
from raychan.run.simulate import simulate
from raychan.study.detection_tracks import NOISE, Track, follow
from raychan.world.displaced import Displacement, displaced, movable
from raychan.world.errors import SceneError
from raychan.world.limits import DRAWS, SHIFT_MM, TURN_DEG
from raychan.world.scene import Scene

Floats = NDArray[np.float64]
Progress = Callable[[str, float], None]


SPECKLE, ERROR, STEADY, INTERMITTENT = "speckle", "error", "steady", "intermittent"
VERDICTS = {
    STEADY: "spread and stated error within the tolerance",
    SPECKLE: "spread above the tolerance and above the stated error: poses decide the level, more rays do not",
    ERROR: "stated error above the tolerance and not below the spread, which may be of it: more rays would help "
    "(a preview takes none)",
    INTERMITTENT: "not seen in every draw; spread, if two or more see it, and stated error within the tolerance",
    NOISE: "no path explains it",
}


@dataclass(frozen=True)
class Tolerances:
    """Standard deviations of the turn about each axis [deg] and of the shift along each [mm]; how often to draw; `each`
    whether to move one body at a time as well. Raises: ValueError for numbers beyond their limits."""

    turn_deg: float = 0.05
    shift_mm: float = 1.0
    draws: int = 20
    each: bool = False

    def __post_init__(self) -> None:
        for name, limit in (("turn_deg", TURN_DEG), ("shift_mm", SHIFT_MM), ("draws", DRAWS)):
            object.__setattr__(self, name, limit.check(name, getattr(self, name), whole=name == "draws"))
        if self.turn_deg == self.shift_mm == 0.0:
            raise ValueError("turn_deg and shift_mm are both 0: nothing would move")


@dataclass(frozen=True)
class Moves:
    """How a detection moved through draws; levels are of its paths alone, without thermal noise."""

    track: Track
    as_is: bool
    """Whether it is seen in the scene as it is, too."""
    draws: int
    shares: dict[str, tuple[float, float]]
    """With `each`: spread [dB] by body when only this moves, and its share of the sum of variances."""

    @property
    def count(self) -> int:
        """Draws in which it is seen."""
        return len(self.track.seen)

    def spread(self, name: str = "level_dbm") -> float:
        """Return the standard deviation of a number over the draws that see it; NaN for fewer than two."""
        return float(np.std(self.track.column(name), ddof=1)) if self.count > 1 else math.nan

    def percentile(self, share: float) -> float:
        """Return the level [dBm] that a share [%] of the draws stays below; NaN if no draw sees it."""
        return float(np.percentile(self.track.column("level_dbm"), share)) if self.count else math.nan

    @property
    def stated_db(self) -> float:
        """Median of the stated errors [dB] over the draws, infinite where unknown. In the depth of a fade it
        is large, so that of one pose says little."""
        errors = self.track.column("error_db") if self.count else np.array([self.track.first.error_db])
        return float(np.median(np.where(np.isnan(errors), np.inf, errors)))

    def verdict(self, tolerance_db: float) -> str:
        """Return which of VERDICTS holds at a tolerance [dB]; of speckle the spread exceeds tolerance and stated
        error, as the launches' own error is in the spread too."""
        if self.track.first.bodies == NOISE:
            return NOISE
        if self.count > 1 and self.spread() > max(tolerance_db, self.stated_db):
            return SPECKLE
        if self.stated_db > tolerance_db:
            return ERROR
        return STEADY if self.count == self.draws else INTERMITTENT


@dataclass(frozen=True)
class Sensitivity:
    """What a study gives: the detections of the scene as it is, strongest first, then those that only draws see."""

    title: str
    given: Tolerances
    bodies: tuple[str, ...]
    """The bodies that move."""
    tolerance_db: float
    moves: tuple[Moves, ...]
    warnings: tuple[str, ...]

    def verdicts(self) -> dict[str, int]:
        """Return how many detections have each verdict."""
        counted = Counter(m.verdict(self.tolerance_db) for m in self.moves)
        return {v: counted[v] for v in VERDICTS if counted[v]}

    def summary(self) -> str:
        """Return the study in a line."""
        told = ", ".join(f"{n} {v}" for v, n in self.verdicts().items()) or "none"
        g, n, found = self.given, len(self.bodies), len(self.moves)
        bodies = f"{n} bod{'y' if n == 1 else 'ies'}"
        detections = f"{found} detection{'' if found == 1 else 's'}"
        spread = f"Gaussian turns of {g.turn_deg:g} deg about and shifts of {g.shift_mm:g} mm along each axis"
        return f"{detections} over {g.draws} draws of {bodies} ({spread}, rms): {told}"


def drawn(given: Tolerances, seed: int, draw: int, body: int) -> Displacement:
    """Return where a body, by its number among those that move, stands in a draw: the same whichever others move."""
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(draw, body)))
    turn, shift = rng.standard_normal((2, 3))
    return Displacement(math.radians(given.turn_deg) * turn, 1e-3 * given.shift_mm * shift)


def sensitivity(
    scene: Scene,
    given: Tolerances | None = None,
    seed: int = 0,
    tolerance_db: float | None = None,
    max_bounces: int | None = None,
    progress: Progress | None = None,
) -> Sensitivity:
    """Simulate a scene as it is and with its bodies displaced, and return how far each detection moves.

    Args: given the makers' tolerances; seed of the draws and of each run's receiver; tolerance_db [dB] and max_bounces
    as for `simulate`; progress is called with ('sensitivity', share done).
    Raises: ValueError for a scene of which no body can be displaced; SceneError where a draw makes no scene.
    """
    given = given or Tolerances()
    names = movable(scene)
    if not names:
        raise ValueError("no body can be displaced: the scene has mirrors, such as the ground, only")
    alone = names if given.each else ()
    tell, runs = progress or (lambda stage, share: None), 1 + given.draws * (1 + len(alone))
    done = 0

    def run(moving: tuple[str, ...], draw: int) -> Result:
        nonlocal done

        def inner(stage: str, share: float) -> None:
            if stage in STAGES:
                tell("sensitivity", (done + (STAGES.index(stage) + share) / len(STAGES)) / runs)

        by = {name: drawn(given, seed, draw, names.index(name)) for name in moving}
        result = simulate(_posed(scene, by, draw), seed, tolerance_db, max_bounces, inner)
        done += 1
        return result

    base = run((), 0)
    tracks: list[Track] = []
    follow(tracks, -1, base)
    as_is = len(tracks)
    for draw in range(given.draws):
        follow(tracks, draw, run(names, draw))
    shares: list[dict[str, float]] = [{} for _ in tracks]
    for name in alone:
        single = [Track(t.first) for t in tracks]
        for draw in range(given.draws):
            follow(single, draw, run((name,), draw), begin=False)
        for found, track in zip(shares, single, strict=True):
            found[name] = float(np.std(track.column("level_dbm"), ddof=1)) if len(track.seen) > 1 else math.nan
    for track in tracks:
        track.seen.pop(-1, None)
    moves = [Moves(t, i < as_is, given.draws, _shares(s)) for i, (t, s) in enumerate(zip(tracks, shares, strict=True))]
    tell("sensitivity", 1.0)
    return Sensitivity(scene.title, given, names, float(base.stats["tolerance_db"]), tuple(moves), base.warnings)


def _posed(scene: Scene, by: dict[str, Displacement], draw: int) -> Scene:
    """Return the scene of a draw. Raises: SceneError, which names the draw, where it cannot be."""
    if not by:
        return scene
    try:
        return displaced(scene, by)
    except SceneError as e:
        problem = f"{e.problem} where draw {draw + 1} displaced the bodies"
        raise SceneError(problem, file=e.file or scene.path, key=e.key, value=e.value, allowed=e.allowed) from None


def _shares(spreads: dict[str, float]) -> dict[str, tuple[float, float]]:
    """Return the spread [dB] of each body with its share of the sum of variances."""
    total = sum(s**2 for s in spreads.values() if not math.isnan(s))
    return {name: (s, s**2 / total if total > 0.0 else math.nan) for name, s in spreads.items()}


COLUMNS = (
    "detection", "as_is", "range_m", "range_rate_mps", "level_dbm", "error_db", "median_error_db", "spread_db",
    "level_p10_dbm", "level_p90_dbm", "range_spread_m", "rate_spread_mps", "seen", "draws", "label", "bodies",
    "verdict",
)  # fmt: skip


def write_csv(done: Sensitivity, path: Path) -> Path:
    """Write a row a detection and return the path; what is unknown is empty."""
    rows = [cells(i + 1, m, done.tolerance_db) for i, m in enumerate(done.moves)]
    return write_whole(path, csv_bytes([COLUMNS, *rows]))


def write_each_csv(done: Sensitivity, path: Path) -> Path:
    """Write a row for each detection and body that moves alone, and return the path."""
    heads = ("detection", "body", "spread_db", "share_of_variance")
    rows = [
        (str(i + 1), name, _number(spread, 3), _number(share, 4))
        for i, m in enumerate(done.moves)
        for name, (spread, share) in m.shares.items()
    ]
    return write_whole(path, csv_bytes([heads, *rows]))


def cells(number: int, moved: Moves, tolerance_db: float) -> tuple[str, ...]:
    """Return a detection as text, in COLUMNS."""
    first = moved.track.first
    return (
        str(number), "yes" if moved.as_is else "no", _number(first.range, 4), _number(first.rate, 4),
        _number(first.level_dbm, 2), _number(first.error_db, 2),
        _number(moved.stated_db, 2), _number(moved.spread(), 3),
        _number(moved.percentile(10.0), 2), _number(moved.percentile(90.0), 2),
        _number(moved.spread("range"), 5), _number(moved.spread("rate"), 5),
        str(moved.count), str(moved.draws), first.label, first.bodies, moved.verdict(tolerance_db),
    )  # fmt: skip


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else ""
