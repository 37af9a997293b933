"""raychan explain: the paths behind a detection or a map cell."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from raychan.cli import show
from raychan.cli.options import within
from raychan.world import limits

if TYPE_CHECKING:
    from rich.table import Table

    from raychan.run.explain import CellExplanation, CellPaths

_MOVES = 0.1  # dB: sums that differ by more are not those of the same paths
_COUNTS = 1e-3  # of the strongest contribution to the cell: weaker paths are not listed
_OTHERS = 5  # most other detections that are named
_Paths = Annotated[
    int,
    typer.Option(
        help="Number of paths to list, strongest contribution first.",
        metavar="N",
        callback=within(limits.LISTED, True),
    ),
]


def explain(
    directory: Annotated[
        Path, typer.Argument(help="Directory that `raychan run` wrote.", metavar="DIR", show_default=False)
    ],
    range: Annotated[
        float | None,
        typer.Option(
            "--range", help="Range in m; the nearest detection within a resolution cell is taken.", metavar="M",
            show_default=False,
        ),
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(help="Speed in m/s as the detections print it; any if not given.", metavar="M/S"),
    ] = None,
    detection: Annotated[
        int | None,
        typer.Option(
            help="Number of a detection instead: 1 is the first in the list of `raychan run` and in detections.csv.",
            metavar="N",
        ),
    ] = None,
    cell: Annotated[
        bool,
        typer.Option(
            "--cell", help="Explain the map cell at --range and --speed (strongest if not given), not a detection."
        ),
    ] = False,
    paths: _Paths = 10,
) -> None:  # fmt: skip
    """List the paths, with their bodies, that make a detection or a map cell, and the contribution of each.

    Each path has two powers and phases: those of its contribution to the cell, in which all paths add coherently, and
    its own at the start of the frame. Angles are azimuth and elevation in world axes.
    """
    from raychan.run.explain import explain as explain_result
    from raychan.run.files.output import StoreError

    try:
        why = explain_result(directory, range, speed, detection=detection, cell=cell)
    except StoreError:
        raise
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    screen = show.console()
    for line in _head(why, range is not None and not cell):
        screen.print(line, soft_wrap=True)
    if not why.contributions:
        screen.print(f"no path explains this cell: {why.bodies}")
        return
    for line in _chains(why):
        screen.print(line, soft_wrap=True)
    if why.paths is not None and paths:
        screen.print(_listed(why.paths, paths))
    screen.print(_sum(why), soft_wrap=True)


def _head(why: CellExplanation, searched: bool) -> list[str]:
    from raychan.units import dbm

    taken = f"detection {why.detection}" if why.detection else "map cell"
    if searched and not why.detection:
        taken = "no detection within a resolution cell; map cell"
    others = ", ".join(map(str, why.others[:_OTHERS])) + (" ..." if len(why.others) > _OTHERS else "")
    also = f" (detection {others} within a cell too)" if others else ""
    lines = [
        f"{taken}{also}: {why.range:.2f} m, range rate {why.rate:+.2f} m/s, speed {why.speed:+.2f} m/s: "
        f"{dbm(why.power):.1f} dBm, {why.label}"
    ]
    if why.folded:
        rate = "" if math.isnan(why.true_rate) else f", {why.true_rate:+.2f} m/s"
        lines.append(f"folded: truly at {why.true_range:.2f} m{rate}, outside the waveform's unambiguous range or rate")
    return lines


def _chains(why: CellExplanation) -> list[str]:
    """Return a line for each chain, with the power and phase of its contribution to the cell."""
    import numpy as np

    from raychan.units import dbm

    lines = []
    for part in why.contributions:
        brings = ""
        if why.paths is not None and (mine := why.paths.of(part)).any():
            wave = why.paths.wave[mine].sum()
            brings = f", {dbm(abs(wave) ** 2):.1f} dBm at {np.degrees(np.angle(wave)):+.0f} deg"
        lines.append(f"  {part.text()}{brings}")
    if why.beam:
        lines.append("shares and levels are those in the array's beam of the detection, with nulls towards others")
    elif why.antennas > 1:
        power = "of the detection is in a beam" if why.detection else "of the cell is the mean over antennas"
        lines.append(f"levels of paths are those at the middle of the array; the power {power}")
    return lines


def _listed(paths: CellPaths, most: int) -> Table:
    import numpy as np

    from raychan.units import dbm

    brought = np.abs(paths.wave)
    counting = int((brought > _COUNTS * brought.max(initial=0.0)).sum())
    count = min(most, counting)
    heads = (
        "in cell dBm",
        "deg",
        "path dBm",
        "deg",
        "range m",
        "rate m/s",
        "departs deg",
        "arrives deg",
        "interactions",
    )
    rows = []
    for i in np.arange(count):
        wave, power = paths.wave[i], paths.power[i]
        ends = (f"{az:+.1f}, {el:+.1f}" for az, el in np.degrees([paths.departure[i], paths.arrival[i]]))
        rows.append([
            f"{dbm(abs(wave) ** 2):.1f}", f"{np.degrees(np.angle(wave)):+.1f}", f"{dbm(power):.1f}",
            f"{np.degrees(paths.phase[i]):+.1f}", f"{paths.range[i]:.3f}", f"{paths.rate[i]:+.3f}", *ends,
            f"{paths.interactions[i]}: {', '.join(paths.met[paths.chain[i]]) or 'none'}",
        ])  # fmt: skip
    rest = counting - count
    left = paths.wave[count:].sum()
    others = f"; the weaker ones add up to {dbm(abs(left) ** 2):.1f} dBm" if rest else ""
    title = f"{count} of {counting} paths within 60 dB of the strongest in the cell{others}"
    return show.table(title, heads, rows, left=(8,))


def _sum(why: CellExplanation) -> str:
    from raychan.units import dbm

    error = f"stated error {why.error_db:.2f} dB" if why.converged else "not converged: error unknown"
    off = f", {why.reciprocity_db:.1f} dB off reciprocity" if why.reciprocity_db >= 0.1 else ""
    sums = dbm(why.predicted)
    if why.paths is not None and (why.beam or why.antennas == 1):
        constant = dbm(max(abs(why.paths.wave.sum()) ** 2, 1e-300))
        if abs(constant - sums) > _MOVES:
            return (
                f"sum of the paths, as bodies turn or pass within the frame: {sums:.1f} dBm, {error}{off}; paths "
                f"of its middle, of constant rates, add up to {constant:.1f} dBm"
            )
    return f"sum of the paths: {sums:.1f} dBm, {error}{off}"
