"""The cache of compiled code on disk, which any number of processes read and write at once.

Numba keeps an index beside its data files and picks a data file's name by what the index holds: two processes that
compile at once leave an index of one with code of the other. Here there is no index. A file's name is a digest of
all that its code depends on; it appears whole or not at all, and names what it holds itself.

A process that compiles holds a lock meanwhile, and another process that needs the same code waits for it. A function
waits only for those that it calls, so no two processes wait for each other.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import pickle
import platform
import uuid
from collections.abc import Callable, Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

import llvmlite
import numba
from numba.core import config
from numba.core.caching import FunctionCache
from numba.core.serialize import dumps

try:
    import fcntl
except ImportError:  # not on Windows
    fcntl = None  # type: ignore[assignment]

# What else compiled code depends on: versions, and numba's switches that change what is generated.
_SWITCHES = ("BOUNDSCHECK", "OPT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "DEBUGINFO_DEFAULT", "LLVM_REFPRUNE_PASS")
_DIGEST = 32

unkept: list[str] = []  # reasons for which compiled code could not be written


def _digest(*parts: object) -> bytes:
    """Return a digest of what parts print as."""
    return hashlib.sha256("\n".join(map(repr, parts)).encode()).digest()


class CodeCache(FunctionCache):  # type: ignore[no-any-unimported]
    """The cached code of one function, one file for each signature."""

    def __init__(self, function: Callable[..., Any]) -> None:
        """Find the folder; RuntimeError where none can be written to."""
        super().__init__(function)
        self.source: Any = self._impl.locator.get_source_stamp()
        self.folder = Path(self._cache_path)
        switches = [(name, getattr(config, name, None)) for name in _SWITCHES]
        how = _digest(numba.__version__, llvmlite.__version__, platform.python_version(), switches)
        self._base = f"{self._impl.filename_base}.{how.hex()[:8]}"
        self.stamped(_digest(self.source))
        self._locks: list[tuple[contextlib.ExitStack, bool]] = []

    def stamped(self, stamp: bytes) -> bytes:
        """Set the digest of all that the code is compiled from, and return it; code with another one is removed."""
        self._stamp = stamp
        self._prefix = f"{self._base}.{stamp.hex()[:16]}"
        return stamp

    def is_there(self) -> bool:
        """Tell whether code for any signature is cached."""
        names = _names(self.folder, _changed(self.folder))
        return any(name.startswith(f"{self._prefix}.") and name.endswith(".code") for name in names)

    def _file(self, key: object) -> Path:
        return self.folder / f"{self._prefix}.{_digest(key).hex()[:16]}.code"

    @contextlib.contextmanager
    def held(self, callee: bool) -> Iterator[None]:
        """Release at the end the lock that was taken to compile within the block; code for a callee is linked into
        callers only, and kept by itself."""
        with contextlib.ExitStack() as lock:
            self._locks.append((lock, callee))
            try:
                yield
            finally:
                self._locks.pop()

    def _key(self, sig: Any, codegen: Any) -> tuple[Any, bool]:
        return self._index_key(sig, codegen), bool(self._locks) and self._locks[-1][1]

    def _load_overload(self, sig: Any, target_context: Any) -> Any:
        key = self._key(sig, target_context.codegen())
        code = self._read(key, target_context)
        if code is None and self._locks:
            with contextlib.suppress(OSError):
                self._locks[-1][0].enter_context(_alone(self._file(key).with_suffix(".lock")))
                code = self._read(key, target_context)  # another process may have compiled it meanwhile
        return code

    def _read(self, key: Any, target_context: Any) -> Any:
        try:
            content = self._file(key).read_bytes()
        except OSError:
            return None
        if hashlib.sha256(content[_DIGEST:]).digest() != content[:_DIGEST]:
            return None
        stamp, of, data = pickle.loads(content[_DIGEST:])
        return self._impl.rebuild(target_context, data) if (stamp, of) == (self._stamp, key) else None

    def _save_overload(self, sig: Any, data: Any) -> None:
        if not self._impl.check_cachable(data):
            return
        key = self._key(sig, data.codegen)
        try:
            # Without the types of all lines as a text, for which nothing asks (0.4 of 42 s of compiling).
            reduced = self._impl.reduce(data._replace(type_annotation=""))
        except RuntimeError:
            # A Ctrl-C cut off the generation of code, in a callback from LLVM that cannot raise; it is repeated.
            return
        content = dumps((self._stamp, key, reduced))
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            self._clear()
            _write(self._file(key), hashlib.sha256(content).digest() + content)
        except OSError as reason:
            # The code runs, but is compiled again the next time.
            unkept.append(str(reason))

    def _clear(self) -> None:
        """Remove code whose sources have changed since."""
        for file in self.folder.glob(f"{self._base}.*.code"):
            if not file.name.startswith(f"{self._prefix}."):
                with contextlib.suppress(OSError):
                    file.unlink()


@contextlib.contextmanager
def _alone(file: Path) -> Iterator[None]:
    """Hold a lock that other processes wait for; where the system has no file locks, none waits."""
    if fcntl is None:
        yield
        return
    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("ab") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        try:
            yield
        finally:
            with contextlib.suppress(OSError):
                file.unlink()


@lru_cache(maxsize=64)
def _names(folder: Path, changed: int) -> list[str]:
    """Return the names of the files in a folder as it was when it last changed."""
    return [] if changed < 0 else os.listdir(folder)


def _changed(folder: Path) -> int:
    """Return when a folder last changed [ns], -1 if there is none."""
    try:
        return folder.stat().st_mtime_ns
    except OSError:
        return -1


def _write(file: Path, content: bytes) -> None:
    """Write a file so that it appears whole or not at all, even if others write it too."""
    stage = file.with_name(f"{file.name}.{uuid.uuid4().hex[:16]}")
    try:
        stage.write_bytes(content)
        os.replace(stage, file)
    except BaseException:
        with contextlib.suppress(OSError):
            stage.unlink()
        raise
