"""Ctrl-C ends a command with exit code 130 wherever it comes."""

from __future__ import annotations

import signal
import subprocess
import sys
from importlib import import_module

import pytest
from support.scene_texts import PLATE, but_compiling

from raychan.cli import invoke


@pytest.fixture
def scene(tmp_path):
    file = tmp_path / "plate.toml"
    file.write_text(PLATE)
    return file


_STOPPED_IN_TEXT = """
import os, signal, sys
import raychan.run.simulate, raychan.cli
signal.signal(signal.SIGINT, signal.default_int_handler)
raychan.run.simulate.result_of = lambda *a: exec("os.kill(os.getpid(), signal.SIGINT); 0", globals())
raychan.cli.main(["run", {scene!r}, "--out", {out!r}])
"""
_STOPPED_IN_IMPORT = """
import os, signal, sys
import raychan.run.simulate, raychan.cli
signal.signal(signal.SIGINT, signal.default_int_handler)
def result_of(*a):
    try:
        os.kill(os.getpid(), signal.SIGINT)
        signal.sigtimedwait([], 1.0)
    except KeyboardInterrupt:
        pass
    raise ImportError("initialization failed")
raychan.run.simulate.result_of = result_of
raychan.cli.main(["run", {scene!r}, "--out", {out!r}])
"""


@pytest.mark.parametrize("program", [_STOPPED_IN_TEXT, _STOPPED_IN_IMPORT], ids=["code of a text", "compiled import"])
def test_ctrl_c_ends_with_130_wherever_it_comes(program, scene, tmp_path):
    (tmp_path / "program.py").write_text(program.format(scene=str(scene), out=str(tmp_path / "out")))
    command = [sys.executable, "-m", "program"]  # Python ends a module, but no file, by the signal that was caught
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, but_compiling(done.stderr)) == (130, "raychan: interrupted; nothing was written\n")


_STOPPED_EARLY = """
import os, runpy, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
class Finder:
    def find_spec(name, path, target=None):
        if name == "typer":
            os.kill(os.getpid(), signal.SIGINT)
            pass
sys.meta_path.insert(0, Finder)
sys.argv = ["raychan", "--version"]
runpy.run_module("raychan", run_name="__main__", alter_sys=True)
"""


def test_ctrl_c_while_the_command_line_is_imported_ends_with_130():
    command = [sys.executable, "-c", _STOPPED_EARLY]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "raychan: interrupted; nothing was written\n")


_STOPPED_LATE = """
import atexit, os, signal, sys
import raychan.cli, raychan.world.scene_files.bundled
signal.signal(signal.SIGINT, signal.default_int_handler)
class Last:
    def __del__(self, kill=os.kill, process=os.getpid()):
        kill(process, {number})
def names():
    {late}
    return []
raychan.world.scene_files.bundled.names = names
raychan.cli.main(["run"])
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["Ctrl-C", "SIGTERM"])
@pytest.mark.parametrize(
    "late", ["atexit.register(Last().__del__)", "sys.last = Last()"], ids=["at exit", "as modules are taken down"]
)
def test_a_signal_after_the_command_is_done_leaves_its_exit_code(late, number):
    command = [sys.executable, "-c", _STOPPED_LATE.format(late=late, number=int(number))]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert "raychan run NAME --out DIR" in done.stdout


_HUNG_UP = """
import os, signal
import raychan.run.simulate, raychan.cli
signal.signal(signal.SIGHUP, signal.{before})
real = raychan.run.simulate.result_of
def result_of(*a):
    os.kill(os.getpid(), signal.SIGHUP)
    return real(*a)
raychan.run.simulate.result_of = result_of
raychan.cli.main(["run", {scene!r}, "--out", {out!r}, "--no-pictures"])
"""


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="the system has no SIGHUP")
@pytest.mark.parametrize(("before", "code", "left"), [("SIG_DFL", 129, []), ("SIG_IGN", 0, ["result"])])
def test_a_closed_terminal_ends_a_run_in_order_and_not_one_under_nohup(before, code, left, scene, tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    command = [sys.executable, "-c", _HUNG_UP.format(before=before, scene=str(scene), out=str(folder / "result"))]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, [p.name for p in folder.iterdir()]) == (code, left)
    assert ("raychan: interrupted; nothing was written\n" in done.stderr) == (code == 129)


_STOPPED_AS_IT_REPORTS = """
import os, signal
import raychan.run.messages.results, raychan.cli
signal.signal(signal.SIGINT, signal.default_int_handler)
raychan.run.messages.results.notes = lambda result: os.kill(os.getpid(), signal.SIGINT)
raychan.cli.main(["run", {scene!r}, "--out", {out!r}, "--no-pictures"])
"""


def test_ctrl_c_after_the_results_are_written_says_where_they_are(scene, tmp_path):
    out = tmp_path / "out"
    command = [sys.executable, "-c", _STOPPED_AS_IT_REPORTS.format(scene=str(scene), out=str(out))]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 130
    assert f"raychan: interrupted; the results are in {out}\n" in done.stderr
    assert (out / "result.nc").exists()


@pytest.fixture
def stop_at(monkeypatch):
    """Have a function raise what is given at its call of such a number."""

    def prepare(name, number, stop=KeyboardInterrupt):
        path, _, function = name.rpartition(".")
        module, calls = import_module(path), []
        real = getattr(module, function)

        def one(*given, **named):
            calls.append(given)
            if len(calls) == number:
                raise stop
            return real(*given, **named)

        monkeypatch.setattr(module, function, one)

    return prepare


def interrupted_in_compiled_code():
    stop = SystemError("returned a result with an exception set")
    stop.__cause__ = KeyboardInterrupt()
    return stop


@pytest.mark.parametrize("stop", [KeyboardInterrupt(), interrupted_in_compiled_code()], ids=["Python", "compiled"])
def test_ctrl_c_in_rcs_keeps_the_angles_that_are_done(stop, stop_at, tmp_path, capsys):
    out, figure = tmp_path / "a.csv", tmp_path / "a.png"
    command = ["rcs", "--shape", "plate", "--azimuth", "0:8:2", "--out", str(out), "--plot", str(figure)]
    assert invoke(command[:-2]) == 0
    whole = out.read_text().splitlines()
    stop_at("raychan.run.rcs.rcs", 4, stop)
    out.unlink()
    capsys.readouterr()
    assert invoke(command) == 130
    assert but_compiling(capsys.readouterr().err) == f"raychan: interrupted; 3 of 5 angles are in {out}\n"
    assert out.read_text().splitlines() == whole[:4] and not figure.exists()


@pytest.mark.parametrize(
    ("stage", "says"),
    [("raychan.report.rcs_figure.rcs_picture", "5 of 5 angles are in a.csv"), ("raychan.cli.rcs.table_of", None)],
    ids=["as the figure is drawn", "as it reports"],
)
def test_ctrl_c_in_rcs_after_the_last_angle_loses_none_and_says_what_is_written(
    stage, says, stop_at, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    command = ["rcs", "--shape", "plate", "--azimuth", "0:8:2", "--out", "a.csv", "--plot", "a.png"]
    stop_at(stage, 1)
    assert invoke(command) == 130
    said = but_compiling(capsys.readouterr().err)
    assert said == f"raychan: interrupted; {says or 'written: a.csv, a.png'}\n"
    assert len((tmp_path / "a.csv").read_text().splitlines()) == 6
    assert (tmp_path / "a.png").exists() == (says is None)


def test_ctrl_c_in_rcs_without_a_table_writes_nothing(stop_at, tmp_path, capsys):
    stop_at("raychan.run.rcs.rcs", 2)
    figure = tmp_path / "a.png"
    assert invoke(["rcs", "--shape", "plate", "--azimuth", "0:8:2", "--plot", str(figure)]) == 130
    assert but_compiling(capsys.readouterr().err) == "raychan: interrupted; nothing was written\n"
    assert not figure.exists()


def test_ctrl_c_in_a_sweep_keeps_the_steps_that_are_done(scene, stop_at, tmp_path, capsys):
    out = tmp_path / "out"
    command = ["study", "sweep", str(scene), "--target", "sign", "--times", "0:0.2:3", "--out", str(out)]
    assert invoke(command) == 0
    whole = (out / "sweep.csv").read_text().splitlines()
    stop_at("raychan.study.sweep.visibility", 3)
    capsys.readouterr()
    assert invoke(command) == 130
    assert capsys.readouterr() == ("", f"raychan: interrupted; 2 of 3 steps are in {out / 'sweep.csv'}\n")
    assert (out / "sweep.csv").read_text().splitlines() == whole[:3]
    assert [p.name for p in out.iterdir()] == ["sweep.csv"]


def test_a_step_that_is_no_scene_keeps_the_steps_before_it(scene, tmp_path, capsys):
    """The radar stands in the box at the third of four steps."""
    out = tmp_path / "out"
    scene.write_text(PLATE.replace('shape = "plate"', 'shape = "box"'))
    command = ["study", "sweep", str(scene), "--target", "sign", "--out", str(out)]
    assert invoke([*command, "--vary", "bodies.sign.position.x=20:-10:4"]) == 2
    warned, told = but_compiling(capsys.readouterr().err).splitlines()
    assert warned == f"warning: 2 of 4 steps are in {out / 'sweep.csv'}"
    assert "(step bodies.sign.position.x = 0)" in told
    assert len((out / "sweep.csv").read_text().splitlines()) == 3
