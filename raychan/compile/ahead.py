"""Compilation in a second process, for a run that finds nothing compiled.

Numba compiles one function at a time in a process, and a run compiles stage after stage as it comes to them. The second
process starts from the last stage backwards; neither compiles what the other is compiling (`compile.code_cache`).
What a run calls is listed in `signatures.txt` (written by `make signatures`; what these kernels call is compiled with
them): a kernel that is missing there is compiled by the run itself, so an old list costs time only.
"""

from __future__ import annotations

import gc
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
MANY = 20  # missing kernels from which a second process, which takes 2 s to start, pays; not measured


@contextmanager
def helped(list_name: str, missing: int) -> Iterator[None]:
    """Compile what a command needs in a second process too while the block runs, if many kernels are missing."""
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
    """Return, for each command, the module, name and argument types of its kernels, in the order of compilation."""
    found: dict[str, list[tuple[str, str, str]]] = {}
    for line in file.read_text(encoding="utf-8").splitlines():
        if line.startswith("["):
            rows = found.setdefault(line.strip("[]"), [])
        elif line:
            module, name, arguments = line.split(maxsplit=2)
            rows.append((module, name, arguments))
    return found


def compile_list(rows: list[tuple[str, str, str]]) -> int:
    """Compile kernels from the last to the first; return how many of them do not exist as listed."""
    lost = 0
    for module, name, arguments in reversed(rows):
        try:
            getattr(importlib.import_module(module), name).compile(read_types(arguments))
        except Exception:
            lost += 1  # an old list; the run compiles by itself what it needs
    return lost


def read_types(text: str) -> tuple[Any, ...]:
    """Return the argument types that a line of the list gives; the text is this package's own."""
    names = vars(types) | {"bool": types.boolean, "Named": _named}
    return tuple(eval(f"({text},)", {"__builtins__": {}}, names))


def _named(module: str, name: str, fields: tuple[Any, ...]) -> Any:
    """Return the type of a named tuple, given its class and the types of its fields."""
    return types.BaseTuple.from_types(fields, getattr(importlib.import_module(module), name))


def _end_with_parent() -> None:
    """End this process when the one that started it ends, for whatever reason."""
    sys.stdin.read()
    os._exit(0)


if __name__ == "__main__":
    gc.disable()  # takes 7 % of the time (1.9 of 26 s for 60 kernels); without it 585 instead of 372 MB until the end
    threading.Thread(target=_end_with_parent, daemon=True).start()
    compile_list(lists().get(sys.argv[1], []))
