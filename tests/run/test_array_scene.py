"""A scene seen by an array: from its file to detections with angles, range-azimuth map and pictures."""

import csv

import numpy as np
import pytest
import xarray as xr

import raychan as rc
from raychan.cli import invoke

SCENE = """
[radar]
position = [0, 0, 1]
power_dbm = 40
noise_figure_db = 5
elements_mm = [{elements}]
[radar.waveform]
bandwidth_mhz = 300
chirp_us = 20
chirps = 32
samples = 64
[processing]
doa = "{doa}"
[model]
max_bounces = 1
tolerance_db = 3
[[bodies]]
name = "left"
shape = "sphere"
params = {{ radius = 0.2 }}
position = [9.3969, 3.4202, 1]
[[bodies]]
name = "right"
shape = "sphere"
params = {{ radius = 0.2 }}
position = [9.3969, -3.4202, 1]
"""


def scene(places, doa="bartlett"):
    return SCENE.format(elements=", ".join(f"[0, {y}, {z}]" for y, z in places), doa=doa)


@pytest.fixture(scope="module")
def line():
    return rc.simulate(rc.Scene.from_text(scene([(1.94 * k, 0) for k in range(8)])))


def test_two_equal_spheres_in_one_cell_are_two_detections_within_1_deg(line):
    found = line.detections
    assert np.degrees(np.sort(found.azimuth)) == pytest.approx([-20.0, 20.0], abs=1.0)
    assert (found.cell[0] == found.cell[1]).all()
    assert abs(np.diff(10.0 * np.log10(found.power))[0]) < 0.3
    assert not found.ambiguous.any() and np.isnan(found.elevation).all()
    assert {why.bodies for why in line.provenance} == {"left", "right"}
    for why, azimuth in zip(line.provenance, found.azimuth, strict=True):
        assert why.bodies == ("left" if azimuth > 0.0 else "right")
        assert why.contributions[0].share > 0.9 and why.error_db < 1.0


def test_samples_and_map_give_one_range_azimuth_map(line):
    radar = line.scene.radar
    here, there = rc.range_azimuth(line.cube, radar), rc.range_azimuth(line.rdmap, radar)
    assert here.power.tobytes() == there.power.tobytes()
    alone = rc.Scene.from_text(scene([(0, 0)])).radar
    with pytest.raises(ValueError, match="no azimuth"):
        rc.range_azimuth(line.rdmap.replace(spectrum=line.rdmap.spectrum[:1]), alone)
    assert here.plot() is not None


def test_run_writes_angles_and_pictures_of_a_plane_array(tmp_path, capsys):
    file, out = tmp_path / "plane.toml", tmp_path / "out"
    file.write_text(scene([(1.94 * i, 1.94 * k) for i in range(6) for k in range(3)], "music"))
    assert invoke(["run", str(file), "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "elevation deg" in said and "range_azimuth.png" in said
    assert {"range_azimuth.png", "beams.png"} <= {p.name for p in out.iterdir()}
    with open(out / "detections.csv", encoding="utf-8") as lines:
        rows = list(csv.DictReader(lines))
    assert sorted(float(r["azimuth_deg"]) for r in rows) == pytest.approx([-20.0, 20.0], abs=1.0)
    assert [float(r["elevation_deg"]) for r in rows] == pytest.approx([0.0, 0.0], abs=1.0)
    with xr.open_dataset(out / "result.nc", engine="h5netcdf", group="range_azimuth") as data:
        assert data["power"].dims == ("azimuth", "range") and data["azimuth"].attrs["units"] == "rad"
        assert np.isfinite(data["power_dbm"]).any()
    back = rc.load_result(out)
    assert np.degrees(np.sort(back.detections.azimuth)) == pytest.approx([-20.0, 20.0], abs=1.0)


def test_a_line_s_pictures_are_drawn_and_one_receiver_has_none(line, tmp_path):
    from raychan.report.direction_figures import direction_pictures

    assert [p.name for p in direction_pictures(line, tmp_path)] == ["range_azimuth.png", "beams.png"]
    alone = rc.simulate(rc.Scene.from_text(scene([(0, 0)])))
    assert direction_pictures(alone, tmp_path) == []


def test_receivers_a_wavelength_apart_say_that_directions_are_ambiguous():
    wide = rc.simulate(rc.Scene.from_text(scene([(3.9 * k, 0) for k in range(8)])))
    assert wide.detections.ambiguous.all()
    assert any("ambiguous in direction" in line for line in wide.warnings)


WAVE = rc.Waveform(77e9, 300e6, 20e-6, n_chirps=32, n_samples=64)


def target(name, range, azimuth_deg, level_dbsm):
    direction = np.array([np.cos(np.radians(azimuth_deg)), np.sin(np.radians(azimuth_deg)), 0.0])
    place = tuple(np.array([0.0, 0.0, 1.0]) + range * direction)
    return rc.Body(name=name, shape="sphere", params={"radius": 0.004}, position=place, rcs_dbsm=level_dbsm)


@pytest.mark.parametrize("away", [0.3, 0.5, 1.0, 1.5])
@pytest.mark.parametrize(("strong", "weak"), [(28.5, -11.3), (-20.0, 35.0)])
def test_an_echo_beside_a_stronger_one_in_another_cell_and_direction_is_explained_by_its_own_body(away, strong, weak):
    """Its predicted power is its own too: what another direction brings does not pass its beam."""
    radar = rc.Radar(WAVE, position=(0, 0, 1), power=1.0, elements=rc.uniform_array(16, 0.5 * WAVE.wavelength))
    far = 12.0 + away * WAVE.range_resolution
    bodies = [target("strong", 12.0, strong, 10.0), target("weak", far, weak, 2.0)]
    result = rc.simulate(rc.Scene(bodies=bodies, radar=radar, model={"max_bounces": 1}))
    found, reasons = result.detections, result.provenance
    assert len(found.range) == 2
    for k in range(2):
        own, place = ("strong", 12.0) if abs(np.degrees(found.azimuth[k]) - strong) < 1.0 else ("weak", far)
        assert reasons[k].bodies == own and reasons[k].true_range == pytest.approx(place, abs=0.01)
        assert abs(10.0 * np.log10(reasons[k].predicted / found.power[k])) < 1.5
        told = rc.explain(result, detection=k + 1)
        assert told.beam and told.paths.chains[told.paths.chain[0]][0].startswith(own)
        assert abs(told.paths.wave.sum()) ** 2 == pytest.approx(reasons[k].predicted, rel=1e-3)
