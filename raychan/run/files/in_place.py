"""What a command has put in place, and how signals wait while it does: results are all of before or all new."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

from raychan.run.files.atomic_swap import is_mark

ENDS: tuple[int, ...] = (signal.SIGINT, signal.SIGTERM, *([signal.SIGHUP] if hasattr(signal, "SIGHUP") else []))
"""Signals that ask a command to end; SIGHUP comes as its terminal is closed."""
_folders: list[Path] = []
_files: list[Path] = []


@contextmanager
def held() -> Iterator[None]:
    """Have signals that end the program wait until the block is done; the first of them then does what it does."""
    waiting, before, over = list[int](), dict[int, Callable[[int, FrameType | None], Any]](), False

    def later(number: int, frame: FrameType | None) -> None:
        if over:  # one that comes as handlers are set back
            before[number](number, frame)
        else:
            waiting.append(number)

    try:
        for number in ENDS if threading.current_thread() is threading.main_thread() else ():
            handler = signal.getsignal(number)
            if callable(handler):
                before[number] = handler
                signal.signal(number, later)
        yield
    finally:
        over = True
        for number, handler in before.items():
            signal.signal(number, handler)
    if waiting:
        before[waiting[0]](waiting[0], None)


def note_folder(folder: str | Path) -> None:
    """Note a folder of results that is in place; one within a folder under construction is not, nor one within a
    folder that is noted."""
    out = Path(folder)
    if not _under_construction(out) and not any(known in (out, *out.parents) for known in _folders):
        _folders.append(out)


def note_file(file: Path) -> None:
    """Note a file that is in place, except in a folder under construction."""
    if not _under_construction(file) and file not in _files:
        _files.append(file)


def _under_construction(path: Path) -> bool:
    return any(map(is_mark, (path, *path.parents)))


def forget() -> None:
    """Forget what is noted, before another command."""
    _folders.clear()
    _files.clear()


def told() -> str:
    """Return what is in place as a part of a sentence, '' where nothing is."""
    parts = [("the results are in", _folders), ("written:", _files)]
    return "; ".join(f"{what} {', '.join(map(str, paths))}" for what, paths in parts if paths)
