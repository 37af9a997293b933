"""Checks of what scanners and scans are given, by the limits of scene files."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.limits import Limit
from raychan.radar.declared import reals
from raychan.scalars import shown


def number(name: str, value: object, limit: Limit, whole: bool = False) -> Any:
    """Return a number (a whole one, as int) within limits. Raises: ValueError with what is allowed."""
    if limit.problem(value, whole):
        kind = "a whole number " if whole else ""
        raise ValueError(f"{name} = {shown(value)}; allowed: {kind}{limit.allowed}")
    return limit.check(name, value, whole)


def one_each(name: str, given: object, count: int, of: str, limit: Limit) -> NDArray[np.float64]:
    """Return numbers (count,) within limits. Raises: ValueError where there are more or fewer, or one is none."""
    values = reals(name, given)
    if values.shape != (count,):
        what = f"{len(values)} values" if values.ndim == 1 else shown(given)
        raise ValueError(f"{name}: {what}; allowed: one for each {of}, here {count}")
    wrong = ~((values >= limit.low) & (values <= limit.high))
    if wrong.any():
        at = int(np.argmax(wrong))
        raise ValueError(f"{name}[{at}] = {values[at]:g}; allowed: {limit.allowed}")
    return values
