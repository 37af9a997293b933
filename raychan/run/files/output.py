"""Atomic writing of files and folders: all is written, or all but pictures for which there is no room, or nothing.

Files are written beside their place and renamed into it. Unfinished ones are locked by their process; those without a
lock are left over from a killed process, and the next writer of the same place removes them.
"""

from __future__ import annotations

import csv
import errno
import io
import os
import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

from raychan.run.files.atomic_swap import MARK, UNFINISHED, acquire, exchange, locked, release, stale_of
from raychan.run.files.contents import Contents
from raychan.run.files.in_place import held, note_file, note_folder


class StoreError(OSError):
    """A result could not be written or read; says which and why."""


class PictureError(StoreError):
    """A picture could not be written; what it shows may have been."""


@contextmanager
def staging(out: str | Path, contents: Contents, then: Callable[[], None] = lambda: None) -> Iterator[Path]:
    """Yield a temporary directory that becomes `out` when the block ends without an error.

    After any error, Ctrl-C included, the temporary directory is removed and `out` is unchanged; but where a picture
    cannot be written, results that are stay, and the error says so. Files in an old `out` that the command does not
    write stay there. Where `out` cannot be renamed (a mount, the current directory), files are moved into it one by
    one. `then` is called as soon as `out` is in place; signals that end the program wait from before that until all is
    done. Raises: StoreError for errors of the disk, or where a foreign file is in the way."""
    lost, given = None, out
    with _disk_errors(Path(out)):
        out = Path(out).resolve()
    with folder_for(out.parent):
        with _disk_errors(out):
            _clear_stale(out, contents)
            _check(out, contents)
            room, stage, lock = _stage(out)
        try:
            try:
                with _disk_errors(out, stage):
                    yield stage
            except PictureError as error:
                if not contents.signed(stage):
                    raise
                lost = error
            with _disk_errors(out), locked(room), held():
                _check(out, contents)
                _replace(stage, out, contents)
                note_folder(given)
                then()
                _remove_stage(stage, out, contents)
        finally:
            release(lock)
            with locked(room), held():
                _remove_stage(stage, out, contents)
    if lost is not None:
        raise PictureError(f"{lost}; the results without it are in {out}") from lost


@contextmanager
def folder_for(directory: Path) -> Iterator[None]:
    """Make a directory where it is missing; if it is empty at the end, as after an error, it is removed again.

    Raises: StoreError where it cannot be made."""
    made = _make_parents(directory)
    try:
        yield
    finally:
        for new in made:
            if new.is_dir() and not any(new.iterdir()):
                new.rmdir()


def write_whole(path: str | Path, content: bytes | memoryview) -> Path:
    """Write a file completely or not at all. Raises: StoreError for errors of the disk."""
    write_together({Path(path): content})
    return Path(path)


def write_picture(path: str | Path, content: bytes | memoryview) -> Path:
    """Write a picture completely or not at all. Raises: PictureError for errors of the disk."""
    try:
        return write_whole(path, content)
    except StoreError as error:
        raise PictureError(str(error)) from error


def write_together(files: Mapping[Path, bytes | memoryview]) -> None:
    """Write several files completely, or none where the disk has no room for all. Raises: StoreError."""
    with ExitStack() as ready:
        parts = []
        for path, content in files.items():
            with _disk_errors(path):
                there = path.resolve()
            parts.append((ready.enter_context(_part(there, content)), there, path))
        ready.enter_context(held())
        for part, there, path in parts:
            with _disk_errors(path):
                if part is not None:
                    os.replace(part, there)
                note_file(path)


@contextmanager
def _part(path: Path, content: bytes | memoryview) -> Iterator[str | None]:
    """Yield the name of a temporary file with the content; None for a device or pipe, which is written to directly."""
    part, lock = None, None
    try:
        with _disk_errors(path):
            if path.is_dir():
                raise StoreError(f"{path}: is a directory; name a file")
            if path.exists() and not path.is_file():
                path.write_bytes(content)
            else:
                with locked(path.parent):
                    _sweep(path.parent, path.name)
                    handle, part = tempfile.mkstemp(prefix=f".{path.name}{MARK}", dir=path.parent)
                    lock = acquire(part)
                with os.fdopen(handle, "wb") as file:
                    file.write(content)
                os.chmod(part, 0o666 & ~_umask())
        yield part
    finally:
        release(lock)
        if part is not None:
            Path(part).unlink(missing_ok=True)


def csv_bytes(rows: Iterable[Iterable[Any]]) -> bytes:
    """Return rows, the header included, as the bytes of a CSV file."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue().encode()


@contextmanager
def _disk_errors(path: Path, stage: Path | None = None) -> Iterator[None]:
    """Turn errors of the disk into a StoreError that names the path, not the temporary folder."""
    try:
        yield
    except StoreError as error:
        if stage is None:
            raise
        raise type(error)(str(error).replace(str(stage), str(path))) from error
    except OSError as error:
        raise StoreError(f"{path}: cannot write: {error.strerror or error}") from error
    except RuntimeError as error:
        if not _in_a_circle(path):
            raise
        raise StoreError(f"{path}: cannot write: its links lead in a circle") from error


def _in_a_circle(path: Path) -> bool:
    """Tell whether links of a path lead in a circle; Path.resolve then raises RuntimeError before Python 3.13."""
    try:
        os.stat(path)
    except OSError as error:
        return error.errno == errno.ELOOP
    return False


def _check(out: Path, what: Contents) -> None:
    """Raise StoreError where foreign files are in the way."""
    if not out.is_dir():
        if out.exists():
            raise StoreError(f"{out}: is a file; name a directory")
        return
    if obstacle := what.obstacle(out):
        raise StoreError(obstacle)


def _stage(out: Path) -> tuple[Path, Path, int | None]:
    """Make a folder to build in, beside `out` or, if not possible, within; return its parent, the folder, its lock."""
    within = out.is_dir() and (os.path.ismount(out) or not os.access(out.parent, os.W_OK))
    room = out if within else out.parent
    with locked(room):
        stage = Path(tempfile.mkdtemp(prefix=f".{out.name}{MARK}", dir=room))
        stage.chmod(0o777 & ~_umask())
        (stage / UNFINISHED).touch()
        return room, stage, acquire(stage / UNFINISHED)


def _replace(stage: Path, out: Path, what: Contents) -> None:
    """Exchange a finished stage with `out`; the old contents are then in the stage's place."""
    if not out.exists():
        (stage / UNFINISHED).unlink()
        os.rename(stage, out)
    elif stage.parent == out or out == Path.cwd() or not exchange(stage, out):
        _file_by_file(stage, out, what)
    else:
        (out / UNFINISHED).unlink()


def _file_by_file(stage: Path, out: Path, what: Contents) -> None:
    """Move the files of a stage into a folder that cannot be renamed, after removing those of an earlier run."""
    _strip(out, what)
    _move(stage, out)


def _strip(folder: Path, what: Contents) -> None:
    """Remove the command's files from a folder, the signs first: a folder without signs is not taken for a result."""
    for old in sorted(folder.iterdir(), key=lambda e: not any(fnmatch(e.name, s) for s in what.signs)):
        if what.owns(old):
            _remove(old)
        elif old.is_dir() and what.nests(old):
            _strip(old, what)


def _move(stage: Path, out: Path) -> None:
    for file in stage.iterdir():
        there = out / file.name
        if file.is_dir() and there.is_dir():
            _move(file, there)
        elif file.name != UNFINISHED:
            os.replace(file, there)


def _remove_stage(stage: Path, out: Path, what: Contents) -> None:
    """Remove what is in a stage's place: a stage that failed, or the folder that was replaced, whose foreign files are
    moved into the new one."""
    if not stage.is_dir():
        return
    if not (stage / UNFINISHED).exists():
        if not out.exists() and any(stage.iterdir()):
            os.rename(stage, out)  # a process was killed while it replaced the folder
            return
        _move_foreign(stage, out, what)
    # The mark is removed last: a process killed on the way leaves a folder that is still recognised as stale.
    for entry in sorted(stage.iterdir(), key=lambda e: e.name == UNFINISHED):
        _remove(entry)
    stage.rmdir()


def _move_foreign(old: Path, new: Path, what: Contents) -> None:
    """Move foreign files from a replaced folder into the new one; mark the rest as stale."""
    for entry in old.iterdir():
        there = new / entry.name
        if what.owns(entry):
            continue
        if entry.is_dir() and not entry.is_symlink() and what.nests(entry):
            there.mkdir(exist_ok=True)
            _move_foreign(entry, there, what)
            continue
        while os.path.lexists(there):  # made since the check
            there = there.with_name(f"{there.name}.kept")
        os.rename(entry, there)
    (old / UNFINISHED).touch()


def _clear_stale(out: Path, what: Contents) -> None:
    """Remove what killed processes left while building `out`; restore a folder that one was about to replace."""
    with locked(out.parent):
        for stale in stale_of(out.parent, out.name):
            if stale.is_dir():
                _remove_stage(stale, out, what)
    if out.is_dir():
        (out / UNFINISHED).unlink(missing_ok=True)
        _sweep(out, out.name)


def _sweep(folder: Path, name: str) -> None:
    """Remove what killed processes left in a folder while building `name`."""
    for stale in stale_of(folder, name):
        _remove(stale)


def _remove(entry: Path) -> None:
    if entry.is_dir() and not entry.is_symlink():
        shutil.rmtree(entry, ignore_errors=True)
    else:
        entry.unlink(missing_ok=True)


def _make_parents(directory: Path) -> list[Path]:
    """Make a directory and return those that were missing, innermost first."""
    try:
        missing = [d for d in (directory, *directory.parents) if not d.exists()]
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StoreError(f"{directory}: cannot be made: {error.strerror or error}") from error
    return missing


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
