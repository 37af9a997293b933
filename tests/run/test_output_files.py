"""A folder of results is the old one or the new one, whole, whatever dies, fills up or stands in the way."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from support.places import TESTS
from support.results import paths, result
from support.scene_texts import PLATE, but_compiling

from raychan.cli import invoke
from raychan.run.files import atomic_swap
from raychan.run.files import output as output_files
from raychan.run.files.contents import Contents
from raychan.run.files.output import StoreError, folder_for, staging, write_together, write_whole
from raychan.run.storage import CONTENTS, write_result

FOLDERS = [str(TESTS), str(TESTS / "run")]
KIND = Contents(("data", "*.png", "part_*/"), signs=("data", "part_*/data"))
NOT_WINDOWS = pytest.mark.skipif(sys.platform == "win32", reason="needs locks that die with their process")


def put(out, **content):
    with staging(out, KIND) as stage:
        for name, text in content.items():
            file = stage / name.replace("__", "/").replace("_png", ".png")
            file.parent.mkdir(exist_ok=True)
            file.write_text(text)


def tree(folder):
    return {str(p.relative_to(folder)): p.read_text() for p in sorted(folder.rglob("*")) if p.is_file()}


@pytest.fixture(params=["exchanged at once", "by renames", "file by file"])
def way(request, monkeypatch):
    """Each way in which a folder may come to its place; the file system decides, so that other ways are cut off."""
    if request.param != "exchanged at once":
        monkeypatch.setattr(atomic_swap, "_exchange_at_once", lambda new, old: False)
    if request.param == "file by file":
        monkeypatch.setattr(output_files, "exchange", lambda new, old: False)
    return request.param


def test_a_new_result_replaces_all_of_the_old_and_nothing_of_anyone_else(way, tmp_path):
    out = tmp_path / "out"
    put(out, data="old", a_png="old", b_png="old", part_1__data="old", part_2__data="old")
    mine = {"notes.txt": "mine", "sub/deep/x.png": "mine", "part_1/notes": "mine"}
    for name, text in mine.items():
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        (out / name).write_text(text)
    (out / "link").symlink_to("nowhere")
    put(out, data="new", a_png="new")
    assert tree(out) == {"data": "new", "a.png": "new"} | mine
    assert os.readlink(out / "link") == "nowhere"
    assert [p.name for p in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize("trouble", [KeyboardInterrupt, ValueError])
def test_trouble_leaves_no_trace(trouble, way, tmp_path):
    out = tmp_path / "a" / "b"
    for before in ({}, {"data": "old"}):
        if before:
            put(out, **before)
        with pytest.raises(trouble), staging(out, KIND) as stage:
            (stage / "data").write_text("half")
            raise trouble
        assert [str(p.relative_to(tmp_path)) for p in tmp_path.rglob("*")] == (
            ["a", "a/b", "a/b/data"] if before else []
        )
        assert not before or tree(out) == before


def test_what_stands_in_the_way_is_told_and_stays(tmp_path):
    (tmp_path / "file").write_text("mine")
    with pytest.raises(StoreError, match="is a file"), staging(tmp_path / "file", KIND):
        pass
    out = tmp_path / "holiday"
    out.mkdir()
    (out / "beach.png").write_text("mine")
    with pytest.raises(StoreError, match=r"beach\.png.*move it away"):
        put(out, data="new")
    (out / "beach.png").rename(out / "beach.jpg")
    put(out, data="new")
    assert tree(out) == {"data": "new", "beach.jpg": "mine"}
    (out / "a.png").mkdir()
    with pytest.raises(StoreError, match="is a directory in the place of a file"):
        put(out, data="newer")
    assert (out / "data").read_text() == "new"


# A kill at a moment between two steps cannot be asked for: the steps themselves end the process.
_KILLED = """
import os, signal, sys
sys.path[:0] = {folders!r}
from raychan.run.files import output as output_files
from test_output_files import KIND, put
def die(*a, **k):
    os.kill(os.getpid(), signal.SIGKILL)
at = {at!r}
if at == "inside":
    with output_files.staging({out!r}, KIND) as stage:
        (stage / "data").write_text("half")
        (stage / "half.png").write_text("half")
        die()
elif at == "between renames":
    from raychan.run.files import atomic_swap
    atomic_swap._exchange_at_once = lambda new, old: False
    rename, calls = os.rename, []
    def once(a, b):
        calls.append(a)
        rename(a, b) if len(calls) == 1 else die()
    os.rename = once
else:
    setattr(output_files, at, die)
put({out!r}, data="new", b_png="new")
"""


@NOT_WINDOWS
@pytest.mark.parametrize("at", ["inside", "between renames", "_move_foreign", "_remove", "_replace"])
def test_after_a_kill_at_any_moment_the_next_run_of_the_folder_finds_all_that_is_anyones(at, tmp_path):
    out = tmp_path / "out"
    put(out, data="old", a_png="old")
    (out / "notes").write_text("mine")
    code = _KILLED.format(folders=FOLDERS, out=str(out), at=at)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == -signal.SIGKILL, done.stderr
    assert len(list(tmp_path.iterdir())) > 1 or at == "between renames", "it left something"
    with pytest.raises(KeyError), staging(out, KIND):
        raise KeyError  # a run that comes to nothing clears and restores too
    swapped = at in ("_move_foreign", "_remove")
    assert tree(out) == ({"data": "new", "b.png": "new"} if swapped else {"data": "old", "a.png": "old"}) | {
        "notes": "mine"
    }
    assert [p.name for p in tmp_path.iterdir()] == ["out"]


@NOT_WINDOWS
def test_what_a_living_process_builds_is_left_to_it(tmp_path):
    out = tmp_path / "out"
    with staging(out, KIND) as first:
        (first / "data").write_text("first")
        put(out, data="second")
        assert first.is_dir() and (out / "data").read_text() == "second"
    assert (out / "data").read_text() == "first"
    assert [p.name for p in tmp_path.iterdir()] == ["out"]


@NOT_WINDOWS
def test_a_folder_is_never_seen_half_replaced(tmp_path):
    if not sys.platform.startswith("linux"):
        pytest.skip("folders are exchanged at once on Linux only")
    out, end = tmp_path / "out", time.monotonic() + 1.0
    put(out, data="0", a_png="0")
    code = f"import sys; sys.path[:0] = {FOLDERS!r}\nfrom test_output_files import put\n"
    code += f"for k in range(200): put({str(out)!r}, data=str(k), a_png=str(k))"
    with subprocess.Popen([sys.executable, "-c", code]) as writer:
        looks = 0
        while writer.poll() is None or time.monotonic() < end:
            handle = os.open(out, os.O_RDONLY)  # one folder, whatever its name becomes
            try:
                texts = []
                for name in ("data", "a.png"):
                    file = os.open(name, os.O_RDONLY, dir_fd=handle)
                    texts.append(os.read(file, 99))
                    os.close(file)
                assert texts[0] == texts[1]
                looks += 1
            except FileNotFoundError:
                pass  # the old folder was emptied meanwhile
            finally:
                os.close(handle)
    assert writer.returncode == 0 and looks > 10


def test_the_current_directory_can_be_written_to_and_stays_the_current_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.toml").write_text("mine")
    for text in ("old", "new"):
        put(".", data=text, **({"a_png": text} if text == "old" else {}))
    assert tree(Path()) == {"data": "new", "scene.toml": "mine"}


def test_files_are_written_whole_all_or_none(tmp_path):
    write_whole(tmp_path / "x", b"1")
    assert (tmp_path / "x").read_bytes() == b"1"
    with pytest.raises(StoreError, match="cannot write"):
        write_together({tmp_path / "x": b"2", tmp_path / "missing" / "y": b"2"})
    assert tree(tmp_path) == {"x": "1"}
    (tmp_path / "link").symlink_to("x")
    write_whole(tmp_path / "link", b"3")
    assert (tmp_path / "link").is_symlink() and (tmp_path / "x").read_bytes() == b"3"


_FULL = """
import resource, sys
sys.path[:0] = {folders!r}
import numpy as np
import raychan.cli, raychan.run.simulate as chain
from support.results import paths, result
n = 20_000
big = result(paths(np.full(n, 5.0), np.zeros(n), np.ones(n), [[(1, 3)]] * n), [])
chain.simulate = lambda *a, **k: big
def grown(count):
    import raychan.run.sequence as s
    return lambda *a, **k: (s.Frame(k, 0.1 * k, big) for k in range(count))
import raychan.run.sequence
raychan.run.sequence.frames = grown(2)
resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit}))
raychan.cli.main({argv!r})
"""


@pytest.mark.skipif(sys.platform == "win32", reason="needs resource limits")
@pytest.mark.parametrize("more", [(), ("--frames", "2")], ids=["one", "frames"])
def test_a_full_disk_ends_with_2_and_one_sentence_and_the_old_result(more, tmp_path):
    out, scene = tmp_path / "out", tmp_path / "plate.toml"
    scene.write_text(PLATE)
    with staging(out, CONTENTS) as stage:
        write_result(result(paths([9.0], [-7.0], [1e-5], [[(2, 3)]]), [(9.0, -7.0, 5e-10)]), stage)
    old = {p.name: p.read_bytes() for p in out.iterdir()}
    argv = ["run", str(scene), "--out", str(out), "--no-pictures", *more]
    code = _FULL.format(folders=FOLDERS, argv=argv, limit=100_000)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 2, (done.returncode, done.stderr)
    assert done.stderr.startswith(f"raychan: {out}") and done.stderr.count("\n") == 1
    assert {p.name: p.read_bytes() for p in out.iterdir()} == old
    assert {p.name for p in tmp_path.iterdir()} == {"out", "plate.toml"}


@NOT_WINDOWS
def test_an_out_of_links_in_a_circle_ends_with_2_and_one_sentence(tmp_path, capsys):
    scene, one, two = tmp_path / "plate.toml", tmp_path / "one", tmp_path / "two"
    scene.write_text(PLATE)
    one.symlink_to(two)
    two.symlink_to(one)
    before = sorted(tmp_path.iterdir())
    for out in (one, one / "deeper"):
        assert invoke(["run", str(scene), "--out", str(out), "--no-pictures"]) == 2
        said = capsys.readouterr()
        assert said.out == "" and str(out) in said.err and "Traceback" not in said.err
        assert but_compiling(said.err).startswith("raychan: ") and but_compiling(said.err).count("\n") == 1
    assert invoke(["rcs", "--shape", "plate", "--out", str(one)]) == 2
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs a device that is always full")
@pytest.mark.parametrize("argv", [["--version"], ["info", "{scene}"], ["rcs", "--help"]])
def test_a_standard_output_that_is_full_ends_with_2(argv, tmp_path):
    scene = tmp_path / "plate.toml"
    scene.write_text(PLATE)
    command = [sys.executable, "-m", "raychan", *(a.format(scene=scene) for a in argv)]
    with open("/dev/full", "w") as full:
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, timeout=120, check=False)
    assert (done.returncode, done.stderr) == (2, "raychan: standard output: No space left on device\n")


@pytest.mark.skipif(sys.platform == "win32", reason="needs resource limits")
def test_of_a_table_and_a_picture_the_table_is_written_where_there_is_room_for_one_only(tmp_path):
    code = "import resource, raychan.cli\nresource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))\n"
    code += f"raychan.cli.main({['rcs', '--shape', 'plate', '--out', 'a.csv', '--plot', 'a.png']!r})"
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, timeout=200, check=False, cwd=tmp_path)
    assert (done.returncode, [p.name for p in tmp_path.iterdir()]) == (2, ["a.csv"]), done.stderr
    assert "a.png: cannot write: File too large; the table is in a.csv" in done.stderr and "RCS dBsm" in done.stdout


@pytest.mark.skipif(sys.platform == "win32", reason="needs resource limits")
def test_a_spectrogram_that_cannot_be_written_leaves_no_folder(tmp_path):
    (tmp_path / "plate.toml").write_text(PLATE)
    argv = ["spectrogram", "plate.toml", "--seconds", "0.01", "--resolution", "0.5", "--out", "new/out"]
    code = "import resource, raychan.cli\nresource.setrlimit(resource.RLIMIT_FSIZE, (2_000, 2_000))\n"
    code += f"raychan.cli.main({argv!r})"
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, timeout=200, check=False, cwd=tmp_path)
    assert done.returncode == 2 and "cannot write: File too large" in done.stderr, done.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["plate.toml"]
    with pytest.raises(OSError, match="mine"), folder_for(tmp_path / "a" / "b"):
        (tmp_path / "a" / "mine").touch()
        raise OSError("mine")
    assert [p.name for p in (tmp_path / "a").iterdir()] == ["mine"]


def test_pictures_of_an_earlier_run_do_not_stay_beside_new_data(tmp_path):
    one = result(paths([9.0], [-7.0], [1e-5], [[(2, 3)]]), [(9.0, -7.0, 5e-10)])
    for pictures in (("scene.png", "rdmap.png"), ()):
        with staging(tmp_path / "out", CONTENTS) as stage:
            write_result(one, stage)
            for name in pictures:
                (stage / name).write_text("")
    assert {p.name for p in (tmp_path / "out").iterdir()} == {"result.nc", "detections.csv", "summary.json"}
