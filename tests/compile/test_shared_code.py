"""Compiled code is shared by processes that write and read it at once, made once for every mixture of frozen and open
arrays, and what is still to be made is told."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from support.places import SCENES

pytestmark = pytest.mark.compiled(reason="it is about compiled code")

_TOY = """
from raychan.compile.jit import njit

@njit(cache=True)
def half(x):
    return x / 2

@njit(cache=True)
def mixed(x, i):
    return half(x[i]) + half(i)

@njit(cache=True)
def emptied(arrays):
    for x in arrays:
        x[0] = 0.0
    return arrays[0][0]
"""
_READ = """
import numpy as np, toy
for kind in {kinds}:
    x = np.array([3, 4, 5], kind)
    for i in (np.int8(1), 2):
        assert toy.mixed(x, i) == float(x[i]) / 2 + i / 2, (kind, i)
print(sum(toy.mixed.stats.cache_hits.values()))
"""
_KINDS = ["int8", "int32", "float32", "float64"]


def command(folder: Path, code: str, **flags: str) -> subprocess.Popen[str]:
    """Start a process that runs code beside the toy kernels, whose compiled code is in `folder`/cache."""
    (folder / "toy.py").write_text(_TOY)
    env = {k: v for k, v in os.environ.items() if k != "NUMBA_BOUNDSCHECK"} | flags
    env |= {"PYTHONPATH": os.pathsep.join([str(folder), *sys.path]), "NUMBA_CACHE_DIR": str(folder / "cache")}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen([sys.executable, "-c", code], env=env, **pipes)


def printed(process: subprocess.Popen[str]) -> str:
    out, err = process.communicate(timeout=300)
    assert process.returncode == 0, err
    return out.strip()


def files(folder: Path) -> list[Path]:
    return [p for p in (folder / "cache").rglob("*") if p.is_file()]


def test_processes_that_compile_at_once_all_compute_right_share_the_work_and_leave_what_is_right(tmp_path: Path):
    """Two in the same order, who always want the same kernel, and one in another."""
    told = "print(sum(f.stats.cache_misses.total() for f in (toy.half, toy.mixed)))"
    codes = [_READ.format(kinds=kinds) + told for kinds in (_KINDS, _KINDS, _KINDS[2:] + _KINDS[:2])]
    made = [int(printed(process).split()[-1]) for process in [command(tmp_path, code) for code in codes]]
    assert sum(made) == len(files(tmp_path))
    assert {p.suffix for p in files(tmp_path)} == {".code"}
    assert printed(command(tmp_path, _READ.format(kinds=_KINDS))) == "8"


def test_a_process_that_waits_for_anothers_compiling_goes_on_when_that_one_is_killed(tmp_path: Path):
    hangs = """
import numba.core.compiler as c, time
c.Compiler.compile_extra = lambda *a: (print(flush=True), time.sleep(99))
"""
    code = _READ.format(kinds=["float64"])
    stuck = command(tmp_path, hangs + code)
    assert stuck.stdout is not None
    stuck.stdout.readline()  # now it holds the lock
    waits = command(tmp_path, code)
    with pytest.raises(subprocess.TimeoutExpired):
        waits.wait(4.0)
    stuck.kill()
    stuck.communicate()
    assert printed(waits) == "0"


def test_code_of_a_half_written_or_another_file_is_made_anew(tmp_path: Path):
    code = _READ.format(kinds=["float64"])
    printed(command(tmp_path, code))
    kept = [p for p in files(tmp_path) if "mixed" in p.name]
    assert len(kept) == 2
    first = kept[0].read_bytes()
    kept[0].write_bytes(first[: len(first) // 2])
    kept[1].write_bytes(first)
    assert printed(command(tmp_path, code)) == "0"
    assert printed(command(tmp_path, code)) == "2"


def test_where_compiled_code_cannot_be_written_it_runs_and_the_reason_is_told(tmp_path: Path):
    full = """
import errno, os
def replace(*a):
    raise OSError(errno.ENOSPC, "No space left on device")
os.replace = replace
"""
    told = "\nfrom raychan.compile.progress import lost; print(lost())"
    said = printed(command(tmp_path, full + _READ.format(kinds=["float64"]) + told))
    assert "No space left on device" in said and "the next run compiles again" in said
    assert files(tmp_path) == []


def test_code_with_bounds_checked_and_without_never_serve_each_other(tmp_path: Path):
    code = _READ.format(kinds=["float64"]) + "\ntry:\n    toy.mixed(x, 9)\nexcept IndexError:\n    print('caught')"
    assert printed(command(tmp_path, _READ.format(kinds=["float64"]))) == "0"
    assert printed(command(tmp_path, code, NUMBA_BOUNDSCHECK="1")).split() == ["0", "caught"]
    assert printed(command(tmp_path, code, NUMBA_BOUNDSCHECK="1")).split() == ["2", "caught"]
    assert printed(command(tmp_path, _READ.format(kinds=["float64"]))) == "2"


_FROZEN = """
import numpy as np, toy
x = np.arange(4.0)
view = x[1:]
view.flags.writeable = False
owner = np.arange(4.0)
owner.flags.writeable = False
held = np.frombuffer(np.arange(4.0).tobytes())
assert [toy.mixed(a, 1) for a in (x, view, owner, held)] == [1.0, 1.5, 1.0, 1.0]
assert not any(a.flags.writeable for a in (view, owner, held))
print(len(toy.mixed.signatures))
"""


def test_frozen_and_open_arrays_share_one_signature_and_stay_what_they_are(tmp_path: Path):
    assert printed(command(tmp_path, _FROZEN)) == "1"


def test_with_bounds_checked_a_kernel_that_changes_a_frozen_array_raises(tmp_path: Path):
    code = """
import numpy as np, toy
assert toy.emptied((np.ones(3), np.ones(3))) == 0.0
for frozen in (0, 1):
    given = np.ones(3), np.ones(3)
    given[frozen].flags.writeable = False
    try:
        toy.emptied(given)
    except ValueError as e:
        print(e)
"""
    told = "emptied writes to a read-only array"
    assert printed(command(tmp_path, code, NUMBA_BOUNDSCHECK="1")).splitlines() == [told, told]


_TOLD = """
import json, toy
from raychan.compile.progress import watched
told = []
with watched(lambda *a: told.append(a)):
    toy.half(1.0)
    toy.half(2.0)
print(json.dumps(told))
"""


def test_what_is_still_to_be_compiled_is_told_and_comes_to_its_end(tmp_path: Path):
    told = json.loads(printed(command(tmp_path, _TOLD)))
    assert [(done, ahead) for done, ahead, _ in told] == [(0, 3), (1, 2)]
    assert all((seconds > 0.0) == (ahead > 0) for _, ahead, seconds in told)
    assert json.loads(printed(command(tmp_path, _TOLD))) == []


_SCENES = """
import sys
from collections import Counter
from numba.core import types
from raychan.compile.jit import KERNELS, _wrapped
from raychan.run.simulate import simulate
from raychan.world.scene import Scene

def plain(t):
    if isinstance(t, types.Array):
        return plain(t.dtype), t.ndim
    if isinstance(t, types.Integer):
        return "integer"
    return tuple(map(plain, t)) if isinstance(t, tuple | types.BaseTuple) else str(t)

for scene in sys.argv[1:]:
    small = ["radar.waveform.chirps=32", "radar.waveform.samples=256"]
    simulate(Scene.load(scene).override(small), tolerance_db=6.0)
for kernel in KERNELS:
    called = [s for s, code in kernel.overloads.items() if _wrapped(code)]  # by Python; others are parts of callers
    for form, count in Counter(map(plain, called)).items():
        if count > 1:
            print(kernel.py_func.__module__, kernel.py_func.__name__, count, called)
"""


def test_no_kernel_of_the_three_scenes_is_compiled_twice_for_frozen_arrays_layouts_or_widths_of_integers():
    scenes = [str(SCENES / f"{name}.toml") for name in ("living_street", "occluded_pedestrian", "urban")]
    ran = subprocess.run([sys.executable, "-c", _SCENES, *scenes], capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stdout) == (0, ""), ran.stdout + ran.stderr


def test_a_command_without_a_terminal_says_in_one_line_that_it_compiles(tmp_path: Path):
    code = """
import sys, toy
from raychan.cli import show
show._LONG = 0.0
sys.stderr = sys.stdout
with show.progress() as tell:
    tell("trace", 0.5)
    toy.half(1.0)
    toy.half(1)
"""
    said = printed(command(tmp_path, code))
    assert said.startswith("compiling, once, about ") and said.endswith(" s (3 kernels)") and said.count("\n") == 0
    assert printed(command(tmp_path, code)) == ""
