"""Where compiled code cannot be kept, or its generation is interrupted, a command runs or ends in one plain line."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from support.scene_texts import but_compiling

pytestmark = pytest.mark.compiled(reason="it is about compiled code")

_KERNEL = """
from raychan.compile.jit import njit

@njit(cache=True)
def twice(x):
    return 2.0 * x
"""
_RUN = """
import shutil, sys
import kernel
from raychan.compile.progress import lost, missing
missing()  # what progress counts
if {gone!r}:
    shutil.rmtree({gone!r})
    open({gone!r}, "w").close()
print(kernel.twice(21.0))
print(lost())
"""


def python(code: str, cache: Path, *folders: Path) -> subprocess.CompletedProcess[str]:
    """Run code with a folder for compiled code; there is no other, neither beside the code nor in the home folder."""
    paths = os.pathsep.join([*map(str, folders), *sys.path])
    nowhere = {name: os.devnull for name in ("HOME", "XDG_CACHE_HOME", "LOCALAPPDATA")}
    env = os.environ | nowhere | {"NUMBA_CACHE_DIR": str(cache), "PYTHONPATH": paths, "PYTHONDONTWRITEBYTECODE": "1"}
    return subprocess.run(
        [sys.executable, "-c", code], env=env, capture_output=True, text=True, timeout=120, check=False
    )


@pytest.mark.parametrize("when", ["from the start", "after the import"])
def test_without_a_folder_for_it_compiled_code_runs_and_it_is_told(tmp_path, when):
    """A file in the place of a folder stops root too."""
    (tmp_path / "kernel.py").write_text(_KERNEL)
    (tmp_path / "__pycache__").write_text("")
    cache = tmp_path / "cache"
    if when == "from the start":
        cache.write_text("")
    done = python(_RUN.format(gone="" if when == "from the start" else str(cache)), cache, tmp_path)
    assert done.returncode == 0 and done.stderr == "", done.stderr
    value, told = done.stdout.splitlines()
    assert float(value) == 42.0
    assert told.startswith("compiled code could not be kept, so that the next run compiles again: ")


# Code generation calls back from C at a moment that no argument chooses; numba has no public hook at it.
_INTERRUPTED = """
import os, signal
from numba.core.codegen import CPUCodeLibrary
import raychan.cli
signal.signal(signal.SIGINT, signal.default_int_handler)
compiled, calls = CPUCodeLibrary._object_compiled_hook, []
def once(module, code):
    if not calls:
        calls.append(code)
        os.kill(os.getpid(), signal.SIGINT)
    return compiled(module, code)
CPUCodeLibrary._object_compiled_hook = once
raychan.cli.main(["rcs", "--shape", "plate", "--out", {out!r}])
"""


def test_ctrl_c_while_code_is_generated_ends_with_130_in_one_line(tmp_path):
    done = python(_INTERRUPTED.format(out=str(tmp_path / "a.csv")), tmp_path / "cache")
    assert (done.returncode, done.stdout) == (130, ""), done.stderr
    assert but_compiling(done.stderr) == "raychan: interrupted; nothing was written\n"
    assert not (tmp_path / "a.csv").exists()
