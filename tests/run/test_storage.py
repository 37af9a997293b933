"""Results survive the disk, and others can read them."""

from __future__ import annotations

import dataclasses
import json

import h5py
import numpy as np
import pytest
import xarray as xr
from support.results import paths, result

import raychan as rc
from raychan.records import REFLECT, SCATTER
from raychan.run.files.output import StoreError
from raychan.run.ledger_entry import Entry, ModelChoice
from raychan.run.storage import COLUMNS, load_result, save_result
from raychan.units import C0

CHAIN = [(2, REFLECT), (3, SCATTER), (2, REFLECT)]


@pytest.fixture
def made():
    p = paths([9.0, 5.0], [-7.0, 1.0], [1e-5 + 2e-5j, 3e-6], [CHAIN, [(1, SCATTER)]])
    return result(p, [(9.0, -7.0, 5e-10), (5.0, 1.0, 9e-12)])


def records(r):
    return [r.paths, r.paths.trajectories, r.profile, r.cube, r.rdmap, r.detections]


def test_what_is_stored_comes_back_bit_for_bit(made, tmp_path):
    save_result(made, tmp_path)
    back = load_result(tmp_path)
    for was, now in zip(records(made), records(back), strict=True):
        for f in (f for f in dataclasses.fields(was) if f.name != "trajectories"):
            old, new = getattr(was, f.name), getattr(now, f.name)
            assert np.asarray(old).dtype == np.asarray(new).dtype
            np.testing.assert_array_equal(new, old, err_msg=f.name)
    for name in ("provenance", "receiver", "seed", "timings", "ledger", "warnings", "scene"):
        assert getattr(back, name) == getattr(made, name), name


def test_a_scene_made_in_python_comes_back_where_a_file_can_hold_it(made, tmp_path):
    ball = rc.Body(name="ball", shape="sphere", position=(5.0, 0.0, 0.5))
    wave = rc.Waveform(carrier=77e9, bandwidth=500e6, chirp_duration=40e-6, n_chirps=16, n_samples=64)
    scene = rc.Scene(bodies=[ball], radar=rc.Radar(waveform=wave))
    save_result(dataclasses.replace(made, scene=scene, text=""), tmp_path / "file")
    back = load_result(tmp_path / "file")
    assert [b.name for b in back.scene.bodies] == ["ball"] and list(back.scene.bodies[0].position) == [5.0, 0.0, 0.5]
    own = rc.Body(name="own", mesh=ball.geometry, position=(5.0, 0.0, 0.5), material="pec")
    scene = rc.Scene(bodies=[own], radar=rc.Radar(waveform=wave))
    save_result(dataclasses.replace(made, scene=scene, text=""), tmp_path / "memory")
    assert load_result(tmp_path / "memory").scene is None


def test_a_result_without_paths_or_detections_is_stored_too(tmp_path):
    save_result(result(paths([], [], [], []), []), tmp_path)
    back = load_result(tmp_path / "result.nc")
    assert (len(back.paths.delay), len(back.detections.range)) == (0, 0)
    assert (tmp_path / "detections.csv").read_text() == ",".join(COLUMNS) + "\n"


def test_groups_open_in_xarray_and_as_plain_hdf5_with_units(made, tmp_path):
    save_result(made, tmp_path)
    with xr.open_dataset(tmp_path / "result.nc", engine="h5netcdf", group="paths") as data:
        assert data["length"].attrs["units"] == "m"
        np.testing.assert_array_equal(data["amplitude_im"], made.paths.amplitude.imag)
    with h5py.File(tmp_path / "result.nc") as file:
        assert set(file) >= {"paths", "profile", "cube", "rdmap", "detections"}
        names: list[str] = []
        file.visit(names.append)
        kinds = {n: file[n].dtype.kind for n in names if isinstance(file[n], h5py.Dataset) and n.count("/") == 1}
        text = {n for n, kind in kinds.items() if kind not in "fiu"}
        assert text == {"detections/label", "detections/bodies"}, "else only real numbers, which MATLAB's h5read takes"


def test_a_file_of_the_former_form_is_read(made, tmp_path):
    save_result(made, tmp_path)
    with h5py.File(tmp_path / "result.nc", "a") as file:
        paths = file["paths"]
        paths["delay"] = paths["length"][:] / C0
        paths["range_rate"] = 0.5 * paths["length_rate"][:]
        del paths["length"], paths["length_rate"]
        file.attrs["format"] = 2
    back = load_result(tmp_path).paths
    np.testing.assert_allclose(back.length, made.paths.length, rtol=1e-15)
    np.testing.assert_array_equal(back.length_rate, made.paths.length_rate)


def test_map_and_profile_have_range_and_range_rate_as_coordinates_and_plot_with_named_axes(made, tmp_path):
    save_result(made, tmp_path)
    file = tmp_path / "result.nc"
    for group in ("rdmap", "error"):
        with xr.open_dataset(file, group=group) as data:
            assert data["power"].dims == ("range_rate", "range")
            np.testing.assert_array_equal(data.indexes["range"], made.rdmap.range)
            np.testing.assert_array_equal(data.indexes["range_rate"], made.rdmap.rate)
    with xr.open_dataset(file, group="rdmap") as data:
        best = data.power_dbm.isel(data.power.argmax(...))
        assert (float(best.range), float(best.range_rate)) == pytest.approx((9.0, -7.0), abs=0.2)
        assert float(best) == pytest.approx(-63.01, abs=0.01) and best.attrs["units"] == "dBm"
        axes = data.power.plot().axes
        assert axes.get_xlabel() == "range [m]" and "range rate" in axes.get_ylabel() and "m s-1" in axes.get_ylabel()
    with xr.open_dataset(file, group="profile") as data:
        assert data["power"].dims == ("range",) and np.array_equal(data.indexes["range"], made.profile.range)
    with xr.open_dataset(file, group="cube") as data:
        assert data["samples_re"].dims == ("antenna", "chirp", "sample")
        assert float(data.chirp_time[1]) == made.receiver.waveform.repetition
        assert float(data.sample_time[-1]) == pytest.approx(30e-6 * 127 / 128)


def test_detections_say_in_the_file_what_made_them_and_how_sure_they_are(made, tmp_path):
    save_result(made, tmp_path)
    with xr.open_dataset(tmp_path / "result.nc", group="detections") as data:
        assert data.label.values.tolist() == [why.label for why in made.provenance]
        assert data.bodies.values.tolist() == [why.bodies for why in made.provenance]
        assert data.bodies.values[0] == "truck.tail > walker > truck.tail"
        np.testing.assert_array_equal(data.error_db, [why.error_db for why in made.provenance])
        for name in ("converged", "folded"):
            if hasattr(made.detections, name):
                assert data[name].dtype == bool
                np.testing.assert_array_equal(data[name], getattr(made.detections, name))


def test_cells_of_detections_are_indices_into_the_map_of_the_file(made, tmp_path):
    save_result(made, tmp_path)
    with (
        xr.open_dataset(tmp_path / "result.nc", group="detections") as found,
        xr.open_dataset(tmp_path / "result.nc", group="rdmap") as rdmap,
    ):
        assert "cell" not in found and found.rate_cell.dims == found.range_cell.dims == ("detection",)
        assert {found[name].attrs["units"] for name in ("rate_cell", "range_cell")} == {"1"}
        at = rdmap.isel(range_rate=found.rate_cell, range=found.range_cell)
        np.testing.assert_array_equal(at.power, made.detections.power)
        np.testing.assert_allclose(at.range, found.range, atol=0.5 * made.rdmap.range_resolution)
        np.testing.assert_allclose(at.range_rate, found.range_rate, atol=0.5 * made.rdmap.rate_resolution)


UDUNITS = {"1", "m", "m s-1", "s", "W", "V", "rad", "dB", "dBm"}  # and decibels, which it has not
"""Each was parsed by UDUNITS-2."""


def test_every_variable_has_a_name_for_people_and_a_unit_that_udunits_parses(made, tmp_path):
    save_result(made, tmp_path)
    with h5py.File(tmp_path / "result.nc") as file:
        assert file.attrs["Conventions"] == "CF-1.11"
        for group in ("paths", "profile", "cube", "rdmap", "error", "detections"):
            with xr.open_dataset(tmp_path / "result.nc", group=group, decode_cf=False) as data:
                for name, column in data.variables.items():
                    assert column.attrs["long_name"], name
                    kind = column.dtype.kind
                    free = kind not in "fiu" or "flag_values" in column.attrs
                    assert free or column.attrs["units"] in UDUNITS, (group, name, column.attrs.get("units"))
    with xr.open_dataset(tmp_path / "result.nc", group="rdmap") as data:
        assert data.range_rate.attrs["standard_name"] == "radial_velocity_of_scatterers_away_from_instrument"


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
    assert summary["labels"] == {
        "direct": 1,
        "multipath": 1,
        "clutter": 0,
        "sidelobe": 0,
        "dc": 0,
        "image": 0,
        "interference": 0,
    }
    assert summary["left_out"] == {"diffraction": {"level_db": "unknown", "kind": "none", "how": ""}}


def test_every_entry_of_a_ledger_is_the_same_record_before_and_after_the_disk(made, tmp_path):
    choice = ModelChoice("none", "estimate", "chosen", bounces=2, transmissions=1, diffraction=False, why=("2 needed",))
    ledger = {
        "diffraction": Entry(-12.5, "bound", "wedge"),
        "transmission": Entry("none", "exact", ""),
        "model": choice,
    }
    save_result(dataclasses.replace(made, ledger=ledger), tmp_path)
    back = load_result(tmp_path).ledger
    assert back == ledger and all(isinstance(e, Entry) for e in back.values())
    told = json.loads((tmp_path / "summary.json").read_text())["left_out"]["model"]
    assert (told["bounces"], told["transmissions"], told["diffraction"], told["why"]) == (2, 1, False, ["2 needed"])


def test_a_file_that_is_not_ours_is_refused(tmp_path):
    with pytest.raises(StoreError, match="a directory without a result"):
        load_result(tmp_path)
    (tmp_path / "result.nc").write_bytes(b"not a netCDF file")
    with pytest.raises(StoreError, match="cannot be read"):
        load_result(tmp_path)


def test_a_result_is_saved_by_the_rules_of_the_command(made, tmp_path):
    out = tmp_path / "a" / "b"
    assert rc.save_result(made, str(out)) is None
    assert {p.name for p in out.iterdir()} == {"result.nc", "detections.csv", "summary.json"}
    back = rc.load_result(out)
    assert back.paths.amplitude.tobytes() == made.paths.amplitude.tobytes() and back.provenance == made.provenance
    (out / "rdmap.png").write_text("of the earlier result")
    (out / "notes.txt").write_text("mine")
    rc.save_result(back, out)
    assert {p.name for p in out.iterdir()} == {"result.nc", "detections.csv", "summary.json", "notes.txt"}


def test_a_place_where_no_result_can_be_saved_is_told_and_stays(made, tmp_path):
    (tmp_path / "detections.csv").write_text("mine")
    file = tmp_path / "detections.csv"
    for where, said in (
        (tmp_path, "detections.csv: exists, and .* is not a folder of results; move it away or name another folder"),
        (file, "detections.csv: is a file; name a directory"),
        (file / "out", "cannot be made|cannot write"),
    ):
        with pytest.raises(rc.StoreError, match=said):
            rc.save_result(made, where)
    for given, said in (
        ((3, "a"), "result = 3"),
        ((made, None), "directory = None: a text or a path"),
        ((made, "\0"), "zero"),
    ):
        with pytest.raises(ValueError, match=said):
            rc.save_result(*given)
    assert [p.read_text() for p in tmp_path.iterdir()] == ["mine"]


@pytest.mark.parametrize("name", ["result.nc", "summary.json"])
def test_a_note_of_ones_own_named_as_a_result_makes_no_folder_of_results(tmp_path, name):
    (tmp_path / name).write_text("mine")
    with pytest.raises(StoreError, match="not a folder of results"):
        save_result(result(paths([], [], [], []), []), tmp_path)
    assert (tmp_path / name).read_text() == "mine"
    with pytest.raises(ValueError, match="a name is wanted"):
        save_result(result(paths([], [], [], []), []), "")
