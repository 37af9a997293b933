"""raychan study laser: what sensor errors do to ranges of a laser scanner on a deck, and how often it sees a target."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from raychan.cli import show
from raychan.cli.options import directory, within
from raychan.world import limits
from raychan.world.limits import Limit

_DRAWS = Limit(2, 10_000_000, "", "a deviation needs two, and more take hours")
_SCANS = Limit(1, 10_000_000, "", "a share needs one, and more take hours")


def laser(
    out: Annotated[
        Path,
        typer.Option(
            "--out", "-o", help="Directory for tables and figures; made if missing.", metavar="DIR", parser=directory
        ),
    ],
    draws: Annotated[
        int, typer.Option(help="Draws of each sensor error.", metavar="N", callback=within(_DRAWS, True))
    ] = 2000,
    scans: Annotated[
        int, typer.Option(help="Scans of each amplitude of roll and pitch.", metavar="N", callback=within(_SCANS, True))
    ] = 400,
    seed: Annotated[
        int, typer.Option(help="Seed of the draws; equal seeds give equal files.", callback=within(limits.SEED, True))
    ] = 0,
) -> None:
    """Chart the range error of a laser scanner on a deck by the errors of its pose: first order beside Monte Carlo.

    Roll, pitch, yaw, position, and a late record, on the sea and on a quay; and the detection probability of a tower
    against amplitudes of roll and pitch. Writes laser_errors.csv, laser_detection.csv and four figures."""
    from raychan.report.laser_figures import FIGURES, laser_pictures
    from raychan.run.files.contents import Contents
    from raychan.run.files.output import staging
    from raychan.study import laser_detection, laser_errors

    tables = "laser_errors.csv", "laser_detection.csv"
    with staging(out, Contents((*tables, *FIGURES), signs=tables)) as stage, show.progress() as tell:
        made = laser_errors.effects(None, draws, seed, lambda what, share: tell(what, 0.7 * share))
        found = laser_detection.detections(scans, seed, lambda what, share: tell(what, 0.7 + 0.3 * share))
        laser_errors.write_csv(made, stage / tables[0])
        laser_detection.write_csv(found, stage / tables[1])
        laser_pictures(made, found, stage)
    screen = show.console()
    heads = (
        "ranges of",
        "by",
        "first order is off by 10 % from",
        "at that or the largest sigma: first order m",
        "Monte Carlo m",
    )
    rows = []
    for (body, source), sigma in laser_errors.departures(made).items():
        some = [e for e in made if (e.body, e.source) == (body, source)]
        at = next((e for e in some if e.sigma == sigma), some[-1])
        said = f"{sigma:.2g} {at.unit}" if sigma is not None else f"not up to {at.sigma:g} {at.unit}"
        rows.append((body, source, said, f"{at.first_order:.3g}", f"{at.monte_carlo:.3g}"))
    screen.print(show.table("Where first order holds", heads, rows, left=(0, 1)))
    everything = [e for e in made if e.source == laser_errors.ALL]
    for e in everything:
        screen.print(
            f"all typical errors, ranges of the {e.body}: {e.monte_carlo:.2f} m (first order {e.first_order:.2f} m)",
            soft_wrap=True,
        )
    screen.print(f"figures and tables: {out}", soft_wrap=True)
