"""Atomic replacement of folders: locks that end with their process, names of what is being built, and the exchange."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

MARK = ".raychan-"  # part of the name of everything under construction
UNFINISHED = ".raychan-unfinished"  # file in a folder under construction, locked by its process
_HERE = -100  # AT_FDCWD
_EXCHANGE = 2  # RENAME_EXCHANGE


def acquire(path: str | Path, wait: bool = False) -> int | None:
    """Lock a file or folder until `release` or the end of the process; None where it is taken or not possible."""
    try:
        import fcntl
    except ImportError:
        return None
    try:
        handle = os.open(path, os.O_RDONLY)
    except OSError:
        return None
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except BaseException as error:
        os.close(handle)
        if isinstance(error, OSError):
            return None
        raise
    return handle


def release(lock: int | None) -> None:
    """Release a lock of `acquire`."""
    if lock is not None:
        os.close(lock)


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Let one process at a time rename within a folder."""
    lock = acquire(folder, wait=True)
    try:
        yield
    finally:
        release(lock)


def exchange(new: Path, old: Path) -> bool:
    """Exchange the names of two folders of one parent and return True; False, with nothing changed, if not possible.

    Atomic on Linux; elsewhere by three renames, between which `old` is missing for a moment.
    """
    if _exchange_at_once(new, old):
        return True
    aside = new.with_name(f"{new.name}-old")
    try:
        os.rename(old, aside)
    except OSError:
        return False
    try:
        os.rename(new, old)
    except OSError:
        os.rename(aside, old)
        return False
    os.rename(aside, new)
    return True


def _exchange_at_once(new: Path, old: Path) -> bool:
    try:
        rename: Any = ctypes.CDLL(None).renameat2
    except (OSError, AttributeError, TypeError):
        return False
    return rename(_HERE, os.fsencode(new), _HERE, os.fsencode(old), _EXCHANGE) == 0


def stale_of(folder: Path, name: str) -> list[Path]:
    """Return what killed processes left behind while building `name` in a folder; call with the folder locked."""
    if not folder.is_dir():
        return []
    return [e for e in sorted(folder.iterdir()) if e.name.startswith(f".{name}{MARK}") and is_dead(e)]


def is_mark(entry: Path) -> bool:
    """Return whether a name is that of something under construction."""
    return entry.name.startswith(".") and MARK in entry.name


def is_dead(entry: Path) -> bool:
    """Return whether no process is building this any more."""
    sign = entry / UNFINISHED if entry.is_dir() else entry
    lock = acquire(sign)
    release(lock)
    return lock is not None or not sign.exists()
