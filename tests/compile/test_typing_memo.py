"""What numba answered once about types is taken for the same question only."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.compiled(reason="it is about compiled code")

_KERNELS = """
from raychan.compile.jit import njit

@njit(cache=True)
def shared(x, y):
    return max(x, y) / min(x, y)

@njit(cache=True)
def strict(x, y):
    return max(x, y) / min(x, y) + shared(x, y)

@njit(cache=True, forceinline=True, error_model="numpy")
def mild(x, y):
    return max(x, y) / min(x, y)

@njit(cache=True, error_model="numpy")
def numpy_like(x, y):
    return mild(x, y) + max(x, y) / min(x, y)

for kernel in (strict, numpy_like, mild, shared):
    for pair in ((1.0, 0.0), (1, 0), (3.0, 2), (True, 2.5)):
        try:
            print(kernel(*pair))
        except ZeroDivisionError:
            print("zero")
"""


def test_kernels_with_other_options_keep_their_own_answers(tmp_path: Path):
    (tmp_path / "kernels.py").write_text(_KERNELS)
    env = os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path]), "PYTHONDONTWRITEBYTECODE": "1"}
    without = "from raychan.compile import linked\nlinked.FITS = False\n"
    said = []
    for name, first in (("with", ""), ("without", without)):
        env["NUMBA_CACHE_DIR"] = str(tmp_path / name)
        script = first + "import kernels"
        ran = subprocess.run([sys.executable, "-c", script], env=env, capture_output=True, text=True, check=True)
        said.append(ran.stdout.splitlines())
    assert said[0] == said[1]
    assert said[0][:6] == ["zero", "zero", "3.0", "5.0", "inf", "inf"]
