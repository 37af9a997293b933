"""raychan study sensitivity: how far detections move when bodies move by their makers' tolerances."""

from __future__ import annotations

import math
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from raychan.cli import show
from raychan.cli.options import Changes, MaxBounces, SceneFile, Seed, Tolerance, directory, within
from raychan.world import limits

if TYPE_CHECKING:
    from rich.table import Table

    from raychan.study.sensitivity import Sensitivity


Draws = Annotated[
    int,
    typer.Option(
        help="How often the bodies are displaced; each is a run.", metavar="N", callback=within(limits.DRAWS, True)
    ),
]
TurnDeg = Annotated[
    float,
    typer.Option(
        help="Standard deviation of the turn about each axis, degrees.",
        metavar="DEG",
        callback=within(limits.TURN_DEG),
    ),
]
ShiftMm = Annotated[
    float,
    typer.Option(
        help="Standard deviation of the shift along each axis, millimetres.",
        metavar="MM",
        callback=within(limits.SHIFT_MM),
    ),
]


def sensitivity(
    scene: SceneFile,
    draws: Draws = 20,
    turn_deg: TurnDeg = 0.05,
    shift_mm: ShiftMm = 1.0,
    each: Annotated[
        bool, typer.Option("--each", help="Also move one body at a time: which body moves which level.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            help="Directory for tables and figure; made if missing.",
            metavar="DIR",
            parser=directory,
            show_default=False,
        ),
    ] = None,
    set_: Changes = None,
    seed: Seed = 0,
    tolerance: Tolerance = None,
    max_bounces: MaxBounces = None,
) -> None:
    """Tell speckle from error: how far each detection's level, range and rate move as bodies turn and shift.

    Every body but mirrors such as the ground turns about three axes through its middle and shifts along three, by
    independent Gaussian amounts; the receiver's noise stays. A level whose spread exceeds the tolerance
    and the stated error is speckle; it is in error where the stated error exceeds the tolerance and is not below the
    spread; else it is steady, or intermittent where not every draw sees it.
    With --out, writes sensitivity.csv and sensitivity.png, and with --each, each.csv."""
    from raychan.run.files.contents import Contents
    from raychan.run.files.output import staging
    from raychan.study.sensitivity import Tolerances
    from raychan.study.sensitivity import sensitivity as study
    from raychan.world.errors import SceneError
    from raychan.world.scene import Scene

    loaded = Scene.load(scene).override(set_ or [])
    names = ("sensitivity.csv", "sensitivity.png", "each.csv")
    with staging(out, Contents(names, signs=names[:1])) if out else nullcontext() as stage:
        with show.progress() as tell:
            try:
                given = Tolerances(turn_deg, shift_mm, draws, each)
                done = study(loaded, given, seed, tolerance, max_bounces, tell)
            except SceneError:
                raise
            except ValueError as error:
                raise typer.BadParameter(str(error)) from None
        if stage:
            _write(done, stage)
    _print(done)
    if out:
        what = "tables and figure" if each else "table and figure"
        written = ", ".join(str(out / name) for name in names[: 3 if each else 2])
        show.console().print(f"{what}: {written}", soft_wrap=True)


def _write(done: Sensitivity, stage: Path) -> None:
    from raychan.report.sensitivity_figures import sensitivity_picture
    from raychan.study.sensitivity import write_csv, write_each_csv

    write_csv(done, stage / "sensitivity.csv")
    if done.given.each:
        write_each_csv(done, stage / "each.csv")
    sensitivity_picture(done, stage / "sensitivity.png")


def _print(done: Sensitivity) -> None:
    from raychan.study.sensitivity import VERDICTS

    show.warn(done.warnings)
    screen = show.console()
    screen.print(_table(done))
    if done.given.each:
        screen.print(_each(done))
    screen.print(done.summary(), soft_wrap=True)
    for verdict in done.verdicts():
        screen.print(f"{verdict}: {VERDICTS[verdict]}", soft_wrap=True)


def _table(done: Sensitivity) -> Table:
    heads = [
        "#", "range\nm", "rate\nm/s", "level\ndBm", "stated\nerror dB", "spread\ndB", "10 to 90 %\ndBm",
        "range\nspread mm", "seen in", "bodies", "verdict",
    ]  # fmt: skip
    rows = []
    for i, m in enumerate(done.moves):
        first = m.track.first
        low, high = (_known(m.percentile(p), ".1f") for p in (10.0, 90.0))
        rows.append([
            str(i + 1), f"{first.range:.2f}", f"{first.rate:+.2f}", f"{first.level_dbm:.1f}",
            f"{m.stated_db:.2f}" if math.isfinite(m.stated_db) else "unknown",
            _known(m.spread(), ".2f"), f"{low} to {high}" if low else "",
            _known(1e3 * m.spread("range"), ".1f"), f"{m.count} of {m.draws}", first.bodies,
            m.verdict(done.tolerance_db),
        ])  # fmt: skip
    title = f"Levels of the paths alone; tolerance {done.tolerance_db:g} dB"
    return show.table(title, heads, rows, left=(9, 10))


def _each(done: Sensitivity) -> Table:
    """Return the share of each body that moves alone in the sum of variances of a level."""
    rows = [
        [str(i + 1), *(_known(s, ".2f") + _known(100.0 * share, ".0f", " ({} %)") for s, share in m.shares.values())]
        for i, m in enumerate(done.moves)
    ]
    return show.table("One body at a time: spread dB (share of variance)", ["#", *done.bodies], rows)


def _known(value: float, digits: str, shown: str = "{}") -> str:
    return "" if math.isnan(value) else shown.format(f"{value:{digits}}")
