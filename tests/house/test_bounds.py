"""No kernel reads or writes beyond its arrays: with NUMBA_BOUNDSCHECK=1, as in `make test` and `make test-bounds`."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh
from support.facets import facets, ground, quad
from support.places import SCENES, TESTS

from raychan import rcs
from raychan.cli import invoke
from raychan.geometry.triangles import half_edge_ends
from raychan.world.scene_files import bundled

SCENE_FILES = [SCENES / f"{name}.toml" for name in bundled.names()]
checked = pytest.mark.skipif(not os.environ.get("NUMBA_BOUNDSCHECK"), reason="wants NUMBA_BOUNDSCHECK=1")


@checked
def test_a_read_beyond_an_array_is_caught():
    with pytest.raises(IndexError):
        half_edge_ends(facets([ground()]).vertices, np.array([99]))


@checked
@pytest.mark.parametrize("scene", SCENE_FILES, ids=lambda p: p.stem)
def test_a_scene_runs_within_its_arrays(scene: Path, tmp_path: Path, capfd):
    code = invoke(["run", str(scene), "--tolerance", "3", "--no-pictures", "--out", str(tmp_path / "out")])
    assert code == 0, capfd.readouterr().err


_STRICT = '''
import functools, sys, warnings
import numpy as np
import trimesh

class Strict(np.ndarray):
    """An array that has no elements before its first."""
    def __getitem__(self, index):
        return super().__getitem__(counted(index))
    def __setitem__(self, index, value):
        super().__setitem__(counted(index), value)

def counted(index):
    for i in index if isinstance(index, tuple) else (index,):
        if isinstance(i, int | np.integer) and i < 0:
            raise IndexError(f"negative index {index}")
    return index

def changed(to, value):
    if isinstance(value, np.ndarray):
        return value.view(to)
    return tuple(changed(to, v) for v in value) if type(value) is tuple else value

inside, ran = [], set()

def njit(**options):
    def python(function):
        @functools.wraps(function)
        def run(*args):
            ran.add(run)
            inside.append(run)
            try:
                found = function(*(changed(Strict, a) for a in args))
            finally:
                inside.pop()
            return found if inside else changed(np.ndarray, found)
        return run
    return python

import raychan.compile.jit, raychan.parallel
raychan.compile.jit.njit = njit
raychan.parallel.parallel_for = lambda n, work, least=0: work(slice(0, n))

import raychan
from support.facets import quad
warnings.simplefilter("ignore")
a = 0.05
floor = quad([[0, -a, 0], [2 * a, -a, 0], [2 * a, a, 0], [0, a, 0]])
wall = quad([[0, -a, 0], [0, a, 0], [0, a, 2 * a], [0, -a, 2 * a]])
corner = trimesh.util.concatenate([floor, wall])
found = raychan.rcs(corner, 10e9, 20.0, 30.0, tolerance_db=3.0, max_bounces=2)
print(len(ran), float(np.squeeze(found.sigma)))
'''


def test_no_kernel_reads_an_array_from_its_end_by_a_negative_index():
    """Which bounds checked by numba cannot see: -1 for none would read the last element. In plain Python, that is told;
    two bounces in a corner lead through most kernels, and to what compiled code finds."""
    a = 0.05
    floor = quad([[0, -a, 0], [2 * a, -a, 0], [2 * a, a, 0], [0, a, 0]])
    corner = trimesh.util.concatenate([floor, quad([[0, -a, 0], [0, a, 0], [0, a, 2 * a], [0, -a, 2 * a]])])
    env = {**os.environ, "PYTHONPATH": os.pathsep.join([str(TESTS), *sys.path])}
    ran = subprocess.run([sys.executable, "-c", _STRICT], env=env, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    kernels, sigma = ran.stdout.split()
    assert int(kernels) > 100
    compiled = rcs(corner, 10e9, 20.0, 30.0, tolerance_db=3.0, max_bounces=2).sigma
    assert float(sigma) == pytest.approx(float(np.squeeze(compiled)), rel=1e-9)
