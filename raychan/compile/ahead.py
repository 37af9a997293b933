"""Compile ahead: a second process that compiles, from the last stage backwards, what a cold run needs.

Numba compiles one function at a time in a process, and a run compiles stage after stage as it comes to them. The second
process starts from the other end; neither compiles what the other has in hand (`compile.code_cache`). What a run
needs is listed in `signatures.txt` (written by `make signatures`): a kernel that is missing there is compiled by the
run itself, so an old list costs time only.
"""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from numba import types

LIST = Path(__file__).with_name("signatures.txt")
MANY = 20  # kernels from which a second process, which takes 2 s to start, is worth it


@contextmanager
def helped(list_name: str, missing: int) -> Iterator[None]:
    """Compile what a command needs in a second process too, as long as this lasts, where much is missing."""
    other = _second(list_name) if missing >= MANY and (os.cpu_count() or 1) > 1 else None
    try:
        yield
    finally:
        if other is not None:
            other.kill()
            other.communicate()


def _second(list_name: str) -> subprocess.Popen[bytes] | None:
    command = [sys.executable, "-m", "raychan.compile.ahead", list_name]
    quiet = subprocess.DEVNULL
    try:
        return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=quiet, stderr=quiet, start_new_session=True)
    except OSError:  # no more processes: this one compiles alone
        return None


def lists(file: Path = LIST) -> dict[str, list[tuple[str, str, str]]]:
    """Return, for each command, the module, name and argument types of its kernels, in the order of their compiling."""
    found: dict[str, list[tuple[str, str, str]]] = {}
    for line in file.read_text(encoding="utf-8").splitlines():
        if line.startswith("["):
            rows = found.setdefault(line.strip("[]"), [])
        elif line:
            module, name, arguments = line.split(maxsplit=2)
            rows.append((module, name, arguments))
    return found


def compile_list(rows: list[tuple[str, str, str]]) -> int:
    """Compile kernels from the last to the first; return how many of them are not there as listed."""
    lost = 0
    for module, name, arguments in reversed(rows):
        try:
            getattr(importlib.import_module(module), name).compile(read_types(arguments))
        except Exception:
            lost += 1  # an old list; the run compiles by itself what it needs
    return lost


def read_types(text: str) -> tuple[Any, ...]:
    """Return the argument types that a line of the list gives; the text is this package's own."""
    return tuple(eval(f"({text},)", {"__builtins__": {}}, vars(types) | {"bool": types.boolean}))


def _end_with_parent() -> None:
    """End this process when the one that started it has ended, however it did."""
    sys.stdin.read()
    os._exit(0)


if __name__ == "__main__":
    threading.Thread(target=_end_with_parent, daemon=True).start()
    compile_list(lists().get(sys.argv[1], []))
