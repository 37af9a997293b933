"""Random input: whatever a scene file, a mesh or a flag holds, commands end with 0 or 2, in time, and write no NaN."""

from __future__ import annotations

import pytest
from fuzz.cases import KINDS, make
from fuzz.harness import run

_COUNTS = {"toml": 8, "mesh": 5, "scene": 3}  # `python -m fuzz --minutes 30 --seed N` runs longer


@pytest.mark.parametrize("kind", KINDS)
def test_random_input_ends_with_0_or_2_in_time_and_writes_no_nan(kind, tmp_path):
    done = run(range(_COUNTS[kind]), 12, tmp_path, kind)
    assert done.cases == _COUNTS[kind]
    assert done.failures == [], "\n".join(done.failures)


def test_a_case_is_the_same_whenever_it_is_made(tmp_path):
    for number in range(6):
        made = []
        for name in ("a", "b"):
            folder = tmp_path / f"{name}{number}"
            folder.mkdir()
            commands = [[word.replace(str(folder), "") for word in c] for c in make(folder, 3, number)]
            made.append((commands, {p.name: p.read_bytes() for p in folder.iterdir()}))
        assert made[0] == made[1]


def test_a_process_that_dies_or_hangs_is_a_failure_that_can_be_replayed(tmp_path, monkeypatch):
    worker = tmp_path / "fuzz_dies.py"
    begun = "open(sys.argv[1], 'a').write(json.dumps({'begin': 0, 'command': 'x'}) + chr(10))"
    worker.write_text(f"import json, os, sys\n{begun}\nos.abort()\n")
    monkeypatch.setattr("fuzz.harness.WORKER", [str(worker)])
    done = run([4, 5], 7, tmp_path / "work")
    assert done.cases == 2 and len(done.failures) == 2
    assert "--seed 7 --case 4" in done.failures[0] and "died, code -6" in done.failures[0]
