"""Compare every table and claim of the study with the simulation; differences are checked against the known ones."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

# Imported because they register their measures.
import raychan.study.validation.detections
import raychan.study.validation.formulas
import raychan.study.validation.parameters
import raychan.study.validation.reflectors
import raychan.study.validation.scanner
import raychan.study.validation.ship
import raychan.study.validation.telegrams  # noqa: F401
from raychan.study.validation.bench import Bench
from raychan.study.validation.data import Figure, Item, Study, load
from raychan.study.validation.judge import Check, cover, judge
from raychan.study.validation.measures import measured
from raychan.study.validation.sections import ghosts
from raychan.world.errors import SceneError, nearest

_OF_RUN = ("range", "rate", "speed", "snr", "shift", "speed_shift", "seen")  # measures (run, target) of a detection


@dataclass(frozen=True)
class Validation:
    """All checks, the problems among them, and the simulated runs."""

    study: Study
    items: tuple[Item, ...]
    checks: tuple[Check, ...]
    problems: tuple[str, ...]
    """Differences that are not listed, and listed ones that are gone: the command fails if there are any."""
    bench: Bench
    whole: bool
    """Whether all of the study was tested."""
    seconds: float = 0.0


def validate(
    folder: Path | None = None,
    only: Sequence[str] = (),
    tolerance_db: float | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> Validation:
    """Compare the simulation with the study's tables and claims.

    Args: folder with the data, by default that of the checkout; only these items (T10, C023), by default all and every
    run; tolerance_db [dB] of the launches, by default the scenes' own; progress is told the share done.
    Raises: SceneError where data or scenes are wrong, or an item is unknown.
    """
    since = time.perf_counter()
    study = load(folder)
    if tolerance_db is not None and not tolerance_db > 0.0:
        raise SceneError(
            f"{tolerance_db:g} is not possible", key="--tolerance", value=tolerance_db, allowed="above 0 dB"
        )
    known = {i.id for i in study.items}
    if strange := sorted(set(only) - known):
        raise SceneError(f"no table or claim '{strange[0]}'", key="--only", allowed=nearest(strange[0], known))
    items = tuple(i for i in study.items if not only or i.id in only)
    figures = [f for i in items for f in i.figure]
    runs = [r for r in study.runs if not only or any(r in map(str, f.measure[1:]) for f in figures)]
    bench = Bench(study, tolerance_db, len(runs), progress or (lambda stage, share: None))
    if not only:
        for run in runs:
            bench.run(run)
    checks, problems = cover([_check(bench, f) for f in figures], study.known, whole=not only)
    for g in ghosts(bench):
        if g.converged and not g.explained:
            problems.append(f"ghost at {g.range:.2f} m in '{g.run}' is not explained to {g.cell:.4f} m: {g.text}")
    return Validation(study, items, tuple(checks), tuple(problems), bench, not only, time.perf_counter() - since)


def _check(bench: Bench, figure: Figure) -> Check:
    simulated = measured(bench, figure.measure, figure.key)
    note = ""
    name, *arguments = figure.measure
    if simulated in (None, False) and name in _OF_RUN:
        level = bench.level(*arguments)
        note = "no path" if level is None else f"{level:.1f} dB without noise"
    return judge(figure, simulated, note, bench.study.reasons.get(figure.untestable, ""))
