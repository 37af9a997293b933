"""Checks of the options of `raychan rcs`: angles, distance, and files to be written."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import typer

from raychan.cli.options import meant
from raychan.world import limits

MOST_ANGLES = 1_000_000


def angles(text: str, option: str) -> Any:
    """Return the angles (n,) [deg] of 'A' or of 'A:B:STEP', B included. Raises: typer.BadParameter."""
    import numpy as np

    try:
        numbers = [float(part) for part in text.split(":")]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 3) or not np.isfinite(numbers).all():
        raise typer.BadParameter(
            f"{option}: '{text}' is neither a number of degrees nor first:last:step, such as -30:30:1"
        )
    for number in numbers:
        meant(limits.ANGLE, option, number)
    if len(numbers) == 1:
        return np.array(numbers)
    first, last, step = numbers
    if step == 0.0 or (last - first) * step < 0.0:
        raise typer.BadParameter(f"{option}: '{text}' never ends: the step must lead from the first angle to the last")
    count = (last - first) / step
    if count > MOST_ANGLES:
        raise typer.BadParameter(f"{option}: '{text}' asks for {count:.3g} angles; at most {MOST_ANGLES} are allowed")
    return first + step * np.arange(int(count + 1e-9) + 1)


def writable(file: Path | None, endings: tuple[str, ...]) -> None:
    """Raise typer.BadParameter where a file that is asked for cannot be written, before anything is computed."""
    if file is None:
        return
    if file.suffix.lower() not in endings:
        raise typer.BadParameter(f"{file}: must end in {' or '.join(endings)}")
    if not file.parent.is_dir():
        raise typer.BadParameter(f"{file}: there is no directory {file.parent}")
    if file.is_dir():
        raise typer.BadParameter(f"{file}: is a directory; name a file")
    if not os.access(file.parent, os.W_OK):
        raise typer.BadParameter(f"{file}: the directory {file.parent} cannot be written to")


def can_be_polar(plot: Path | None, azimuths: int, elevations: int) -> None:
    """Raise typer.BadParameter where a polar figure is not possible."""
    from raychan.report.rcs_figure import MOST_CUTS

    if plot is None:
        raise typer.BadParameter("it needs --plot", param_hint="--polar")
    if azimuths > 1 and elevations > MOST_CUTS:
        raise typer.BadParameter(f"{elevations} cuts; at most {MOST_CUTS} are allowed", param_hint="--polar")


def metres(text: str, option: str) -> float:
    """Return the distance [m] that an option gives, which may be inf. Raises: typer.BadParameter."""
    try:
        far = float(text)
    except ValueError:
        raise typer.BadParameter(f"{option}: '{text}' is not a number of metres, nor inf") from None
    if far != float("inf"):
        meant(limits.LENGTH, option, far)
    return far
