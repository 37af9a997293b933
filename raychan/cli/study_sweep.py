"""raychan study sweep: occlusion and detection of one body over varied scenes or over time."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from raychan.cli import show
from raychan.cli.options import Changes, MaxBounces, SceneFile, Seed, Threads, Tolerance, directory
from raychan.run.files.contents import Contents
from raychan.run.files.in_place import told

if TYPE_CHECKING:
    from rich.table import Table

    from raychan.study.sweep import Axis, Step, Sweep
    from raychan.study.visibility import Level

_CONTENTS = Contents(("sweep.csv", "sweep.png"), signs=("sweep.csv",))


def sweep(
    scene: SceneFile,
    target: Annotated[str, typer.Option(help="The body to follow.", metavar="BODY", show_default=False)],
    out: Annotated[
        Path,
        typer.Option(
            "--out", "-o", help="Directory for table and figure; made if missing.", metavar="DIR", parser=directory
        ),
    ],
    vary: Annotated[
        list[str] | None,
        typer.Option(
            help="Key of the scene file and its values, such as bodies.van.position.y=-4:0:9; twice for a grid.",
            metavar="KEY=START:STOP:STEPS",
        ),
    ] = None,
    times: Annotated[
        str | None,
        typer.Option(
            help="Times in seconds; all bodies and the radar move on by their velocities.",
            metavar="START:STOP:STEPS",
        ),
    ] = None,
    set_: Changes = None,
    seed: Seed = 0,
    tolerance: Tolerance = None,
    max_bounces: MaxBounces = None,
    threads: Threads = None,
) -> None:
    """Follow one body through varied scenes: its hidden share, the bodies that hide it, and its detections.

    Without --vary and --times the scene is simulated as it is. Levels of the direct, multipath and diffracted returns
    of the body are relative to the weakest that the radar reports. Writes sweep.csv and sweep.png; after Ctrl-C,
    or where a step is no possible scene, sweep.csv has the steps that are done."""
    from raychan.report.sweep_figures import sweep_picture
    from raychan.run.files.output import staging
    from raychan.study import sweep as study
    from raychan.world.errors import SceneError
    from raychan.world.scene import Scene

    loaded = Scene.load(scene).override(set_ or [])
    axes, steps = _axes(vary or [], times), list[study.Step]()

    def keep() -> str:
        return told() or _kept(study.Sweep(loaded.title, target, axes, tuple(steps)), out)

    with show.keeping(keep), staging(out, _CONTENTS) as stage, show.progress() as tell:
        try:
            done = study.sweep(loaded, target, axes, seed, tolerance, max_bounces, tell, steps)
        except SceneError:
            raise
        except ValueError as error:
            raise typer.BadParameter(str(error)) from None
        study.write_csv(done, stage / "sweep.csv")
        sweep_picture(done, stage / "sweep.png")
    screen = show.console()
    screen.print(_table(done))
    found = sum(s.seen is not None for s in done.steps)
    screen.print(f"{target} is detected in {found} of {len(done.steps)} steps")
    screen.print(f"table and figure: {out / 'sweep.csv'}, {out / 'sweep.png'}", soft_wrap=True)


def _axes(vary: list[str], times: str | None) -> tuple[Axis, ...]:
    """Return the axes that options describe. Raises: typer.BadParameter."""
    from raychan.study.sweep import Axis

    try:
        return (*map(Axis.of, vary), *([Axis.time(times)] if times else []))
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None


def _kept(done: Sweep, out: Path) -> str:
    """Write the table of the steps that are done; return how many these are, '' for none."""
    from raychan.run.files.output import staging
    from raychan.study.sweep import write_csv

    if not done.steps:
        return ""
    with staging(out, _CONTENTS) as stage:
        write_csv(done, stage / "sweep.csv")
    count = math.prod(len(axis.values) for axis in done.axes)
    return f"{show.share(len(done.steps), count, 'steps')} in {out / 'sweep.csv'}"


def _table(done: Sweep) -> Table:
    from raychan.study.visibility import WAYS

    heads = [_head(a.key, a.unit) for a in done.axes]
    heads += ["detected", "range\nm", "speed\nm/s", "SNR\ndB", "error\ndB", "blocked\n%", "by"]
    heads += [f"{way}\ndB" for way in WAYS]
    n = len(done.axes)
    rows = [[*(f"{v:g}" for v in s.values), *_cells(s)] for s in done.steps]
    title = f"{done.target}; levels are over the weakest reported one"
    return show.table(title, heads, rows, left=(n, n + 6))


def _head(key: str, unit: str) -> str:
    """Return a key over two lines, as it is longer than its values."""
    words = key.removeprefix("bodies.").split(".")
    return (
        f"{'.'.join(words[:-2])}\n{'.'.join(words[-2:])} {unit}".strip() if len(words) > 2 else f"{key} {unit}".strip()
    )


def _cells(step: Step) -> list[str]:
    seen, hidden = step.seen, step.found.occlusion
    told = ["no", "", "", "", ""]
    if seen is not None:
        told = [seen.label, f"{seen.range:.2f}", f"{seen.speed:+.2f}", f"{seen.snr_db:.1f}"]
        told.append("unknown" if math.isnan(seen.error_db) else f"{seen.error_db:.2f}")
    share = "" if hidden.blocked is None else f"{100.0 * hidden.blocked:.1f}"
    return [*told, share, ", ".join(name for name, _ in hidden.by), *map(_margin, step.found.levels.values())]


def _margin(level: Level | None) -> str:
    if level is None or level.margin_db is None:
        return "unknown"
    return f"{level.margin_db:+.1f}" if level.power > 0.0 else "none"
