"""raychan explain: where a cell of a map came from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from raychan.cli import show


def explain(
    directory: Annotated[
        Path, typer.Argument(help="Directory that `raychan run` wrote.", metavar="DIR", show_default=False)
    ],
    range: Annotated[float, typer.Option("--range", help="Range of the cell in m.", metavar="M", show_default=False)],
    speed: Annotated[
        float | None,
        typer.Option(
            help="Speed in m/s as the detections print it; the strongest at that range if not given.", metavar="M/S"
        ),
    ] = None,
) -> None:
    """Say which paths, over which bodies, made a cell of the map, and what share of its power each brought."""
    from raychan.run.files import StoreError
    from raychan.run.provenance import explain as explain_result
    from raychan.units import dbm

    try:
        why = explain_result(directory, range, speed)
    except StoreError:
        raise
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    screen = show.console()
    screen.print(
        f"{why.range:.2f} m, range rate {why.rate:+.2f} m/s, speed {why.speed:+.2f} m/s: "
        f"{dbm(why.power):.1f} dBm, {why.label}"
    )
    if not why.contributions:
        screen.print("no path explains this cell: noise")
        return
    for part in why.contributions:
        screen.print(f"  {part.text()}", soft_wrap=True, markup=False)
    screen.print(f"the paths alone give {dbm(why.predicted):.1f} dBm, within {why.error_db:.2f} dB by their refinement")
