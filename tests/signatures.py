"""PYTHONPATH=tests python -m signatures: write anew which kernels a cold run calls, and for which types; what these
call is compiled with them."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from contextlib import suppress
from typing import Any

from numba import types
from numba.core import event

from raychan.compile import ahead
from raychan.compile.jit import Kernel

SCENES = ("living_street", "occluded_pedestrian", "urban")
Row = tuple[str, str, str]


class Recorder(event.Listener):
    """Notes the kernels of this process as they are compiled for a call from Python."""

    def __init__(self) -> None:
        self.rows: list[Row] = []
        self._depth = 0

    def on_start(self, event: Any) -> None:
        """Count the kernels that are being compiled, each for the one before it."""
        self._depth += isinstance(event.data["dispatcher"], Kernel)

    def on_end(self, event: Any) -> None:
        """Note the module, name and argument types of a kernel that was compiled."""
        kernel = event.data["dispatcher"]
        self._depth -= isinstance(kernel, Kernel)
        if isinstance(kernel, Kernel) and self._depth == 0:
            with suppress(ValueError):
                arguments = ", ".join(map(write_type, event.data["args"]))
                self.rows.append((kernel.py_func.__module__, kernel.py_func.__name__, arguments))


def write_type(kind: Any) -> str:
    """Return the text of an argument's type; ValueError for one that has none, such as the value of a literal."""
    if isinstance(kind, types.Array):
        frozen = "" if kind.mutable else ", readonly=True"
        return f"Array({kind.dtype}, {kind.ndim}, {kind.layout!r}{frozen})"
    if isinstance(kind, types.NamedTuple | types.NamedUniTuple):
        fields = ", ".join(map(write_type, kind.types))
        return f"Named({kind.instance_class.__module__!r}, {kind.instance_class.__name__!r}, ({fields},))"
    if isinstance(kind, types.UniTuple | types.Tuple):
        return f"Tuple(({', '.join(map(write_type, kind.types))},))"
    if isinstance(kind, types.Number | types.Boolean) and not isinstance(kind, types.Literal):
        return str(kind)
    raise ValueError(f"no text for {kind}")


def compiled_by(*command: str) -> list[Row]:
    """Return what a command of raychan compiles in a process that starts with nothing compiled."""
    with tempfile.TemporaryDirectory() as empty:
        env = os.environ | {"NUMBA_CACHE_DIR": empty}
        done = subprocess.run([sys.executable, __file__, *command], env=env, stdout=subprocess.PIPE, check=True)
    return [(module, name, types) for module, name, types in json.loads(done.stdout.splitlines()[-1])]


def main() -> None:
    """Write the lists of all commands that have one."""
    runs = [compiled_by("run", scene, "--no-pictures") for scene in SCENES]
    views = [compiled_by("rcs", "--shape", "car", "--azimuth", "10", "--tolerance", "3")]
    lists = {"run": runs, "rcs": views}
    text = []
    for name, parts in lists.items():
        last = parts[-1]
        others = dict.fromkeys(row for part in parts[:-1] for row in part if row not in last)
        text.append(f"[{name}]\n" + "".join(" ".join(row) + "\n" for row in [*others, *last]))
    ahead.LIST.write_text("\n".join(text), encoding="utf-8")


def _record(command: list[str]) -> None:
    from raychan.cli import invoke

    ahead.MANY = sys.maxsize  # this process alone compiles
    recorder = Recorder()
    with tempfile.TemporaryDirectory() as out, event.install_listener("numba:compile", recorder):
        code = invoke([*command, "--out", out + ("/out.csv" if command[0] == "rcs" else "/out")])
    if code:
        sys.exit(code)
    print(json.dumps(recorder.rows))


if __name__ == "__main__":
    _record(sys.argv[1:]) if len(sys.argv) > 1 else main()
