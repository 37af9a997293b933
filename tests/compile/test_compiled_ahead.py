"""What a cold run needs is compiled ahead in a second process, once in all, and nothing hangs on it."""

import importlib
import os
import subprocess
import sys
from pathlib import Path

import pytest
from signatures import write_type

from raychan.compile import ahead
from raychan.compile.jit import Kernel

pytestmark = pytest.mark.compiled(reason="it is about compiled code")

LISTS = ahead.lists()
ROWS = [(name, *row) for name, rows in LISTS.items() for row in rows]


def test_the_lists_name_kernels_that_are_there_and_types_that_read_back():
    assert set(LISTS) == {"run", "rcs"}
    for _, module, name, arguments in ROWS:
        assert isinstance(getattr(importlib.import_module(module), name), Kernel), f"make signatures: {module}.{name}"
        assert ", ".join(map(write_type, ahead.read_types(arguments))) == arguments


@pytest.mark.skipif(bool(os.environ.get("NUMBA_BOUNDSCHECK")), reason="frozen arrays are compiled for by themselves")
def test_what_the_second_process_compiled_the_first_only_loads(tmp_path: Path):
    file = tmp_path / "list.txt"
    rows = [row for row in LISTS["run"] if row[0] == "raychan.geometry.triangles"]
    assert len(rows) > 3
    file.write_text("[few]\n" + "\n".join(" ".join(row) for row in rows))
    compiles = f"""
from pathlib import Path
from raychan.compile import ahead
rows = ahead.lists(Path({str(file)!r}))["few"]
lost = ahead.compile_list(rows)
from raychan.compile.jit import KERNELS
misses = sum(kernel.stats.cache_misses.total() for kernel in KERNELS)
print(lost, misses > 0, misses)
"""
    env = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": os.pathsep.join(sys.path)}
    first, second = (
        subprocess.run([sys.executable, "-c", compiles], env=env, capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    )
    assert first.split()[:2] == ["0", "True"]
    assert second.split()[:2] == ["0", "False"]
    assert len(list((tmp_path / "cache").rglob("*.code"))) == int(first.split()[2]) >= len(rows)
    assert not list((tmp_path / "cache").rglob("*.lock"))


def test_the_second_process_ends_with_the_command_that_started_it(monkeypatch: pytest.MonkeyPatch):
    started: list[subprocess.Popen[bytes]] = []
    real = subprocess.Popen
    # Which process is started is seen at the system's own call only.
    monkeypatch.setattr(subprocess, "Popen", lambda *a, **k: started.append(real(*a, **k)) or started[-1])
    with ahead.helped("none of this name", ahead.MANY):
        assert len(started) == 1
    assert started[0].poll() is not None
    with ahead.helped("run", ahead.MANY - 1):
        assert len(started) == 1


def test_where_no_second_process_can_start_the_command_goes_on(monkeypatch: pytest.MonkeyPatch):
    def none(*args: object, **kwargs: object) -> None:
        raise BlockingIOError("no more processes")

    # A system that is out of processes.
    monkeypatch.setattr(subprocess, "Popen", none)
    with ahead.helped("run", ahead.MANY):
        pass
