"""What compiled functions call is compiled for them alone, and once more when Python calls it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.compiled(reason="it is about compiled code")

_KERNELS = """
import numpy as np
from raychan.compile.jit import njit

@njit(cache=True)
def part(x, k):
    if k < 0:
        raise ValueError("negative", k)
    return x[0] + k

@njit(cache=True)
def whole(x, k):
    room = np.zeros(3)
    room[0] = part(x, k)
    return room[0] + part(x, k)
"""
_WHOLE = """
import numpy as np
import kernels
x = np.ones(2)
print(kernels.whole(x, 1))
try:
    kernels.whole(x, -7)
except ValueError as error:
    print(error)
"""
_PART = """
print(kernels.part(x, 1))
try:
    kernels.part(x, -3)
except ValueError as error:
    print(error)
print(sum(kernel.stats.cache_misses.total() for kernel in (kernels.part, kernels.whole)))
"""


def run(folder: Path, script: str) -> list[str]:
    (folder / "kernels.py").write_text(_KERNELS)
    env = {**os.environ, "PYTHONPATH": os.pathsep.join([str(folder), *sys.path]), "PYTHONDONTWRITEBYTECODE": "1"}
    env["NUMBA_CACHE_DIR"] = str(folder / "cache")
    ran = subprocess.run([sys.executable, "-c", script], env=env, capture_output=True, text=True, check=True)
    return ran.stdout.splitlines()


def files(folder: Path) -> list[Path]:
    return sorted((folder / "cache").rglob("*.code"))


@pytest.mark.skipif(bool(os.environ.get("NUMBA_BOUNDSCHECK")), reason="its code lies under other names")
def test_python_may_call_what_was_compiled_for_a_caller(tmp_path: Path):
    said = ["4.0", "('negative', -7)"]
    assert run(tmp_path, _WHOLE) == said
    assert [file.name.split(".")[1].split("-")[0] for file in files(tmp_path)] == ["part", "whole"]
    then = ["2.0", "('negative', -3)"]
    assert run(tmp_path, _WHOLE + _PART) == [*said, *then, "1"]
    assert len(files(tmp_path)) == 3
    assert run(tmp_path, _WHOLE + _PART) == [*said, *then, "0"]


def test_a_caller_is_compiled_from_a_callee_on_disk(tmp_path: Path):
    first = run(tmp_path, _WHOLE + _PART)
    for file in files(tmp_path):
        if ".whole-" in file.name:
            file.unlink()
    assert run(tmp_path, _WHOLE + _PART) == [*first[:-1], "1"]


def test_where_numba_is_built_otherwise_all_becomes_machine_code(tmp_path: Path):
    otherwise = "from raychan.compile import linked\nlinked.FITS = False\n"
    assert run(tmp_path, otherwise + _WHOLE + _PART)[:-1] == run(tmp_path, _WHOLE + _PART)[:-1]
