"""What `raychan hil --out` writes: track.csv as the ship sails, summary.json at the end; files of others stay."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from queue import SimpleQueue
from threading import Thread
from typing import TYPE_CHECKING, Any

from raychan.cli import show

if TYPE_CHECKING:
    from raychan.hil.instruments import Instruments, Reading

_TRACK = (
    "utc", "t_s", "north_m", "east_m", "latitude_deg", "longitude_deg", "heading_deg", "roll_deg", "pitch_deg",
    "rudder_deg", "speed_mps",
)  # fmt: skip
_SUMMARY = "summary.json"
_BEGINS = {_SUMMARY: b'{"ended":', "track.csv": b"utc,t_s,north_m,"}


def check_out(out: Path, names: tuple[str, ...] = tuple(_BEGINS)) -> None:
    """Raise StoreError where files of others, or of another command, would be replaced."""
    from raychan.run.files.contents import Contents
    from raychan.run.files.output import StoreError

    if obstacle := Contents(names, signs=names, begins=_BEGINS).obstacle_of_each(out):
        raise StoreError(obstacle)


def write_summary(out: Path, numbers: dict[str, Any]) -> None:
    """Write the numbers of a run. Raises: StoreError for errors of the disk, and for a file of another's."""
    from raychan.run.files.output import write_whole

    check_out(out, (_SUMMARY,))
    write_whole(out / _SUMMARY, json.dumps(numbers, indent=2).encode())


@contextmanager
def track(out: Path | None) -> Iterator[Callable[[Instruments, Reading], None]]:
    """Yield a function that writes each reading into track.csv, where there is a directory. Raises: StoreError."""
    from raychan.run.files.output import StoreError

    if out is None:
        yield lambda instruments, at: None
        return
    name = out / "track.csv"
    try:
        out.mkdir(parents=True, exist_ok=True)
        file = name.open("w", newline="")
    except OSError as error:
        raise StoreError(f"{out}: cannot write: {error.strerror or error}") from error
    rows = csv.writer(file)
    lost: list[str] = []  # why the file ends early: a full disk does not end the run
    waiting: SimpleQueue[tuple[Instruments, Reading] | None] = SimpleQueue()

    def write() -> None:
        _try(lambda: rows.writerow(_TRACK), lost)
        while (one := waiting.get()) is not None:
            if not lost:
                _try(lambda one=one: rows.writerow(_row(*one)), lost)  # type: ignore[misc]

    # A disk may keep a writer waiting for longer than a scan takes.
    writer = Thread(target=write, daemon=True)
    writer.start()
    try:
        yield lambda instruments, at: waiting.put((instruments, at))
    finally:
        waiting.put(None)
        writer.join()
        _try(file.close, lost)
        show.warn(f"{name}: not whole: {why}" for why in lost[:1])


def _try(write: Callable[[], object], lost: list[str]) -> None:
    """Write, and note why not where it cannot be."""
    try:
        write()
    except OSError as error:
        lost.append(error.strerror or str(error))


def _row(instruments: Instruments, at: Reading) -> list[str]:
    """Return a reading as a row of track.csv."""
    from raychan.run.ship.files import rounded_heading

    heading, *angles = (math.degrees(a) for a in (at.heading, at.roll, at.pitch, at.rudder))
    where = (at.time, at.north, at.east)
    return [
        instruments.utc(at).isoformat(timespec="milliseconds"),
        *(f"{v:.4f}" for v in where),
        *(f"{a:.9f}" for a in instruments.place(at)),
        rounded_heading(heading, ".4f"),
        *(f"{v:.4f}" for v in (*angles, at.speed)),
    ]
