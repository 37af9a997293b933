"""`python -m bench` (from tests/), or `make bench`: a table on the screen and all of it as JSON."""

from __future__ import annotations

import argparse
import json
import math
import os
import platform
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from time import perf_counter

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from bench.auto import auto
from bench.before import before
from bench.cold import cold
from bench.cross_section import cross_section
from bench.cylinders import cylinders
from bench.detections import detections
from bench.fine import fine
from bench.frame import frame
from bench.laser import laser
from bench.measure import Row
from bench.memory import memory
from bench.preview import preview
from bench.rays import rays
from bench.ship import ship
from bench.size import size
from bench.synthesis import phase_noise, scaling, synthesis
from bench.threads import threads
from bench.turbine import turbine
from raychan.run.files.output import write_whole
from raychan.run.storage import versions

Benchmark = Callable[[Path, int, bool], Iterator[Row]]
_GROUPS = (
    rays,
    laser,
    synthesis,
    phase_noise,
    scaling,
    frame,
    cold,
    threads,
    before,
    turbine,
    ship,
    size,
    fine,
    memory,
    preview,
    cross_section,
    detections,
    cylinders,
    auto,
)
ALL: dict[str, Benchmark] = {f.__name__: f for f in _GROUPS}
_ROOT = Path(__file__).parents[2]


def main() -> None:
    """Run the benchmarks asked for, show each row as it comes, and write the JSON at the end."""
    parser = argparse.ArgumentParser(prog="make bench", description=main.__doc__)
    parser.add_argument(
        "--out", type=Path, default=_ROOT / "out" / "bench.json", help="JSON file (default %(default)s)"
    )
    parser.add_argument("--quick", action="store_true", help="small cases and coarse tolerances: a few minutes")
    parser.add_argument("--only", action="append", choices=ALL, help="this group only; may be repeated")
    parser.add_argument("--repeats", type=int, default=5, help="times each is run; the median counts (default 5)")
    given = parser.parse_args()
    if given.repeats < 1:
        parser.error("--repeats: at least 1")
    given.out.parent.mkdir(parents=True, exist_ok=True)
    console = Console(width=170 if not os.isatty(1) else None, highlight=False)
    start, done = perf_counter(), []
    for name in given.only or ALL:
        rows = []
        for row in ALL[name](_ROOT / "scenes", given.repeats, given.quick):
            rows.append(row)
            if console.is_terminal:
                console.print(f"{row.group}: {row.name}", style="dim")
        console.print(_table(name, ALL[name].__doc__ or "", rows))
        done += rows
    held = {
        "when": datetime.now(UTC).isoformat(timespec="seconds"),
        "quick": given.quick,
        "repeats": given.repeats,
        "cores": os.cpu_count(),
        "machine": platform.machine(),
        "versions": versions(),
        "seconds": round(perf_counter() - start, 1),
        "rows": [_finite(r.plain()) for r in done],
    }
    write_whole(given.out, (json.dumps(held, indent=2) + "\n").encode())
    missed = [r for r in done if r.met is False]
    console.print(
        f"{len(done)} rows in {held['seconds']:.0f} s, {len(missed)} bars missed; {given.out}", soft_wrap=True
    )


def _table(name: str, about: str, rows: list[Row]) -> Table:
    title = f"{name}: {about.splitlines()[0]}"
    made = Table(title=title, title_justify="left", title_style="bold", box=SIMPLE_HEAD, pad_edge=False)
    for head in ("group", "case", "seconds", "against", "seconds", "ratio", "from to", "bar", "more"):
        numbers = head in ("seconds", "ratio")
        made.add_column(head, justify="right" if numbers else "left", no_wrap=head != "more", overflow="fold")
    for r in rows:
        bar = r.bar and f"{r.bar} {'met' if r.met else 'MISSED'}"
        spread = "" if r.spread is None else f"{r.spread[0]:.3g} {r.spread[1]:.3g}"
        made.add_row(
            r.group,
            r.name,
            _number(r.seconds),
            r.reference,
            _number(r.reference_seconds),
            _number(r.ratio),
            spread,
            bar,
            ", ".join(f"{k} {_brief(v)}" for k, v in r.more.items()),
        )
    return made


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}"


def _brief(value: object) -> str:
    if isinstance(value, dict):
        return " to ".join(map(_brief, value.values()))
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def _finite(row: dict[str, object]) -> dict[str, object]:
    """Return a row as JSON can hold it: what failed has no seconds."""
    return {k: None if isinstance(v, float) and math.isnan(v) else v for k, v in row.items()}


if __name__ == "__main__":
    main()
