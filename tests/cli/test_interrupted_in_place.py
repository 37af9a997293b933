"""Ctrl-C while files are put in place: all of them are new, or all of before, and the message says which."""

from __future__ import annotations

import signal
import subprocess
import sys

import pytest
from support.scene_texts import PLATE, but_compiling

from raychan.cli import invoke
from raychan.run.files.in_place import held

SHIP = "[run]\nduration_s = 1.0\n[[bodies]]\nname = 'pier'\nshape = 'box'\nposition = [20, 10, 0]\n"
RCS = ["rcs", "--shape", "plate", "--azimuth", "0:4:2", "--out", "{out}/r.csv", "--plot", "{out}/r.png"]
FRAMES = ["run", "plate.toml", "--no-pictures", "--frames", "2", "--out", "{out}"]
COMMANDS = {
    "run": (["run", "plate.toml", "--no-pictures", "--out", "{out}"], "the results are in {out}"),
    "frames": (FRAMES, "1 of 2 frames is in {out}"),
    "ship": (["ship", "ship.toml", "--no-pictures", "--out", "{out}"], "the results are in {out}"),
    "spectrogram": (
        ["spectrogram", "plate.toml", "--seconds", "0.01", "--resolution", "0.5", "--out", "{out}"],
        "written: {out}/spectrogram.nc, {out}/spectrogram.png",
    ),
    "rcs": (RCS, "written: {out}/r.csv, {out}/r.png"),
    "view": (
        ["view", "plate.toml", "--screenshot", "{out}/a.png", "--html", "{out}/a.html"],
        "written: {out}/a.png, {out}/a.html",
    ),
}

_INTERRUPTED = """
import os, signal
import raychan.cli
from raychan.run.files import atomic_swap
from raychan.run.files import output as output_files
signal.signal(signal.SIGINT, signal.default_int_handler)
def twice(real):
    def moved(*given, **named):
        if ".raychan-" in os.path.dirname(given[1]):  # the folder of results is not in place yet
            return real(*given, **named)
        os.kill(os.getpid(), signal.SIGINT)
        done = real(*given, **named)
        os.kill(os.getpid(), signal.SIGINT)
        return done
    return moved
os.replace = twice(os.replace)
output_files.exchange = twice(output_files.exchange)
raychan.cli.main({argv!r})
"""


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("RAYCHAN_NO_OPENGL", "1")
    (tmp_path / "plate.toml").write_text(PLATE)
    (tmp_path / "ship.toml").write_text(SHIP)
    (tmp_path / "out").mkdir()
    return tmp_path


def files(folder):
    found = [p for p in folder.rglob("*") if p.is_file()]
    return {p.relative_to(folder).as_posix(): (p.stat().st_ino, p.stat().st_mtime_ns) for p in found}


@pytest.mark.parametrize(("argv", "says"), COMMANDS.values(), ids=COMMANDS)
def test_ctrl_c_while_files_are_moved_leaves_all_of_them_new_and_says_so(argv, says, place):
    argv, out = [a.format(out="out") for a in argv], place / "out"
    assert invoke(argv) == 0
    before = files(out)
    code = _INTERRUPTED.format(argv=argv)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=200, check=False)
    told = but_compiling(done.stderr).splitlines()[-1]
    assert (done.returncode, told) == (130, f"raychan: interrupted; {says.format(out='out')}"), done.stderr
    after = files(out)
    wanted = {name for name in before if "frame_0001" not in name}
    assert set(after) == wanted and not any(after[name] == before[name] for name in wanted)
    assert {p.name for p in place.iterdir()} == {"plate.toml", "ship.toml", "out"}


_BOTH_WRITTEN = """
import os, signal
import raychan.cli, raychan.view.web
signal.signal(signal.SIGINT, signal.default_int_handler)
raychan.view.web.page = lambda drawing: os.kill(os.getpid(), signal.SIGINT)
raychan.cli.main(["view", "plate.toml", "--screenshot", "out/a.png", "--html", "out/a.html"])
"""


def test_a_picture_and_a_page_of_one_scene_are_written_together(place):
    command = [sys.executable, "-c", _BOTH_WRITTEN]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    told = but_compiling(done.stderr)
    assert (done.returncode, told, files(place / "out")) == (130, "raychan: interrupted; nothing was written\n", {})


def test_what_waits_is_done_at_the_end_and_handlers_are_as_before():
    heard = []
    before = signal.signal(signal.SIGTERM, lambda number, frame: heard.append(number))
    try:
        mine = signal.getsignal(signal.SIGTERM)
        with held():
            with held():
                signal.raise_signal(signal.SIGTERM)
                signal.raise_signal(signal.SIGTERM)
            assert heard == []
        assert heard == [signal.SIGTERM] and signal.getsignal(signal.SIGTERM) is mine
        with pytest.raises(ValueError, match="mine"), held():
            raise ValueError("mine")
        assert signal.getsignal(signal.SIGTERM) is mine
    finally:
        signal.signal(signal.SIGTERM, before)


def test_a_table_of_fewer_angles_beside_an_earlier_figure_says_so(place, monkeypatch, capsys):
    argv = [a.format(out="out") for a in RCS]
    assert invoke(argv) == 0
    import raychan.run.rcs as module

    real, calls = module.rcs, []

    def stopped(*given, **named):
        calls.append(given)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return real(*given, **named)

    monkeypatch.setattr(module, "rcs", stopped)
    capsys.readouterr()
    assert invoke(argv) == 130
    said = but_compiling(capsys.readouterr().err)
    assert said == "raychan: interrupted; 1 of 3 angles is in out/r.csv; out/r.png is of an earlier run\n"


_HIL = """
import os, signal, sys
import raychan.cli
signal.signal(signal.SIGINT, signal.default_int_handler)
hil = sys.modules["raychan.cli.hil"]
real = hil.write_summary
def write_summary(*given):
    os.kill(os.getpid(), signal.SIGINT)
    real(*given)
    os.kill(os.getpid(), signal.SIGINT)
hil.write_summary = write_summary
import raychan.hil.ports as ports
close = ports.TerminalPort.close
def closed(port):
    os.kill(os.getpid(), signal.SIGINT)
    close(port)
ports.TerminalPort.close = closed
raychan.cli.main(["hil", "ship.toml", "--duration", "0.2", "--out", "out"])
"""


@pytest.mark.skipif(sys.platform == "win32", reason="needs pseudo-terminals")
def test_ctrl_c_while_a_real_time_run_ends_leaves_it_exit_code_0(place):
    done = subprocess.run([sys.executable, "-c", _HIL], capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, but_compiling(done.stderr)) == (0, ""), done.stderr
    assert set(files(place / "out")) == {"summary.json", "track.csv"}
