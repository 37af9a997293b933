"""Whole frames, and a sphere's cross-section, against an older commit of this repository, whose code runs beside this
one."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bench.measure import Row, barred, paired

COMMIT = "e6e046b"
"""The core before runs refined where detections need it."""
_ROOT = Path(__file__).parents[2]
_SERVE = """
print(0.0, flush=True)
for _ in sys.stdin:
    call = made()
    start = time.perf_counter()
    call()
    print(time.perf_counter() - start, flush=True)
"""
_FRAME = (
    """
import sys, time
import raychan as rc
scene, tolerance = rc.Scene.load(sys.argv[1]), float(sys.argv[2])
def made():
    return lambda: rc.simulate(scene, tolerance_db=tolerance)
made()()
"""
    + _SERVE
)
# A mesh of its own each time: what is kept with one must be made again.
_SPHERE = (
    """
import sys, time
import numpy as np
import trimesh
import raychan as rc
from raychan.world.meshes.mesh import make_mesh
raw = trimesh.creation.icosphere(subdivisions=int(sys.argv[1]))
unit = np.asarray(raw.vertices) / np.linalg.norm(raw.vertices, axis=1, keepdims=True)
def made():
    ball = make_mesh(0.5 * unit, raw.faces, normals=unit[raw.faces])
    return lambda: rc.rcs(ball, 77e9, 10.0, 5.0, tolerance_db=0.05)
made()()
"""
    + _SERVE
)
# What the bars ask for of the times that they were set beside: 0.1 s for 0.45, 0.2 for 1.6, 0.6 for 7.4.
_SPHERES = {6: 0.1 / 0.45, 7: 0.2 / 1.6, 8: 0.6 / 7.4}


def before(scenes: Path, repeats: int, quick: bool) -> Iterator[Row]:
    """Run the urban street at 3 dB and at 0.5 dB, and the first `rcs` of spheres to 0.05 dB, beside commit e6e046b; its
    kernels are compiled first."""
    jobs = [
        (f"urban, {tolerance:g} dB", _FRAME, ("{root}/scenes/urban.toml", f"{tolerance}"), bar)
        for tolerance, bar in ((3.0, 1.0 / 6.0), (0.5, 1.0 / 3.0))
    ]
    for n in (6,) if quick else _SPHERES:
        jobs.append((f"sphere of {20 * 4**n:,} facets, first rcs", _SPHERE, (f"{n}",), _SPHERES[n]))
    with tempfile.TemporaryDirectory() as there:
        git = ["git", "-C", str(_ROOT), "worktree"]
        subprocess.run([*git, "add", "--quiet", "--detach", there, COMMIT], check=True)
        try:
            for name, code, arguments, bar in jobs:
                with _runner(_ROOT, code, arguments) as ours, _runner(Path(there), code, arguments) as theirs:
                    for process in (ours, theirs):
                        _answer(process)  # both have compiled, and none runs beside the other
                    pairs = [(_next(ours), _next(theirs)) for _ in range(repeats)]
                row = paired("before", name, pairs, f"commit {COMMIT}")
                yield barred(row, f"<= {bar:.2g}", row.ratio <= bar)
        finally:
            subprocess.run([*git, "remove", "--force", there], check=True)


@contextmanager
def _runner(root: Path, code: str, arguments: tuple[str, ...]) -> Iterator[subprocess.Popen[str]]:
    """Give a process that runs code of a tree of this repository for each line that it is sent; {root} in its arguments
    stands for the tree."""
    command = [sys.executable, "-c", code, *(a.format(root=root) for a in arguments)]
    env = os.environ | {"PYTHONPATH": str(root)}
    pipe = subprocess.PIPE
    with subprocess.Popen(command, env=env, cwd=root, stdin=pipe, stdout=pipe, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


def _next(process: subprocess.Popen[str]) -> float:
    assert process.stdin is not None
    process.stdin.write("\n")
    process.stdin.flush()
    return _answer(process)


def _answer(process: subprocess.Popen[str]) -> float:
    assert process.stdout is not None
    return float(process.stdout.readline())
