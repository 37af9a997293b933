"""Standard output and error may be closed or full: the work is done, and the exit code says what came of it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from support.scene_texts import PLATE, but_compiling

RUN = f"{sys.executable} -m raychan run"


def code_of(command, folder):
    """Return the exit code of a shell command, run in a folder, and what it prints."""
    done = subprocess.run(
        ["bash", "-c", command], cwd=folder, capture_output=True, text=True, timeout=120, check=False
    )  # fmt: skip
    return done.returncode, done.stdout, done.stderr


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "plate.toml").write_text(PLATE)
    return tmp_path


def test_closed_standard_error_does_not_end_a_run(folder):
    code, out, _ = code_of(f"{RUN} plate.toml --out out --no-pictures 2>&-", folder)
    assert code == 0 and "results: out/result.nc" in out and (folder / "out" / "result.nc").is_file()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
@pytest.mark.parametrize("where", ["2>/dev/full", "2>&-"])
def test_the_exit_code_of_bad_input_is_2_where_its_message_cannot_be_written(where, folder):
    assert code_of(f"{RUN} nosuch --out out {where}", folder) == (2, "", "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
@pytest.mark.parametrize(
    ("after", "code", "says"),
    [("| true", 0, ""), (">/dev/full", 2, "raychan: standard output: No space left on device\n")],
    ids=["no reader", "full"],
)
def test_a_sequence_whose_lines_nobody_takes_writes_all_its_frames(after, code, says, folder):
    command = f"set -o pipefail; {RUN} plate.toml --out out --no-pictures --frames 3 {after}"
    found, _, said = code_of(command, folder)
    assert (found, but_compiling(said)) == (code, says)
    assert sorted(p.name for p in (folder / "out").glob("frame_*")) == ["frame_0000", "frame_0001", "frame_0002"]
