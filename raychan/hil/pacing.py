"""Time on serial lines: how long bytes take, a schedule that does not drift, and frames that find the line busy.

Nothing here reads a clock: times [s] are arguments, of one monotonic clock.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field

import numpy as np

BITS_PER_BYTE = 10
"""One start bit, eight data bits, one stop bit."""


_PRIORITY = 10
"""Of SCHED_FIFO, whose threads run before all ordinary ones. Any does; those of the kernel have 50."""


def run_first(first: bool = True) -> bool:
    """Ask the system to run this thread before ordinary ones, or as one of them; return whether it goes first."""
    try:
        policy = os.SCHED_FIFO if first else os.SCHED_OTHER
        os.sched_setscheduler(0, policy, os.sched_param(_PRIORITY if first else 0))
    except (AttributeError, OSError):
        return False
    return first


def line_time(count: int, baud: int) -> float:
    """Return how long [s] a number of bytes takes on a line of `baud` [bit/s], 8N1."""
    return count * BITS_PER_BYTE / baud


@dataclass
class Line:
    """A line of a given rate: a frame goes out whole once the one before it has, or is dropped and counted.

    A pseudo-terminal has no rate of its own. Fields: baud [bit/s]; free_at [s] when the last byte has left;
    sent, dropped numbers of frames.
    """

    baud: int
    free_at: float = -math.inf
    sent: int = 0
    dropped: int = 0

    def offer(self, now: float, count: int) -> float | None:
        """Return when [s] the last of `count` bytes has left, or None where the line is busy and the frame is dropped.

        The host of a real scanner sees the newest scan: one that finds the line busy is not kept for later.
        """
        if now < self.free_at:
            self.dropped += 1
            return None
        self.sent += 1
        return self.reserve(now, count)

    def reserve(self, now: float, count: int) -> float:
        """Return when [s] the last of `count` bytes has left that wait until the line is free."""
        self.free_at = max(now, self.free_at) + line_time(count, self.baud)
        return self.free_at


@dataclass(frozen=True)
class Timing:
    """How well a schedule was kept.

    Fields: ticks kept; missed ticks that were passed over; drift [s], median lateness of the last tenth less that of
    the first; jitter_p99 [s], 99th percentile of the distance from the median lateness.
    """

    ticks: int
    missed: int
    drift: float
    jitter_p99: float


class Lateness:
    """How late things were, over a run of any length: of more than KEPT values every second is dropped, then every
    second of the rest, so that what is kept spreads evenly over the run. `count` is of all."""

    KEPT = 65_536

    def __init__(self) -> None:
        self.count = 0
        self._every = 1
        self._values: list[float] = []

    def note(self, seconds: float) -> None:
        """Note a lateness [s]."""
        if self.count % self._every == 0:
            self._values.append(seconds)
            if len(self._values) > self.KEPT:
                del self._values[1::2]
                self._every *= 2
        self.count += 1

    def timing(self, missed: int = 0) -> Timing:
        """Return drift and jitter, zeros of no values. Args: missed ticks, which are only told."""
        late = np.array(self._values)
        if not len(late):
            return Timing(0, missed, 0.0, 0.0)
        tenth = max(1, len(late) // 10)
        drift = float(np.median(late[-tenth:]) - np.median(late[:tenth]))
        jitter = float(np.percentile(np.abs(late - np.median(late)), 99))
        return Timing(self.count, missed, drift, jitter)


@dataclass
class Schedule:
    """Ticks at start + k period, counted from the start, so that no lateness adds up.

    Fields: start [s], period [s].
    """

    start: float
    period: float
    missed: int = 0
    _next: int = 0
    _late: Lateness = field(default_factory=Lateness)

    def __post_init__(self) -> None:
        if not (self.period > 0.0 and math.isfinite(self.period)):
            raise ValueError(f"period is {self.period} s; allowed: above 0")

    @property
    def due(self) -> float:
        """When [s] the next tick is due."""
        return self.start + self._next * self.period

    def tick(self, now: float) -> int:
        """Note that the next tick is done at `now` [s]; return how many later ones are passed over, being overdue."""
        self._late.note(now - self.due)
        passed = max(0, math.floor((now - self.due) / self.period))
        self.missed += passed
        self._next += 1 + passed
        return passed

    def change(self, start: float, period: float) -> None:
        """Go on with ticks from another start [s] at another period [s]; what was noted stays."""
        self.start, self.period, self._next = start, period, 0

    def timing(self) -> Timing:
        """Return how well the schedule was kept so far; zeros before the first tick."""
        return self._late.timing(self.missed)
