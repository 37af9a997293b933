"""Timing: ratios of things done in turn, median of several, so that another load on the machine meets both alike."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from statistics import median
from time import perf_counter
from typing import Any


@dataclass
class Row:
    """One measurement: `seconds` of ours, of `reference`, and their ratio ours over reference, with its spread."""

    group: str
    name: str
    seconds: float
    reference: str = ""
    reference_seconds: float | None = None
    ratio: float | None = None
    spread: tuple[float, float] | None = None
    bar: str = ""
    met: bool | None = None
    more: dict[str, Any] = field(default_factory=dict)
    """Counts and figures beside the time."""

    def plain(self) -> dict[str, Any]:
        """Return what JSON holds."""
        return asdict(self)


def seconds(call: Callable[[], Any]) -> float:
    """Return what one call takes [s]."""
    start = perf_counter()
    call()
    return perf_counter() - start


def alone(group: str, name: str, call: Callable[[], Any], repeats: int, **more: Any) -> Row:
    """Return the median time of a call that has been warmed."""
    call()
    return Row(group, name, median(seconds(call) for _ in range(repeats)), more=more)


def against(
    group: str,
    name: str,
    ours: Callable[[], Any],
    reference: str,
    theirs: Callable[[], Any],
    repeats: int,
    times: float = 1.0,
    **more: Any,
) -> Row:
    """Return the median of ratios ours over theirs, each of two calls one after the other; both warmed.

    Args: times: by how much their cost stands for more work than was done, where it is proportional to it.
    """
    ours()
    theirs()
    pairs = [(seconds(ours), times * seconds(theirs)) for _ in range(repeats)]
    return paired(group, name, pairs, reference, **more)


def rounds(group: str, calls: Sequence[tuple[str, Callable[[], Any]]], repeats: int) -> list[Row]:
    """Return a row for each call but the first, against the first: all are warmed, then timed round by round."""
    for _, call in calls:
        call()
    times = [[seconds(call) for _, call in calls] for _ in range(repeats)]
    return [
        paired(group, name, [(t[i], t[0]) for t in times], calls[0][0]) for i, (name, _) in enumerate(calls) if i > 0
    ]


def paired(group: str, name: str, pairs: Sequence[tuple[float, float]], reference: str, **more: Any) -> Row:
    """Return the row of pairs of seconds, ours and theirs."""
    ratios = [a / b for a, b in pairs]
    own, other = median(a for a, _ in pairs), median(b for _, b in pairs)
    return Row(group, name, own, reference, other, median(ratios), (min(ratios), max(ratios)), more=more)


def barred(row: Row, text: str, met: bool) -> Row:
    """Return the row with the bar that the project sets itself."""
    row.bar, row.met = text, bool(met)
    return row
