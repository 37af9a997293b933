"""Results survive the disk, or the disk is as it was."""

from __future__ import annotations

import dataclasses
import json
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr
from records import paths, result

from raychan.run.files import StoreError, staging, write_whole
from raychan.run.store import COLUMNS, load_result, save_result
from raychan.tables import REFLECT, SCATTER

CHAIN = [(2, REFLECT), (3, SCATTER), (2, REFLECT)]


@pytest.fixture
def made():
    p = paths([9.0, 5.0], [-7.0, 1.0], [1e-5 + 2e-5j, 3e-6], [CHAIN, [(1, SCATTER)]])
    return result(p, [(9.0, -7.0, 5e-10), (5.0, 1.0, 9e-12)])


def records(r):
    return [r.paths, r.paths.ways, r.profile, r.cube, r.rdmap, r.detections]


def test_what_is_stored_comes_back_bit_for_bit(made, tmp_path):
    save_result(made, tmp_path)
    back = load_result(tmp_path)
    for was, now in zip(records(made), records(back), strict=True):
        for f in (f for f in dataclasses.fields(was) if f.name != "ways"):
            old, new = getattr(was, f.name), getattr(now, f.name)
            assert np.asarray(old).dtype == np.asarray(new).dtype
            np.testing.assert_array_equal(new, old, err_msg=f.name)
    for name in ("provenance", "receiver", "seed", "timings", "ledger", "warnings", "scene"):
        assert getattr(back, name) == getattr(made, name), name


def test_a_result_without_paths_or_detections_is_stored_too(tmp_path):
    save_result(result(paths([], [], [], []), []), tmp_path)
    back = load_result(tmp_path / "result.nc")
    assert (len(back.paths.delay), len(back.detections.range)) == (0, 0)
    assert (tmp_path / "detections.csv").read_text() == ",".join(COLUMNS) + "\n"


def test_groups_open_in_xarray_and_as_plain_hdf5_with_units(made, tmp_path):
    save_result(made, tmp_path)
    with xr.open_dataset(tmp_path / "result.nc", engine="h5netcdf", group="paths") as data:
        assert data["delay"].attrs["units"] == "s"
        np.testing.assert_array_equal(data["amplitude_im"], made.paths.amplitude.imag)
    with h5py.File(tmp_path / "result.nc") as file:
        assert set(file) >= {"paths", "profile", "cube", "rdmap", "detections"}
        names: list[str] = []
        file.visit(names.append)
        kinds = {
            file[n].dtype.kind for n in names if isinstance(file[n], h5py.Dataset) and file[n].name.count("/") == 2
        }
        assert kinds <= set("fiu"), "only real numbers, which MATLAB's h5read takes"


def test_a_long_scene_text_is_kept_whole(made, tmp_path):
    text = "# öäü\n" * 40_000
    save_result(dataclasses.replace(made, text=text, path="street.toml"), tmp_path)
    assert load_result(tmp_path).text == text


def test_csv_and_summary_say_what_the_record_holds(made, tmp_path):
    save_result(made, tmp_path)
    head, first, _ = (tmp_path / "detections.csv").read_text().splitlines()
    assert head == (
        "range_m,range_rate_mps,speed_mps,azimuth_deg,snr_db,power_dbm,error_db,converged,folded,true_range_m,"
        "true_range_rate_mps,label,bodies"
    )
    assert first.startswith("9.0000,-7.0000,0.0000,,30.00,-63.01,")
    assert ",true,false,8.99" in first  # mid frame it has come nearer
    assert first.endswith(",multipath,truck.tail > walker > truck.tail")
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["labels"] == {"direct": 1, "multipath": 1, "clutter": 0}
    assert summary["left_out"] == {"diffraction": "unknown"}


def test_a_file_that_is_not_ours_is_refused(tmp_path):
    with pytest.raises(StoreError, match="no such file"):
        load_result(tmp_path)
    (tmp_path / "result.nc").write_bytes(b"not a netCDF file")
    with pytest.raises(StoreError, match="cannot be read"):
        load_result(tmp_path)


@pytest.mark.parametrize("trouble", [KeyboardInterrupt, ValueError])
def test_trouble_leaves_no_trace(trouble, tmp_path):
    out = tmp_path / "a" / "b"
    with pytest.raises(trouble), staging(out) as stage:
        (stage / "half").write_text("half")
        raise trouble
    assert list(tmp_path.iterdir()) == []


def test_a_new_result_replaces_the_old_and_keeps_what_is_not_its_own(tmp_path):
    for text in ("old", "new"):
        with staging(tmp_path / "out") as stage:
            (stage / "file").write_text(text)
        (tmp_path / "out" / "notes").write_text("mine")
    assert (tmp_path / "out" / "file").read_text() == "new"
    assert (tmp_path / "out" / "notes").exists()
    assert [p.name for p in tmp_path.iterdir()] == ["out"]


def test_a_file_in_the_way_is_an_error(tmp_path):
    (tmp_path / "out").write_text("")
    with pytest.raises(StoreError, match="is a file"), staging(tmp_path / "out"):
        pass


_FULL = """
import resource, sys
sys.path.insert(0, {tests!r})
from pathlib import Path
import numpy as np
from records import paths, result
from raychan.run.files import StoreError, staging
from raychan.run.store import save_result
n = 20_000
r = result(paths(np.full(n, 5.0), np.zeros(n), np.ones(n), [[(1, 3)]] * n), [])
resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
try:
    with staging({out!r}) as stage:
        save_result(r, stage)
except StoreError as error:
    print(error)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="needs resource limits")
def test_a_full_disk_is_told_and_leaves_the_old_result(made, tmp_path):
    out = tmp_path / "out"
    with staging(out) as stage:
        save_result(made, stage)
    old = {p.name: p.read_bytes() for p in out.iterdir()}
    code = _FULL.format(tests=str(Path(__file__).parent), out=str(out))
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert "cannot write" in done.stdout, done.stderr
    assert {p.name: p.read_bytes() for p in out.iterdir()} == old
    assert [p.name for p in tmp_path.iterdir()] == ["out"]


def test_a_single_file_is_written_whole_or_not_at_all(tmp_path):
    write_whole(tmp_path / "x", b"1")
    assert (tmp_path / "x").read_bytes() == b"1"
    with pytest.raises(StoreError, match="cannot write"):
        write_whole(tmp_path / "missing" / "x", b"1")
    assert [p.name for p in tmp_path.iterdir()] == ["x"]
