"""raychan validate: compare the tables and claims of a published study with the simulation."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from raychan.cli import show
from raychan.cli.options import directory, within
from raychan.world import limits

if TYPE_CHECKING:
    from raychan.study.validation.validate import Validation

_Out = Annotated[
    Path,
    typer.Option(
        "--out", "-o", help="Directory for report and figures; made if missing.", metavar="DIR", parser=directory
    ),
]


def validate(
    out: _Out = Path("out/validation"),
    only: Annotated[
        list[str] | None,
        typer.Option(
            "--only",
            help="Only this table or claim, such as T10 or C023; may be repeated.",
            metavar="ID",
            show_default=False,
        ),
    ] = None,
    tolerance: Annotated[
        float,
        typer.Option(
            "--tolerance",
            help="Error in dB to which tubes are refined.",
            metavar="DB",
            callback=within(limits.TOLERANCE_DB),
        ),
    ] = 1.0,
    data: Annotated[
        Path | None,
        typer.Option(
            "--data",
            help="Folder of tables, claims and known differences; scenes/ beside it. By default the checkout's.",
            metavar="DIR",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Compare every table and claim of the study with the simulation, and list differences and their reasons.

    Writes report.md, report.html and figures. Exit code 1 if a difference is not listed in known_differences.toml, or
    if a listed one is gone."""
    from raychan.report.validation_page import page
    from raychan.report.validation_report import markdown
    from raychan.run.files.contents import Contents
    from raychan.run.files.output import staging, write_whole
    from raychan.study.validation.sections import ablations, array_gains, budgets, ghosts
    from raychan.study.validation.validate import validate as run

    contents = Contents(("report.md", "report.html", "report-*.png"), signs=("report.html",))
    with staging(out, contents) as stage, show.progress() as tell:
        done = run(data, only or (), tolerance, tell)
        sections, figures = None, {}
        if done.whole:
            from raychan.report.validation_figures import pictures

            people, by_azimuth = budgets(done.bench, "street"), array_gains(done.bench)
            sections = (ablations(done.bench), ghosts(done.bench), people, by_azimuth)
            figures = {name: path.name for name, path in pictures(done, people, by_azimuth, stage).items()}
        text = markdown(done, sections, figures)
        write_whole(stage / "report.md", text.encode())
        write_whole(stage / "report.html", page(text, stage, "raychan: validation").encode())
    _say(done, out)
    if done.problems:
        show.warn(done.problems)
        raise typer.Exit(1)


def _say(done: Validation, out: Path) -> None:
    from raychan.study.validation.judge import AGREES, DIFFERS, UNTESTABLE, of_item, verdict

    rows = []
    for item in done.items:
        checks = of_item(item, done.checks)
        counts = [str(sum(c.verdict == v for c in checks)) for v in (AGREES, DIFFERS, UNTESTABLE)]
        rows.append((item.id, item.title, *counts, verdict(checks)))
    screen = show.console()
    heads = ("", "table or claim", "agree", "differ", "not testable", "verdict")
    screen.print(show.table("Validation", heads, rows, left=(0, 1, 5)))
    counts = [sum(c.verdict == v for c in done.checks) for v in (AGREES, DIFFERS, UNTESTABLE)]
    listed = " as listed" if counts[1] and not done.problems else ""
    screen.print(
        f"{len(done.checks)} figures: {counts[0]} agree, {counts[1]} differ{listed}, {counts[2]} cannot be "
        f"tested as printed; {done.seconds:.0f} s; full report: {out / 'report.md'}",
        soft_wrap=True,
    )
