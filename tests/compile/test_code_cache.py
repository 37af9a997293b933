"""Compiled code on disk serves as long as all that went into it, and no longer."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.compiled(reason="it is about compiled code")

_CALLEE = """
from raychan.compile.jit import njit
{constant}
@njit(cache=True)
def part(x):
    return x + {offset}
"""
_MIDDLE = """
from callee import part
from raychan.compile.jit import njit

@njit(cache=True)
def whole(x):
    return 10.0 * part(x)
"""
_CALLER = """
from callee import OFTEN
from middle import whole
from raychan.compile.jit import njit

@njit(cache=True)
def all_of_it(x):
    return OFTEN * whole(x)
"""
_RUN = "import caller; print(caller.all_of_it(1.0), sum(caller.all_of_it.stats.cache_hits.values()))"


def run(folder: Path) -> tuple[float, int]:
    env = {**os.environ, "PYTHONPATH": os.pathsep.join([str(folder), *sys.path]), "PYTHONDONTWRITEBYTECODE": "1"}
    env["NUMBA_CACHE_DIR"] = str(folder / "cache")
    ran = subprocess.run([sys.executable, "-c", _RUN], env=env, capture_output=True, text=True, check=True)
    value, hits = ran.stdout.split()
    return float(value), int(hits)


@pytest.mark.parametrize(("offset", "often", "value"), [(2.0, 1, 30.0), (1.0, 2, 40.0)])
def test_a_change_in_a_file_two_calls_away_is_compiled_in(tmp_path: Path, offset: float, often: int, value: float):
    (tmp_path / "callee.py").write_text(_CALLEE.format(constant="OFTEN = 1", offset=1.0))
    (tmp_path / "middle.py").write_text(_MIDDLE)
    (tmp_path / "caller.py").write_text(_CALLER)
    assert run(tmp_path) == (20.0, 0)
    assert run(tmp_path) == (20.0, 1)
    (tmp_path / "callee.py").write_text(_CALLEE.format(constant=f"OFTEN = {often}", offset=offset))
    assert run(tmp_path) == (value, 0)
