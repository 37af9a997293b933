"""The commands as a user meets them: what they print, what they write, how they fail."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys

import numpy as np
import pytest
from support.scene_texts import PLATE, but_compiling, walker

from raychan.cli import invoke


@pytest.fixture
def scene(tmp_path):
    file = tmp_path / "plate.toml"
    file.write_text(PLATE)
    return file


def run(scene, out, *more):
    return invoke(["run", str(scene), "--out", str(out), "--no-pictures", *more])


def test_run_prints_the_detections_and_writes_what_it_says(scene, tmp_path, capsys):
    assert run(scene, tmp_path / "out") == 0
    said = capsys.readouterr()
    assert "sign" in said.out and "direct" in said.out
    assert but_compiling(said.err) == "", "quiet where there is no terminal"
    assert {p.name for p in (tmp_path / "out").iterdir()} == {"result.nc", "detections.csv", "summary.json"}
    first = (tmp_path / "out" / "detections.csv").read_text().splitlines()[1].split(",")
    assert float(first[0]) == pytest.approx(9.0, abs=0.1)
    assert float(first[1]) == pytest.approx(-5.0, abs=0.1)
    assert float(first[2]) == pytest.approx(0.0, abs=0.1)


def test_explain_and_view_read_what_run_wrote(scene, tmp_path, capsys):
    out = tmp_path / "out"
    assert run(scene, out) == 0
    capsys.readouterr()
    assert invoke(["explain", str(out), "--range", "9", "--speed", "0"]) == 0
    assert "radar > sign > radar, 1 interaction, 9.0" in capsys.readouterr().out
    page = tmp_path / "scene.html"
    assert invoke(["view", str(out), "--html", str(page)]) == 0
    assert "/*DATA*/null" not in page.read_text() and '"sign"' in page.read_text()
    assert "http" not in page.read_text(), "needs no network"


def test_equal_seeds_give_equal_bytes_and_other_seeds_do_not(scene, tmp_path):
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        assert run(scene, tmp_path / name, "--seed", str(seed)) == 0
    a, b, c = ((tmp_path / n / "detections.csv").read_bytes() for n in "abc")
    assert a == b != c


def test_set_overrides_a_key_and_the_result_remembers(scene, tmp_path):
    from raychan.run.storage import load_result

    assert run(scene, tmp_path / "out", "--set", "bodies.sign.position=[6, 0, 1]") == 0
    again = load_result(tmp_path / "out")
    assert again.detections.range[0] == pytest.approx(6.0, abs=0.1)
    assert list(again.scene.facets().origin[0]) == [6.0, 0.0, 1.0]


def test_a_scene_with_nothing_in_view_is_a_valid_result(scene, tmp_path, capsys):
    assert run(scene, tmp_path / "out", "--set", "bodies.sign.position=[-9, 0, 1]") == 0
    assert "0 detections" in capsys.readouterr().out


def test_info_tells_how_often_a_target_is_detected(tmp_path, capsys):
    file, picture = tmp_path / "two.toml", tmp_path / "pd.png"
    file.write_text(PLATE + walker(12.0, 2.0) + "swerling = 1\n")
    assert invoke(["info", str(file), "--plot", str(picture)]) == 0
    assert re.search(r"walker +12\.17 +0\.0 +1 +-?\d+\.\d +[01]\.\d{3}", capsys.readouterr().out)
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert invoke(["info", "antennas/array_2x2", "--plot", str(picture)]) == 2
    assert "is no scene file" in capsys.readouterr().err


def test_spectrogram_writes_a_picture_and_netcdf(tmp_path, capsys):
    import xarray as xr

    file, out = tmp_path / "plate.toml", tmp_path / "out"
    file.write_text(PLATE)
    command = ["spectrogram", str(file), "--out", str(out), "--seconds", "0.01", "--resolution", "0.5"]
    assert invoke([*command, "--near", "5", "--far", "12"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "tracings" in said and "m/s (0.5 asked: a stretch has whole chirps) over" in said
    with xr.open_dataset(out / "spectrogram.nc", engine="h5netcdf") as data:
        ridge = data.range_rate[data.power_dbm.argmax("range_rate")]
        assert np.allclose(ridge, -5.0, atol=0.2) and data.power_dbm.attrs["units"] == "dBm"
        numbers = {name for name, value in data.attrs.items() if not isinstance(value, str)} - {"seed"}
        assert {f"{name}_units" for name in numbers} == {name for name in data.attrs if name.endswith("_units")}
        assert data.attrs["resolution"] == pytest.approx(0.5, rel=0.05) and data.attrs["resolution_units"] == "m s-1"
    assert (out / "spectrogram.png").read_bytes().startswith(b"\x89PNG")
    assert invoke([*command, "--near", "500", "--far", "600"]) == 2
    assert "no range cell" in capsys.readouterr().err
    for option, value, words in (
        ("--near", "-1", "must lie between 0 and 1e+06 m"),
        ("--far", "nan", "must lie between 0 and 1e+06 m"),
        ("--resolution", "50", "resolution = 50 m/s: must lie between 0.1"),
    ):
        assert invoke([*command, option, value]) == 2
        assert words in " ".join(capsys.readouterr().err.split())


def test_info_tells_of_scenes_and_of_meshes(scene, tmp_path, capsys):
    trimesh = pytest.importorskip("trimesh")
    assert invoke(["info", str(scene)]) == 0
    said = capsys.readouterr().out
    for word in ("sign", "isotropic", "EIRP", "15.01 dBm", "unambiguous range", "computed"):
        assert word in said
    patch = tmp_path / "patch.toml"
    patch.write_text('kind = "cosine"\nhpbw_h_deg = 80.0\nhpbw_v_deg = 60.0\n[published]\nhpbw_v_deg = 59.5\n')
    assert invoke(["info", str(patch)]) == 0
    said = capsys.readouterr().out
    assert re.search(r"width, elevation \[deg\] +60.00 +59.5 *\n", said)
    assert re.search(r"width, azimuth \[deg\] +80.00 *\n", said)
    box = tmp_path / "box.stl"
    trimesh.creation.box((1.0, 2.0, 3.0)).export(box)
    assert invoke(["info", str(box)]) == 0
    said = capsys.readouterr().out
    assert "1.000 x 2.000 x 3.000 m" in said and "watertight" in said


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (["run", "missing.toml", "--out", "o"], "missing.toml"),
        (["run", "{scene}"], "--out"),
        (["run", "{scene}", "--out", "o", "--set", "radar.powr_dbm=3"], "power_dbm"),
        (["run", "{scene}", "--out", "o", "--tolerance", "-1"], "tolerance"),
        (["run", "{scene}", "--out", "{scene}"], "is a file"),
        (["explain", "nowhere", "--range", "3"], "nowhere"),
        (["view", "{scene}", "--html", "no/such/place.html"], "no/such/place.html"),
        (["view", "{scene}", "--screenshot", "x.jpg"], ".png"),
        (["info", "nothing.stl"], "nothing.stl"),
        (["run", "{scene}", "--out", "o", "--set", "radar.antenna=horn.toml"], "no antenna file"),
        (["run", "{scene}", "--out", "o", "--set", "radar.antenna={{kind='array', gain=3}}"], "gain_dbi"),
        (["run", "{scene}", "--out", "o", "--preview", "--set", "model.mode=auto"], "model.mode"),
        (["sing"], "sing"),
    ],
)
def test_bad_input_is_told_in_a_sentence_with_exit_code_2(command, words, scene, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    assert invoke([word.format(scene=scene) for word in command]) == 2
    said = capsys.readouterr().err
    assert words in said and "Traceback" not in said
    assert sorted(tmp_path.rglob("*")) == before


def test_explain_outside_the_map_is_told(scene, tmp_path, capsys):
    run(scene, tmp_path / "out")
    assert invoke(["explain", str(tmp_path / "out"), "--range", "900"]) == 2
    assert "outside the map" in capsys.readouterr().err


def python(code):
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)


_BESIDE = """
import threading, time
from raychan.parallel import parallel_for
def launched(here):
    # One launch is interrupted, the one beside it goes on and on.
    while threading.current_thread() is not threading.main_thread():
        parallel_for(1, lambda rows: time.sleep(0.01))
    here()
"""
_STOPPED = (
    _BESIDE
    + """
import os, signal, sys
import raychan.run.scene_channel, raychan.cli
# A job in the background starts deaf to it.
signal.signal(signal.SIGINT, signal.default_int_handler)
raychan.run.scene_channel._refined = lambda *a: None
raychan.run.scene_channel.solve_into = lambda *a, **k: launched(lambda: os.kill(os.getpid(), signal.SIGINT))
sys.exit(raychan.cli.invoke(["run", {scene!r}, "--out", {out!r}]))
"""
)


def test_ctrl_c_ends_with_130_and_leaves_nothing(scene, tmp_path):
    done = python(_STOPPED.format(scene=str(scene), out=str(tmp_path / "out")))
    assert (done.returncode, done.stdout) == (130, ""), done.stderr
    assert but_compiling(done.stderr) == "raychan: interrupted; nothing was written\n"
    assert [p.name for p in tmp_path.iterdir()] == [scene.name]


_STOPPED_IN_REFINEMENT = """
import os, signal, sys
import raychan.run.refinement.scene_refinement, raychan.cli
signal.signal(signal.SIGINT, signal.default_int_handler)
raychan.run.refinement.scene_refinement.changes = lambda *a: os.kill(os.getpid(), signal.SIGINT)
sys.exit(raychan.cli.invoke(["run", {scene!r}, "--out", {out!r}]))
"""


def test_ctrl_c_within_refinement_ends_with_130_and_leaves_nothing(scene, tmp_path):
    done = python(_STOPPED_IN_REFINEMENT.format(scene=str(scene), out=str(tmp_path / "out")))
    assert (done.returncode, done.stdout) == (130, ""), done.stderr
    assert [p.name for p in tmp_path.iterdir()] == [scene.name]


_STOPPED_IN_LOOP = """
import raychan.run.simulate, raychan.cli
def result_of(*a):
    raise SystemError("returned a result with an exception set") from KeyboardInterrupt()
raychan.run.simulate.result_of = result_of
raychan.cli.main(["run", {scene!r}, "--out", {out!r}])
"""


def test_ctrl_c_that_a_compiled_loop_hands_on_as_a_fault_ends_with_130(scene, tmp_path):
    done = python(_STOPPED_IN_LOOP.format(scene=str(scene), out=str(tmp_path / "out")))
    assert (done.returncode, but_compiling(done.stderr)) == (130, "raychan: interrupted; nothing was written\n")


_STOPPED_IN_C = (
    _BESIDE
    + """
import ctypes, os, signal, time
import raychan.run.scene_channel, raychan.cli
# A job in the background starts deaf to it.
signal.signal(signal.SIGINT, signal.default_int_handler)
stop = ctypes.CFUNCTYPE(None)(lambda: os.kill(os.getpid(), signal.SIGINT))
raychan.run.scene_channel._refined = lambda *a: None
raychan.run.scene_channel.solve_into = lambda *a, **k: launched(lambda: (stop(), time.sleep(50)))
raychan.cli.main(["run", {scene!r}, "--out", {out!r}])
"""
)


def test_ctrl_c_is_not_lost_in_a_callback_from_c(scene, tmp_path):
    done = python(_STOPPED_IN_C.format(scene=str(scene), out=str(tmp_path / "out")))
    assert (done.returncode, but_compiling(done.stderr)) == (130, "raychan: interrupted; nothing was written\n")


_HELP = """
import sys, raychan.cli
code = raychan.cli.invoke(["--help"])
print(code, sorted({"numpy", "xarray", "numba"} & set(sys.modules)))
"""


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs a shell with PIPESTATUS")
@pytest.mark.parametrize(
    ("command", "reader", "out"), [("info {}", "head -1", "A plate ahead\n"), ("--help", "true", "")]
)
def test_a_reader_that_goes_away_is_no_error(command, reader, out, scene):
    line = f"{sys.executable} -m raychan {command.format(scene)} | {reader}; echo ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", line], capture_output=True, text=True, timeout=60, check=False)
    assert (done.stdout, done.stderr) == (f"{out}0\n", "")


def test_help_is_light_and_names_every_command():
    done = python(_HELP)
    assert done.returncode == 0 and done.stdout.endswith("0 []\n"), done.stdout + done.stderr
    for command in ("run", "info", "explain", "view"):
        assert f" {command} " in done.stdout


def test_without_opengl_the_picture_is_drawn_by_matplotlib_with_a_warning(scene, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("RAYCHAN_NO_OPENGL", "1")
    assert invoke(["view", str(scene), "--screenshot", str(tmp_path / "s.png")]) == 0
    assert "warning: scene picture drawn by matplotlib" in capsys.readouterr().err
    assert (tmp_path / "s.png").read_bytes().startswith(b"\x89PNG")


def test_pictures_are_drawn_even_of_a_map_without_detections(scene, tmp_path, monkeypatch):
    monkeypatch.setenv("RAYCHAN_NO_OPENGL", "1")
    for name, place in (("one", "[9, 0, 1]"), ("none", "[-9, 0, 1]")):
        command = ["run", str(scene), "--out", str(tmp_path / name), "--set", f"bodies.sign.position={place}"]
        assert invoke(command) == 0
        for picture in ("scene.png", "profile.png", "rdmap.png"):
            assert (tmp_path / name / picture).stat().st_size > 5000


def options(group):
    for command in group.commands.values():
        yield from options(command) if hasattr(command, "commands") else ((command.name, p) for p in command.params)


def test_help_has_no_bracketed_word_that_typer_would_swallow_as_a_style():
    from typer.main import get_command

    from raychan.cli import app

    told = [(name, p.help) for name, p in options(get_command(app)) if getattr(p, "help", "")]
    assert len(told) > 40
    assert not [(name, text) for name, text in told if re.search(r"\[/?[a-zA-Z]", text)]
