"""Writing a directory of results so that either all of it is there or nothing changed."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class StoreError(OSError):
    """A result could not be written or read; says which and why."""


@contextmanager
def staging(out: str | Path) -> Iterator[Path]:
    """Give a temporary directory beside `out`; its files move into `out` when the block ends well.

    Whatever goes wrong inside, Ctrl-C included, the temporary directory goes away and `out` is as it was.
    Raises: StoreError where the disk refuses.
    """
    out = Path(out).resolve()
    if out.exists() and not out.is_dir():
        raise StoreError(f"{out}: is a file; a directory is wanted")
    made = _make_parents(out.parent)
    stage: Path | None = None
    try:
        stage = Path(tempfile.mkdtemp(prefix=f".{out.name}.", dir=out.parent))
        stage.chmod(0o777 & ~_umask())
        yield stage
        if out.exists():
            for file in sorted(stage.iterdir()):
                os.replace(file, out / file.name)
        else:
            os.rename(stage, out)
        made = []
    except StoreError:
        raise
    except OSError as error:
        raise StoreError(f"{out}: cannot write: {error.strerror or error}") from error
    finally:
        if stage is not None:
            shutil.rmtree(stage, ignore_errors=True)
        for directory in made:
            if directory.is_dir() and not any(directory.iterdir()):
                directory.rmdir()


def write_whole(path: str | Path, content: bytes) -> Path:
    """Write a file so that it is there whole or as it was before. Raises: StoreError where the disk refuses."""
    path = Path(path)
    part = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        part.write_bytes(content)
        os.replace(part, path)
    except OSError as error:
        raise StoreError(f"{path}: cannot write: {error.strerror or error}") from error
    finally:
        part.unlink(missing_ok=True)
    return path


def _make_parents(directory: Path) -> list[Path]:
    """Make a directory and return those that were missing, innermost first."""
    missing = [d for d in (directory, *directory.parents) if not d.exists()]
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StoreError(f"{directory}: cannot be made: {error.strerror or error}") from error
    return missing


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
