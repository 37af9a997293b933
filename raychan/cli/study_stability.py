"""raychan study stability: the simulator in regimes where ray methods fail."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from raychan.cli import show
from raychan.cli.options import directory


def stability(
    out: Annotated[
        Path,
        typer.Option(
            "--out", "-o", help="Directory for table and figures; made if missing.", metavar="DIR", parser=directory
        ),
    ],
    quick: Annotated[
        bool, typer.Option("--quick", help="Leave out the largest cases: 1e5 rays at edges, not 1e7; no 1e7 paths.")
    ] = False,
    only: Annotated[
        list[str] | None, typer.Option("--only", help="Run only this regime; may be repeated.", metavar="REGIME")
    ] = None,
) -> None:
    """Run checks in regimes where ray methods fail, and list expected and computed values.

    Writes stability.md, stability.csv and figures. Failures are listed; the exit code is 0 also then.
    """
    from raychan.report.stability_figures import FIGURES, pictures
    from raychan.run.files.contents import Contents
    from raychan.run.files.output import staging
    from raychan.study.stability import cells, summary, write_csv, write_markdown
    from raychan.study.stability import stability as study

    contents = Contents(("stability.csv", "stability.md", *FIGURES), signs=("stability.csv",))
    with staging(out, contents) as stage, show.progress() as tell:
        try:
            done = study(quick, only or (), tell)
        except ValueError as error:
            raise typer.BadParameter(str(error), param_hint="--only") from None
        write_csv(done, stage / "stability.csv")
        drawn = pictures(done, stage)
        write_markdown(done, stage / "stability.md", [p.name for p in drawn])
    screen = show.console()
    heads = ("regime", "checks", "failures", "worst/tolerance", "seconds")
    screen.print(show.table("Stability", heads, summary(done)))
    failed = [(t, r) for t in done for r in t.failed]
    if failed:
        rows = [(c[0], c[1], c[2], c[3], c[5], c[8]) for c in (cells(t, r) for t, r in failed)]
        title = f"{len(failed)} failure{'' if len(failed) == 1 else 's'}"
        screen.print(show.table(title, ("regime", "case", "expected", "seen", "unit", "cause"), rows, left=(0, 1, 5)))
    total = sum(len(t.outcome.rows) for t in done)
    screen.print(f"{total - len(failed)} of {total} checks pass; full report: {out / 'stability.md'}", soft_wrap=True)
