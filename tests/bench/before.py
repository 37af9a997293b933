"""Whole frames against an older commit of this repository, whose code runs beside this one."""

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
_RUN = """
import sys, time
import raychan as rc
scene, tolerance = rc.Scene.load(sys.argv[1]), float(sys.argv[2])
rc.simulate(scene, tolerance_db=tolerance)
print(0.0, flush=True)
for _ in sys.stdin:
    start = time.perf_counter()
    rc.simulate(scene, tolerance_db=tolerance)
    print(time.perf_counter() - start, flush=True)
"""


def before(scenes: Path, repeats: int, quick: bool) -> Iterator[Row]:
    """Run the urban street at 3 dB and at 0.5 dB beside commit e6e046b; its kernels are compiled first."""
    with tempfile.TemporaryDirectory() as there:
        git = ["git", "-C", str(_ROOT), "worktree"]
        subprocess.run([*git, "add", "--quiet", "--detach", there, COMMIT], check=True)
        try:
            for tolerance, bar in ((3.0, 1.0 / 6.0), (0.5, 1.0 / 3.0)):
                with _runner(_ROOT, tolerance) as ours, _runner(Path(there), tolerance) as theirs:
                    for process in (ours, theirs):
                        _answer(process)  # both have compiled, and none runs beside the other
                    pairs = [(_next(ours), _next(theirs)) for _ in range(repeats)]
                row = paired("before", f"urban, {tolerance:g} dB", pairs, f"commit {COMMIT}")
                yield barred(row, f"<= {bar:.2f}", row.ratio <= bar)
        finally:
            subprocess.run([*git, "remove", "--force", there], check=True)


@contextmanager
def _runner(root: Path, tolerance: float) -> Iterator[subprocess.Popen[str]]:
    """Give a process that runs a frame of a tree of this repository for each line that it is sent."""
    command = [sys.executable, "-c", _RUN, str(root / "scenes" / "urban.toml"), str(tolerance)]
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
