"""One body over a series of scenes, with keys of the scene file or the time varied; each step is simulated."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path

import numpy as np

from raychan.run.clock import STAGES
from raychan.run.files.output import csv_bytes, write_whole
from raychan.run.result import Result
from raychan.run.simulate import simulate
from raychan.study.visibility import WAYS, Visibility, check_target, visibility
from raychan.world.errors import SceneError
from raychan.world.scene import Scene

Progress = Callable[[str, float], None]

MOST = 100_000
"""Most steps of a sweep: more are a typing error."""

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_RANGE = re.compile(rf"(?<![\w.:])({_NUMBER}):({_NUMBER}):(\d+)(?![\w.:])")
_UNITS = {
    "_deg": "deg", "_db": "dB", "_dbm": "dBm", "_dbsm": "dBsm", "_mps": "m/s", "_dps": "deg/s", "_mhz": "MHz",
    "_ghz": "GHz", "_us": "us", "_mm": "mm", "position": "m", "rcs_point": "m", "time": "s",
}  # fmt: skip
"""Units by the ends of keys."""


@dataclass(frozen=True)
class Axis:
    """A varied quantity: key of the scene file, its values, and the text of each change; time has no changes."""

    key: str
    values: tuple[float, ...]
    changes: tuple[str, ...] = ()

    @property
    def unit(self) -> str:
        """Unit of the values, by the end of the key; '' where it is not known."""
        key = re.sub(r"\.[xyz]$", "", self.key)
        return next((unit for end, unit in _UNITS.items() if key.endswith(end)), "")

    @property
    def label(self) -> str:
        """The key with its unit, as the label of an axis."""
        return f"{self.key} [{self.unit}]" if self.unit else self.key

    @staticmethod
    def of(text: str) -> Axis:
        """Return the axis that KEY=START:STOP:STEPS describes; a range may stand for any number of the value, as in
        position=[12, -4:0:9, 0], and several ranges of as many steps go along together. ValueError for other text."""
        key, given, value = (part.strip() for part in text.partition("="))
        found = list(_RANGE.finditer(value))
        if not (key and given and found):
            raise ValueError(f"'{text}': KEY=START:STOP:STEPS is wanted, as radar.power_dbm=0:10:6")
        ranges = [_values(text, *m.groups()) for m in found]
        if len({len(r) for r in ranges}) > 1:
            raise ValueError(f"'{text}': ranges that go along together need the same number of steps")
        changes = []
        for step in zip(*ranges, strict=True):
            rest = iter(step)
            changes.append(f"{key}={_RANGE.sub(lambda _, rest=rest: f'{next(rest):.15g}', value)}")
        # A range within a vector is named by its component; of several that go along together, by the first.
        place = value[: found[0].start()].count(",")
        inner = value.startswith("[") and value.count(",") == 2
        return Axis(f"{key}.{'xyz'[place]}" if inner else key, tuple(ranges[0]), tuple(changes))

    @staticmethod
    def time(text: str) -> Axis:
        """Return the axis of time [s] that START:STOP:STEPS describes; ValueError for other text."""
        found = _RANGE.fullmatch(text.strip())
        if not found:
            raise ValueError(f"'{text}': START:STOP:STEPS in seconds is wanted, as 0:3:13")
        return Axis("time", tuple(_values(text, *found.groups())))


def _values(text: str, start: str, stop: str, steps: str) -> list[float]:
    if not 1 <= int(steps) <= MOST:
        raise ValueError(f"'{text}': {steps} steps; 1 to {MOST} are allowed")
    if not math.isfinite(float(stop) - float(start)):
        raise ValueError(f"'{text}': the range from {start} to {stop} is not finite; smaller numbers are wanted")
    # Rounded so that steps of 0.1 print as such; no key needs more digits.
    return [float(f"{v:.12g}") for v in np.linspace(float(start), float(stop), int(steps))]


@dataclass(frozen=True)
class Seen:
    """The detection of the body: direct before multipath, the strongest of these."""

    range: float
    rate: float
    speed: float
    snr_db: float
    error_db: float
    """Stated error; NaN where not converged."""
    label: str
    bodies: str


@dataclass(frozen=True)
class Step:
    """One scene of a sweep: its values, and the visibility of the body."""

    values: tuple[float, ...]
    seen: Seen | None
    found: Visibility
    min_snr_db: float
    """The least SNR [dB] that the receiver reports: a margin of 0 dB."""


@dataclass(frozen=True)
class Sweep:
    """All steps; with two axes in rows, the last axis fastest."""

    title: str
    target: str
    axes: tuple[Axis, ...]
    steps: tuple[Step, ...] = field(default=())


def sweep(
    scene: Scene,
    target: str,
    axes: Sequence[Axis] = (),
    seed: int = 0,
    tolerance_db: float | None = None,
    max_bounces: int | None = None,
    progress: Progress | None = None,
    steps: list[Step] | None = None,
) -> Sweep:
    """Simulate a scene at each value of an axis, or at each pair of values of two, and return a body's visibility.

    Args: scene from a file or from tables; target a body's name; axes at most two, none for the scene as it is; seed,
    tolerance_db [dB] and max_bounces as for `simulate`; progress is called with ('sweep', share done); steps a
    list to which each step is added when it is done, so that they outlast Ctrl-C.
    Raises: SceneError for a change that makes no scene, ValueError for a body that is no target or too many axes.
    """
    if len(axes) > 2:
        raise ValueError(f"{len(axes)} keys are varied; at most two are allowed")
    if len({a.key for a in axes}) < len(axes):
        raise ValueError(f"{axes[0].key} is varied twice")
    places = list(product(*(range(len(a.values)) for a in axes)))
    if len(places) > MOST:
        raise ValueError(f"{len(places)} steps; at most {MOST} are allowed")
    # The first and the last scene are checked before any time goes into those between.
    for place in (places[0], places[-1]):
        with _named(axes, place):
            check_target(_scene(scene, axes, place), target)
    tell = progress or (lambda stage, share: None)
    steps = [] if steps is None else steps
    for i, place in enumerate(places):

        def inner(stage: str, share: float, done: int = i) -> None:
            if stage in STAGES:
                tell("sweep", (done + (STAGES.index(stage) + share) / len(STAGES)) / len(places))

        with _named(axes, place):
            result = simulate(_scene(scene, axes, place), seed, tolerance_db, max_bounces, inner)
            values = tuple(a.values[j] for a, j in zip(axes, place, strict=True))
            steps.append(_step(values, result, visibility(result, target)))
    tell("sweep", 1.0)
    return Sweep(scene.title, target, tuple(axes), tuple(steps))


def _scene(scene: Scene, axes: Sequence[Axis], place: Sequence[int]) -> Scene:
    changes = [a.changes[j] for a, j in zip(axes, place, strict=True) if a.changes]
    later = sum(a.values[j] for a, j in zip(axes, place, strict=True) if not a.changes)
    return scene.override(changes).at(later)


@contextmanager
def _named(axes: Sequence[Axis], place: Sequence[int]) -> Iterator[None]:
    """Name the step in errors of its scene."""
    try:
        yield
    except SceneError as e:
        if not axes:
            raise
        where = ", ".join(f"{a.key} = {a.values[j]:g}" for a, j in zip(axes, place, strict=True))
        problem = f"{e.problem} (step {where})"
        raise SceneError(problem, file=e.file, key=e.key, value=e.value, allowed=e.allowed) from None


def _step(values: tuple[float, ...], result: Result, found: Visibility) -> Step:
    seen = None
    if found.detections:
        i, d = found.detections[0], result.detections
        why = result.provenance[i]
        seen = Seen(
            float(d.range[i]), float(d.rate[i]), float(d.speed[i]), float(d.snr[i]), why.error_db, why.label, why.bodies
        )
    return Step(values, seen, found, float(result.require_scene().processing.min_snr_db))


COLUMNS = (
    "detected", "label", "range_m", "range_rate_mps", "speed_mps", "snr_db", "error_db", "bodies", "detections",
    "blocked", "blocked_error", "behind_layers", "blocked_by", "point_hidden_by",
    *(f"{way}_db" for way in WAYS), *(f"{way}_range_m" for way in WAYS),
)  # fmt: skip


def write_csv(done: Sweep, path: Path) -> Path:
    """Write a row a step and return the path.

    Columns WAY_db [dB] are levels over the weakest that is reported: -inf where no path is, empty where the way is
    not modelled or the scene has no noise. Shares are of the solid angle of the outline.
    """
    heads = [*(a.key if a.changes else "time_s" for a in done.axes), *COLUMNS]
    lines = [[*(f"{v:.10g}" for v in step.values), *cells(step)] for step in done.steps]
    return write_whole(path, csv_bytes([heads, *lines]))


def cells(step: Step) -> list[str]:
    """Return a step as text, in COLUMNS; what is unknown or not there is empty."""
    seen, hidden, levels = step.seen, step.found.occlusion, step.found.levels
    told = [""] * 6 if seen is None else [
        f"{seen.range:.4f}", f"{seen.rate:.4f}", f"{seen.speed:.4f}", f"{seen.snr_db:.2f}",
        "" if math.isnan(seen.error_db) else f"{seen.error_db:.2f}", seen.bodies,
    ]  # fmt: skip
    return [
        "no" if seen is None else "yes",
        "" if seen is None else seen.label,
        *told,
        str(len(step.found.detections)),
        *(_number(x, 5) for x in (hidden.blocked, hidden.error, hidden.behind_layers)),
        " ".join(f"{name}:{share:.5f}" for name, share in hidden.by),
        hidden.point or "",
        *(_number(None if level is None else level.margin_db, 2) for level in levels.values()),
        *(_number(None if level is None else level.range, 3) for level in levels.values()),
    ]


def _number(value: float | None, digits: int) -> str:
    return "" if value is None else f"{value:.{digits}f}"
