"""PYTHONPATH=tests python -m fuzz: random input for the commands, by count or by time, or one case again."""

from __future__ import annotations

import argparse
import itertools
import sys
import tempfile
import time
from pathlib import Path

from fuzz.cases import KINDS
from fuzz.harness import run


def main() -> int:
    """Run cases, print what failed and how to replay it; exit code 1 if anything did."""
    parser = argparse.ArgumentParser(prog="python -m fuzz", description=__doc__)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--count", type=int, default=300, help="cases to run (default 300)")
    parser.add_argument("--minutes", type=float, help="run for so long instead")
    parser.add_argument("--case", type=int, action="append", help="run this case only; may be repeated")
    parser.add_argument("--kind", choices=KINDS, default="-", help="only cases of this kind")
    parser.add_argument("--work", type=Path, help="folder for the input of failing cases; a temporary one by default")
    given = parser.parse_args()
    work = given.work or Path(tempfile.mkdtemp(prefix="raychan-fuzz-"))
    numbers = given.case or (itertools.count() if given.minutes else range(given.count))
    until = time.perf_counter() + 60.0 * given.minutes if given.minutes else float("inf")
    start = time.perf_counter()
    done = run(numbers, given.seed, work, given.kind, until)
    print(f"{done.cases} cases in {time.perf_counter() - start:.0f} s; input of failing ones: {work}")
    print("commands by exit code:", ", ".join(f"{k}: {n}" for k, n in sorted(done.codes.items())))
    for seconds, what in done.slowest:
        print(f"  {seconds:.1f} s  case {what}")
    for failure in done.failures:
        print(f"FAILED  {failure}")
    return 1 if done.failures else 0


if __name__ == "__main__":
    sys.exit(main())
