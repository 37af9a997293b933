"""How the commands print: tables on standard output, warnings and progress on standard error."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence, Sized
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TextIO

from rich.box import SIMPLE_HEAD
from rich.cells import cell_len
from rich.console import Console
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from raychan.run.result import Result

_COMPILING = "compiling"
_LONG = 3.0  # s: compiling for longer prints a line where there is no progress bar
_SOME = ("azimuth deg", "elevation deg", "error dB", "folded: true m", "true m/s")
# columns shown only where a row has a value
_WIDE = 150  # columns of output to a file or pipe: no table line is cut
_FOLDED = 24  # columns to which text in a table is folded at most; figures are never cut, lines run over instead
_LONGEST = 1000  # columns of a line that runs over


class Interrupted(Exception):
    """Ctrl-C in a command that keeps its finished results; the message says which."""


@contextmanager
def keeping(keep: Callable[[], str]) -> Iterator[None]:
    """Turn Ctrl-C into Interrupted with what `keep` returns: it writes what is finished, if anything, and says which
    that is, '' for none. Where a later part fails, as one that is no scene, what is finished is written, too."""
    from raychan.parallel import was_interrupted

    try:
        yield
    except OSError:  # what cannot be written now could not be then
        raise
    except (KeyboardInterrupt, Exception) as stop:
        kept = keep()
        if isinstance(stop, KeyboardInterrupt) or was_interrupted(stop):
            raise Interrupted(f"interrupted; {kept or 'nothing was written'}") from None
        if kept:
            warn([kept])
        raise


def share(done: int, count: int, things: str) -> str:
    """Return how many of some things are done, with the verb that says where they are."""
    return f"{done} of {count} {things} {'is' if done == 1 else 'are'}"


class _Console(Console):
    def on_broken_pipe(self) -> None:
        """Raise the error for the command line; rich would end the process with code 1."""
        raise BrokenPipeError

    def print(self, *objects: Any, **options: Any) -> None:
        """Print; heads of a table that needs more columns than the terminal has are folded, and where that does not
        help its lines run over: rich would cut figures."""
        tables, fixed = [made for made in objects if isinstance(made, Table)], self._width
        for made in tables:
            if self._needs(made) > self.width:
                _fold_heads(made)
        self.width = max(self.width, *map(self._needs, tables), 0)
        try:
            super().print(*objects, **options)
        finally:
            self._width = fixed

    def _needs(self, made: Table) -> int:
        """Return how many columns a table takes at least."""
        return Measurement.get(self, self.options.update(max_width=_LONGEST), made).minimum


def _fold_heads(made: Table) -> None:
    """Write the heads of columns of figures a word a line."""
    for column in made.columns:
        if column.no_wrap:
            words = str(column.header).split()
            column.header = "\n".join(words)
            column.min_width = max(cell_len(str(part)) for part in (*words, *column.cells))


def console() -> Console:
    """Return the console of standard output."""
    # What is printed has names of files and bodies in it: brackets and colons stand for themselves.
    wide = None if sys.stdout.isatty() else _WIDE
    return _Console(width=wide, highlight=False, soft_wrap=False, markup=False, emoji=False)


@contextmanager
def to_the_end() -> Iterator[Callable[[str], None]]:
    """Yield a function that prints a line; where standard output cannot be written, as its reader went away, the block
    goes on without a word, and the error is raised at its end."""
    screen, lost = console(), list[OSError]()

    def tell(line: str) -> None:
        if not lost:
            try:
                screen.print(line, soft_wrap=True)
            except OSError as error:
                lost.append(error)

    yield tell
    if lost:
        raise lost[0]


def open_streams() -> None:
    """Have standard output and error take all text: what the calling process closed takes it to nowhere, and what the
    encoding does not have, such as bytes of a name that are no text, is printed with backslashes."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
    if hasattr(sys.stdout, "reconfigure"):
        sys.stdout.reconfigure(errors="backslashreplace")


def say(text: str) -> None:
    """Print a line on standard error; where that cannot be written, the command goes on without."""
    try:
        print(text, file=sys.stderr, flush=True)
    except OSError:
        silence(sys.stderr)


def silence(stream: TextIO) -> None:
    """Let a stream that cannot be written end nowhere: Python would complain again when it flushes at the end."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)


def warn(warnings: Iterable[str]) -> None:
    """Print warnings on standard error, a line each."""
    for text in warnings:
        say(f"warning: {text}")


def table(title: str, heads: Sequence[str], rows: Iterable[Sequence[str]], left: Iterable[int] = (0,)) -> Table:
    """Return a table; columns in `left` are set flush left, the others right."""
    made = Table(title=title or None, title_justify="left", title_style="bold", box=SIMPLE_HEAD, pad_edge=False)
    flush, rows = set(left), list(rows)
    for i, head in enumerate(heads):
        longest = max([cell_len(head), *(cell_len(row[i]) for row in rows)])
        if i in flush:
            made.add_column(head, justify="left", overflow="fold", min_width=min(longest, _FOLDED))
        else:
            made.add_column(head, justify="right", no_wrap=True, min_width=longest)
    for row in rows:
        made.add_row(*(Text(cell) for cell in row))
    return made


def detections(result: Result) -> list[Table]:
    """Return the detections of a result as a table, and those not converged as another; numbered together from 1."""
    found = result.detections
    apart = [i for i, converged in enumerate(found.converged) if not converged]
    rest = [i for i in range(len(found.range)) if i not in apart]
    made = []
    if rest or not apart:
        made.append(_detections(result, rest, f"{len(found.range)} detection{_s(found.range)}"))
    if apart:
        title = f"{len(apart)} of {len(found.range)} detection{_s(found.range)}: not converged, error unknown"
        made.append(_detections(result, apart, title))
    return made


def _s(things: Sized) -> str:
    return "" if len(things) == 1 else "s"


def _detections(result: Result, rows: Sequence[int], title: str) -> Table:
    """Return some detections as a table without its empty columns."""
    from raychan.units import dbm

    d = result.detections
    columns = {
        "#": [str(i + 1) for i in rows],
        "range m": [f"{d.range[i]:.2f}" for i in rows],
        "range rate m/s": [f"{d.rate[i]:+.2f}" for i in rows],
        "speed m/s": [f"{d.speed[i]:+.2f}" for i in rows],
        "azimuth deg": [_known(math.degrees(d.azimuth[i]), ".1f") for i in rows],
        "elevation deg": [_known(math.degrees(d.elevation[i]), ".1f") for i in rows],
        "SNR dB": [f"{d.snr[i]:.1f}" for i in rows],
        "power dBm": [f"{dbm(d.power[i]):.1f}" for i in rows],
        "error dB": [_known(d.error_db[i], ".2f") for i in rows],
        "folded: true m": [_known(d.true_range[i], ".2f") if d.folded[i] else "" for i in rows],
        "true m/s": [_known(d.true_rate[i], "+.2f") if d.folded[i] else "" for i in rows],
    }
    shown = {head: cells for head, cells in columns.items() if head not in _SOME or any(cells)}
    reasons = [result.provenance[i] for i in rows]
    words = {"label": [why.label for why in reasons], "bodies": [why.bodies for why in reasons]}
    n = len(shown)
    return table(title, [*shown, *words], zip(*shown.values(), *words.values(), strict=True), left=(n, n + 1))


def _known(value: float, digits: str) -> str:
    return "" if math.isnan(value) else f"{value:{digits}}"


@contextmanager
def progress(quiet: bool = False, kernels: str = "run") -> Iterator[Callable[[str, float], None]]:
    """Yield a function (stage, share done) that shows progress: bars on a terminal, elsewhere one line if kernels must
    be compiled first. Args: quiet shows nothing; kernels names the list of kernels to compile ahead."""
    from raychan.compile.ahead import helped
    from raychan.compile.progress import lost, missing

    with helped(kernels, len(missing())), _told(quiet) as tell:
        yield tell
    warn(filter(None, [lost()]))


@contextmanager
def _told(quiet: bool) -> Iterator[Callable[[str, float], None]]:
    from raychan.compile.progress import watched

    if quiet or not sys.stderr.isatty():
        with watched(_line() if not quiet else lambda done, ahead, seconds: None):
            yield lambda stage, share: None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description:10}"),
        BarColumn(),
        TextColumn("{task.percentage:3.0f} %"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:
        tasks: dict[str, object] = {}

        def tell(stage: str, share: float) -> None:
            if stage not in tasks:
                tasks[stage] = bars.add_task(stage, total=1.0)
            bars.update(tasks[stage], completed=min(1.0, share))  # type: ignore[arg-type]

        def compiling(done: int, ahead: int, seconds: float) -> None:
            tell(_COMPILING, done / max(done + ahead, 1))
            bars.update(tasks[_COMPILING], description=f"{_COMPILING}, once, about {seconds:.0f} s")  # type: ignore[arg-type]

        with watched(compiling):
            yield tell


def _line() -> Callable[[int, int, float], None]:
    """Return a function that prints a line, once, when a command compiles for long."""
    said: list[float] = []

    def compiling(done: int, ahead: int, seconds: float) -> None:
        if seconds > _LONG and not said:
            said.append(seconds)
            say(f"{_COMPILING}, once, about {seconds:.0f} s ({ahead} kernels)")

    return compiling
