"""The first run after the installation, which compiles, against one that finds all compiled."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter

from bench.measure import Row, barred

_BAR = 30.0  # s


def cold(scenes: Path, repeats: int, quick: bool) -> Iterator[Row]:
    """Run the urban street by its command in processes of their own: with nothing compiled, then with all of it."""
    for _ in range(1 if quick else repeats):
        with tempfile.TemporaryDirectory() as empty:
            (first, spent), (again, spent_again) = (_run(scenes / "urban.toml", Path(empty)) for _ in range(2))
            code = sum(file.stat().st_size for file in Path(empty).rglob("*.code"))
        more = {"cpu_s": spent, "warm_cpu_s": spent_again, "code_mb": code / 1e6}
        row = Row("cold", "urban, no pictures", first, "all compiled", again, first / again, more=more)
        yield barred(row, f"<= {_BAR:g} s", first <= _BAR)


def _run(scene: Path, code: Path) -> tuple[float, float]:
    """Return the seconds that the command takes, and those of processor that it and its second process take."""
    command = [sys.executable, "-m", "raychan", "run", str(scene), "--no-pictures", "--out", str(code / "out")]
    env = os.environ | {"NUMBA_CACHE_DIR": str(code / "numba")}
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), perf_counter()
    subprocess.run(command, env=env, capture_output=True, check=True)
    took, after = perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    return took, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
