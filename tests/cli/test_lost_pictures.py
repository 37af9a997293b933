"""Where a picture cannot be written, the tables of the same command are, and a line says so; the exit code is 2."""

import errno
import os
import subprocess
import sys

import pytest
from support.scene_texts import PLATE, but_compiling

from raychan.cli import invoke
from raychan.run.files import output as output_files
from raychan.run.files.output import StoreError

SHIP = "[run]\nduration_s = 1.0\n[[bodies]]\nname = 'pier'\nshape = 'box'\nposition = [20, 10, 0]\n"
RUN = {"result.nc", "detections.csv", "summary.json"}
COMMANDS = {
    "run": (["run", "plate.toml"], RUN),
    "frames": (
        ["run", "plate.toml", "--frames", "2"],
        {"detections.csv", *(f"frame_000{i}/{name}" for name in RUN for i in (0, 1))},
    ),
    "ship": (["ship", "ship.toml"], {"ship.csv", "scan.nc", "summary.json"}),
    "sweep": (["study", "sweep", "plate.toml", "--target", "sign"], {"sweep.csv"}),
    "sensitivity": (
        ["study", "sensitivity", "plate.toml", "--draws", "2", "--each"],
        {"sensitivity.csv", "each.csv"},
    ),
}


@pytest.mark.parametrize(("argv", "kept"), COMMANDS.values(), ids=COMMANDS)
def test_results_stay_where_their_pictures_cannot_be_written(argv, kept, tmp_path, monkeypatch, capsys):
    whole = output_files.write_whole

    def full(path, content):
        if path.suffix == ".png":
            raise StoreError(f"{path}: cannot write: {os.strerror(errno.EFBIG)}")
        return whole(path, content)

    monkeypatch.setattr(output_files, "write_whole", full)
    monkeypatch.setenv("RAYCHAN_NO_OPENGL", "1")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "plate.toml").write_text(PLATE)
    (tmp_path / "ship.toml").write_text(SHIP)
    assert invoke([*argv, "--out", "out"]) == 2
    said = but_compiling(capsys.readouterr().err).splitlines()[-1]
    assert "File too large; the results without it are in " in said and said.startswith("raychan: ")
    found = {
        p.relative_to(tmp_path / "out").as_posix()
        for p in (tmp_path / "out").rglob("*")
        if p.is_file() and p.suffix != ".png"
    }
    assert found == kept
    assert {p.name for p in tmp_path.iterdir()} == {"plate.toml", "ship.toml", "out"}


def test_a_backend_of_no_name_does_not_matter_to_pictures(tmp_path):
    """Matplotlib cannot be imported with it, and commands draw without a display."""
    (tmp_path / "plate.toml").write_text(PLATE)
    command = [sys.executable, "-m", "raychan", "run", "plate.toml", "--out", "out"]
    given = os.environ | {"MPLBACKEND": "nonsense", "RAYCHAN_NO_OPENGL": "1"}
    done = subprocess.run(
        command, cwd=tmp_path, env=given, capture_output=True, text=True, timeout=120, check=False
    )  # fmt: skip
    assert done.returncode == 0 and "Traceback" not in done.stderr and (tmp_path / "out" / "rdmap.png").is_file()
