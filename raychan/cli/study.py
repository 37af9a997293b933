"""raychan study: error against effort, stability, sweeps over scenes, and a laser scanner on a deck."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from raychan.cli import show
from raychan.cli.options import directory, help_of
from raychan.cli.study_laser import laser
from raychan.cli.study_sensitivity import sensitivity
from raychan.cli.study_stability import stability
from raychan.cli.study_sweep import sweep

if TYPE_CHECKING:
    from raychan.study.tradeoff import Row

study = typer.Typer(
    no_args_is_help=True,
    help="Studies: error against effort; checks where ray methods fail; one body in varied scenes; speckle or error; "
    "a laser scanner.",
)


@study.callback()
def _top() -> None:
    pass


def tradeoff(
    out: Annotated[
        Path,
        typer.Option(
            "--out", "-o", help="Directory for figures and CSV; made if missing.", metavar="DIR", parser=directory
        ),
    ],
    case: Annotated[
        list[str] | None,
        typer.Option("--case", help="Only this case; may be repeated.", metavar="NAME", show_default=False),
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="Fewer settings, and coarser references for the largest cases.")
    ] = False,
    beside: Annotated[
        Path | None,
        typer.Option(
            "--beside",
            help="Also draw the Pareto front of an earlier run in the summary.",
            metavar="OLD.csv",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Chart error against seconds and rays: five methods on six cases.

    Writes tradeoff.csv, tradeoff_CASE.png for each case and tradeoff.png with the Pareto front of the settings.
    """
    from raychan.report.tradeoff_figures import case_picture, summary_picture
    from raychan.run.files.contents import Contents
    from raychan.run.files.output import staging
    from raychan.study.tradeoff import comparable, read_csv, tradeoff, write_csv
    from raychan.study.verdicts import verdicts

    try:
        earlier = read_csv(beside) if beside else []
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--beside") from None
    contents = Contents(("tradeoff.csv", "tradeoff.png", "tradeoff_*.png"), signs=("tradeoff.csv",))
    with staging(out, contents) as stage, show.progress() as tell:
        try:
            rows = tradeoff(case or (), quick=quick, progress=tell)
        except ValueError as error:
            raise typer.BadParameter(str(error)) from None
        write_csv(rows, stage / "tradeoff.csv")
        for name in dict.fromkeys(r.case for r in rows):
            case_picture([r for r in rows if r.case == name], stage / f"tradeoff_{name}.png")
        same, said = comparable(rows, earlier) if earlier else ([], [])
        summary_picture(rows, stage / "tradeoff.png", same)
    screen = show.console()
    heads = ["case", "method", "setting", "rays", "seconds", "rms error dB", "on the front"]
    screen.print(show.table("Error against effort", heads, [_cells(r) for r in rows], left=(0, 1, 2, 6)))
    for line in [*verdicts(rows), *said]:
        screen.print(line, soft_wrap=True)
    screen.print(f"figures and table: {out}", soft_wrap=True)


for command in (tradeoff, stability, sweep, sensitivity, laser):
    study.command(help=help_of(command))(command)


def _cells(r: Row) -> list[str]:
    fronts = [name for name, on in (("rays", r.front_rays), ("seconds", r.front_seconds)) if on]
    setting = f"{r.setting} (default)" if r.default else r.setting
    return [
        r.case, r.method, setting, f"{r.rays:,.0f}", f"{r.seconds:.3f}", f"{r.error_db:.2f}", ", ".join(fronts),
    ]  # fmt: skip
