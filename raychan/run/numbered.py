"""How lines name detections: how many of all, and their numbers as the table has them."""

from __future__ import annotations

from typing import Any

import numpy as np

_NAMED = 5  # detections that a line names by their numbers


def share_of(chosen: Any) -> str:
    """Return how many of all detections are chosen (n,)."""
    return f"{int(chosen.sum())} of {len(chosen)} detection{'' if len(chosen) == 1 else 's'}"


def verb(chosen: Any) -> str:
    """Return the verb of those chosen (n,)."""
    return "is" if chosen.sum() == 1 else "are"


def numbers(chosen: Any) -> str:
    """Return the numbers of detections, counted from 1 as the table does."""
    rows = np.flatnonzero(chosen) + 1
    more = f" and {len(rows) - _NAMED} more" if len(rows) > _NAMED else ""
    return f"number{'' if len(rows) == 1 else 's'} {', '.join(map(str, rows[:_NAMED]))}{more}"
