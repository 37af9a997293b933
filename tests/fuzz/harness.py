"""The harness: cases in batches, each batch in a process of its own, watched from outside."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path

HANG = 60.0
"""Seconds that a command may take."""
_FIRST = 600.0  # the same for the first commands of a process, which may have to compile
_BATCH = 60
WORKER = ["-m", "fuzz.worker"]
_ROOT = Path(__file__).parents[2]


@dataclass
class Outcome:
    """What came of some cases: commands run by name and exit code, seconds, and failures with what replays them."""

    codes: dict[str, int] = field(default_factory=dict)
    slowest: list[tuple[float, str]] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)
    cases: int = 0


def run(numbers: Iterable[int], seed: int, work: Path, kind: str = "-", until: float = float("inf")) -> Outcome:
    """Run cases by their numbers until they or the time (perf_counter) [s] run out."""
    outcome, rest = Outcome(), iter(numbers)
    while time.perf_counter() < until and (batch := list(islice(rest, _BATCH))):
        while batch:
            batch = _watched(batch, seed, work, kind, outcome)
    return outcome


def _watched(batch: list[int], seed: int, work: Path, kind: str, outcome: Outcome) -> list[int]:
    """Run a batch in a process; return the cases that are left where it died or had to be ended."""
    work.mkdir(parents=True, exist_ok=True)
    notes = work / f"notes_{seed}_{batch[0]}.jsonl"
    notes.write_text("")
    command = [sys.executable, *WORKER, str(notes), str(work), str(seed), kind, *map(str, batch)]
    path = os.pathsep.join([str(_ROOT / "tests"), str(_ROOT), os.environ.get("PYTHONPATH", "")])
    log = work / f"log_{seed}_{batch[0]}.txt"
    with log.open("wb") as sink:
        process = subprocess.Popen(command, env=os.environ | {"PYTHONPATH": path}, stdout=sink, stderr=sink)
        last, seen, why = time.perf_counter(), 0, ""
        while process.poll() is None and not why:
            time.sleep(0.02)
            size = notes.stat().st_size
            if size != seen:
                last, seen = time.perf_counter(), size
            if time.perf_counter() - last > (HANG if seen and _has_run(notes) else _FIRST):
                why = f"no answer for {HANG:g} s"
                process.kill()
        process.wait()
    ended, running = _read(notes, seed, outcome)
    outcome.cases += len(ended)
    left = [n for n in batch if n not in ended]
    if not left:
        notes.unlink()
        log.unlink()
        return []
    tail = log.read_text(errors="replace")[-2000:]
    at = left[0]
    outcome.failures.append(
        f"{_replay(seed, at, kind)}: {running}: {why or f'died, code {process.returncode}'}\n{tail}"
    )
    outcome.cases += 1
    return left[1:]


def _has_run(notes: Path) -> bool:
    return notes.read_text(encoding="utf-8").count('"end"') > 2


def _read(notes: Path, seed: int, outcome: Outcome) -> tuple[set[int], str]:
    ended, running = set(), "starting"
    for note in _lines(notes):
        if "begin" in note:
            running = str(note["command"])
        elif "end" in note:
            ended.add(int(note["end"]))
        else:
            name = f"{note['command']} {note['code']}"
            outcome.codes[name] = outcome.codes.get(name, 0) + 1
            outcome.slowest = sorted([*outcome.slowest, (note["seconds"], f"{note['done']} {running}")])[-5:]
            for problem in note["problems"]:
                outcome.failures.append(f"{_replay(seed, note['done'])}: {running}: {problem}")
    return ended, running


def _lines(notes: Path) -> Iterator[dict]:  # type: ignore[type-arg]
    for line in notes.read_text(encoding="utf-8").splitlines():
        yield json.loads(line)


def _replay(seed: int, number: int, kind: str = "-") -> str:
    return f"python -m fuzz --seed {seed} --case {number}" + (f" --kind {kind}" if kind != "-" else "")
