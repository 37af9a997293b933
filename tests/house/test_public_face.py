"""Every public name does what its documentation says, and type checkers know what it gives: no Any on the face."""

from __future__ import annotations

import doctest
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import assert_type

import numpy as np
import pytest
import trimesh
from mypy import api
from numpy.typing import NDArray

import raychan as rc
from raychan.columns import take
from raychan.processing.doa import Directions
from raychan.radar.pattern import gain_dbi
from raychan.records import Cube, Detections, Profile, RangeDoppler
from raychan.run.explain import CellExplanation
from raychan.run.rcs import Rcs
from raychan.run.sequence import Frame
from raychan.study.visibility import Visibility

ELSEWHERE = {"trace", "transfer", "synthesize", "range_doppler", "detect", "SceneRoutes", "StoreError"}
"""Public names whose examples stand in tests/run."""
ROOT = Path(__file__).resolve().parents[2]
FLAGS = (
    "--strict", "--follow-imports=silent", "--ignore-missing-imports", "--no-error-summary", "--config-file=",
    f"--cache-dir={ROOT / '.mypy_cache' / 'face'}",
)  # fmt: skip
"""As a user has them who has no settings of mypy."""


def street() -> rc.Scene:
    """Return a scene of objects."""
    return rc.Scene(
        bodies=[
            rc.Body(name="ground", shape="ground", material="asphalt"),
            rc.Body(name="wall", shape="plate", position=(9.0, 0.5, 1.0), material=rc.PEC, velocity=(-2.0, 0.0, 0.0)),
        ],
        radar=rc.Radar(
            rc.Waveform(carrier=77e9, bandwidth=300e6, chirp_duration=20e-6, n_chirps=32, n_samples=64),
            position=(0.0, 0.0, 0.6),
            antenna=rc.CosineAntenna(86.0, 60.0),
            velocity=(5.0, 0.0, 0.0),
            processing=rc.Processing(range_window="hamming", min_snr_db=15.0),
        ),
        model={"max_bounces": 2, "tolerance_db": 2.0},
    )


TABLES: dict[str, object] = {
    "radar": {
        "position": [0.0, 0.0, 0.6],
        "velocity_mps": [5.0, 0.0, 0.0],
        "antenna": {"kind": "cosine", "hpbw_h_deg": 86.0, "hpbw_v_deg": 60.0},
        "waveform": {"bandwidth_mhz": 300.0, "chirp_us": 20.0, "chirps": 32, "samples": 64},
    },
    "processing": {"range_window": "hamming", "min_snr_db": 15.0},
    "model": {"max_bounces": 2, "tolerance_db": 2.0},
    "bodies": [
        {"name": "ground", "shape": "ground", "material": "asphalt"},
        {
            "name": "wall", "shape": "plate", "position": [9.0, 0.5, 1.0], "material": "pec",
            "velocity_mps": [-2.0, 0.0, 0.0],
        },
    ],
}  # fmt: skip


@pytest.fixture(scope="module")
def result() -> rc.Result:
    return rc.simulate(street(), seed=3)


def test_types_of_all_public_names_are_known_to_a_strict_checker(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MYPYPATH", str(ROOT))
    told, trouble, _ = api.run([*FLAGS, __file__])
    assert (told, trouble) == ("", "")


@pytest.mark.parametrize("home", sorted({getattr(rc, n).__module__ for n in rc.__all__ if n != "__version__"}))
def test_examples_in_docstrings_run(home: str) -> None:
    assert doctest.testmod(import_module(home)).failed == 0


def public_annotations(name: str) -> Iterator[tuple[str, str]]:
    """Yield what a public name takes, gives and holds, as it is written, with where that stands."""
    thing = getattr(rc, name)
    members = {name: thing} if not isinstance(thing, type) else {f"{name}.{k}": v for k, v in vars(thing).items()}
    for where, member in members.items():
        member = member.fget if isinstance(member, property) else getattr(member, "__func__", member)
        if not where.split(".")[-1].startswith("_") or where.endswith("__init__"):
            yield from ((f"{where}({k})", str(v)) for k, v in getattr(member, "__annotations__", {}).items())
    if isinstance(thing, type):
        yield from ((f"{name}.{k}", str(v)) for k, v in vars(thing).get("__annotations__", {}).items())


@pytest.mark.parametrize("name", [n for n in rc.__all__ if n != "__version__"])
def test_nothing_on_the_public_face_is_of_any_type(name: str) -> None:
    assert [where for where, written in public_annotations(name) if re.search(r"\bAny\b", written)] == []
    assert (getattr(rc, name).__doc__ or "").strip()


def test_arrays_of_a_mimo_radar_are_made_by_name() -> None:
    wave = rc.Waveform(carrier=77e9, bandwidth=300e6, chirp_duration=20e-6, n_chirps=48, n_samples=64)
    radar = rc.Radar(wave, **rc.mimo_array(3, 8, 0.5 * wave.wavelength), multiplexing="tdm")
    line = assert_type(rc.uniform_array(24, 0.5 * wave.wavelength), NDArray[np.float64])
    np.testing.assert_allclose(radar.virtual_elements, line, atol=1e-15)


def test_every_public_name_is_used_here() -> None:
    text = Path(__file__).read_text(encoding="utf-8")
    assert [name for name in rc.__all__ if f"rc.{name}" not in text and name not in ELSEWHERE] == []
    assert_type(rc.__version__, str)


def test_objects_tables_and_toml_are_one_scene(result: rc.Result, tmp_path: Path) -> None:
    scene = street()
    file = tmp_path / "street.toml"
    file.write_text(scene.to_toml(), encoding="utf-8")
    assert_type(scene.to_toml(), str)
    for same in (rc.Scene.from_dict(TABLES), rc.Scene.load(file)):
        again = rc.simulate(same, seed=3)
        assert again.cube.samples.tobytes() == result.cube.samples.tobytes()
        assert again.rdmap.power.tobytes() == result.rdmap.power.tobytes()
        assert again.detections.snr.tobytes() == result.detections.snr.tobytes()
    assert rc.Scene.load(file).to_toml() == scene.to_toml()
    assert len(result.detections.range) > 0


@pytest.mark.parametrize("name", ["urban", "living_street", "occluded_pedestrian"])
def test_a_scene_file_written_again_is_the_same_scene(name: str) -> None:
    scene = rc.Scene.load(name)
    again = rc.Scene.from_text(scene.to_toml())
    assert again.to_toml() == scene.to_toml()
    assert (again.processing, again.radar.power) == (scene.processing, scene.radar.power)
    assert again.facets().vertices.tobytes() == scene.facets().vertices.tobytes()


def test_what_no_file_can_hold_is_told() -> None:
    ball = rc.Body(name="ball", mesh=trimesh.creation.icosphere(1))
    with pytest.raises(ValueError, match="body 'ball': its mesh is in memory"):
        rc.Scene(bodies=[ball]).to_toml()
    measured = rc.Scene(radar=rc.Radar(rc.Waveform(77e9, 1e9, 20e-6), antenna=measured_antenna()))
    with pytest.raises(ValueError, match="cannot be written"):
        measured.to_toml()


def test_the_radar_object_is_held_to_the_limits_of_scene_files() -> None:
    wave = rc.Waveform(77e9, 1e9, 20e-6)
    with pytest.raises(rc.SceneError, match="power_dbm"):
        rc.Scene(radar=rc.Radar(wave, power=1e12))
    with pytest.raises(ValueError, match=r"Radar\.yaw_deg"):
        rc.Radar(wave, yaw_deg=float("nan"))
    with pytest.raises(ValueError, match=r"Processing\.pad"):
        rc.Processing(pad=(0, 2))


def test_scene_and_radar() -> None:
    scene = street()
    radar = assert_type(scene.radar, rc.Radar)
    assert_type(radar.position, NDArray[np.float64])
    assert_type(radar.processing, rc.Processing)
    assert_type(radar.waveform, rc.Waveform)
    assert_type(radar.tx, rc.Antenna)
    assert_type(scene.bodies, tuple[rc.Body, ...])
    assert radar.processing == scene.processing and radar.power == pytest.approx(15.8e-3, rel=1e-2)
    assert radar.waveform.repetition == radar.waveform.chirp_duration
    later = scene.at(0.1)
    assert later.radar.position == pytest.approx([0.5, 0.0, 0.6])
    assert assert_type(rc.Material(eps_r=5.24, sigma=1.38), rc.Material).thickness is None
    assert_type(rc.Material(eps_r=5.24, diffuse=rc.Diffuse("gamma", -15.0)).diffuse, rc.Diffuse | None)
    assert rc.PEC.pec


def test_impairments_air_and_interferers_of_a_scene() -> None:
    wave = rc.Waveform(77e9, 300e6, 20e-6, n_chirps=32, n_samples=64)
    bad = rc.Impairments(
        rc.ChirpError([[0.0, 0.0], [2e-5, 1e4]]), rc.PhaseNoise([[1e5, -90.0]]), rc.Converter(12, -20.0), iq_gain_db=0.1
    )
    other = rc.Interferer(rc.Radar(wave, (30.0, 0.0, 0.6), yaw_deg=180.0), start=1e-6, name="other")
    scene = rc.Scene(
        radar=rc.Radar(wave, impairments=bad), atmosphere=rc.Atmosphere(rain_mmh=10.0), interferers=[other]
    )
    assert assert_type(scene.radar.impairments, rc.Impairments) == bad
    assert assert_type(scene.interferers, tuple[rc.Interferer, ...]) == (other,)
    assert assert_type(scene.atmosphere, rc.Atmosphere | None) == rc.Atmosphere(rain_mmh=10.0)
    assert assert_type(scene.attenuation, float) > 0.0


def measured_antenna() -> rc.MeasuredAntenna:
    flat = np.zeros((3, 3))
    return rc.MeasuredAntenna(np.radians([-90.0, 0.0, 90.0]), np.radians([-90.0, 0.0, 90.0]), flat - 3.0, flat)


def test_antennas() -> None:
    kinds: list[rc.Antenna] = [
        rc.IsotropicAntenna(),
        rc.CosineAntenna(86.0, 60.0),
        rc.ArrayAntenna(4, 2, 0.5, 0.5),
        measured_antenna(),
        rc.load_antenna("antennas/array_2x2"),
    ]
    ahead = np.array([[1.0, 0.0, 0.0]])
    for antenna in kinds:
        assert isinstance(antenna, rc.Antenna)
        field = assert_type(antenna.field(ahead), NDArray[np.complex128])
        assert field.shape == (1, 2)
    assert gain_dbi(kinds[-1]) == pytest.approx(10.36, abs=0.01)


def test_a_result_has_typed_records(result: rc.Result) -> None:
    paths = assert_type(result.paths, rc.Paths)
    assert_type(result.cube, Cube)
    assert_type(result.rdmap, RangeDoppler)
    assert_type(result.profile, Profile)
    assert isinstance(result.detections, Detections)
    assert_type(result.detections.converged, NDArray[np.bool_])
    assert_type(result.scene, rc.Scene | None)
    assert_type(result.stats, dict[str, float])
    assert_type(paths.amplitude, NDArray[np.complex128])
    assert_type(paths.length, NDArray[np.float64])
    assert_type(paths.kind, NDArray[np.int8])
    assert_type(paths.bodies, NDArray[np.str_])
    assert_type(take(paths, [0]), rc.Paths)


def test_lengths_and_rates_mean_one_thing_in_simulated_and_specular_paths(result: rc.Result) -> None:
    scene = street()
    exact = assert_type(rc.specular_paths(scene, (0, 0, 0.6), (0, 0.0, 0.6001), max_bounces=2), rc.SpecularPaths)
    assert_type(exact.gain, NDArray[np.complex128])
    for paths in (result.paths, exact):
        assert_type(paths.length_rate, NDArray[np.float64])
        assert paths.range == pytest.approx(0.5 * paths.length)
        assert paths.range_rate == pytest.approx(0.5 * paths.length_rate)
        assert paths.delay == pytest.approx(paths.length / 299_792_458.0)
        stops = np.diff(paths.vertices.astype(float), axis=1)
        assert np.linalg.norm(stops, axis=2).sum(axis=1) == pytest.approx(paths.length, rel=0.02)
        assert paths.vertices.shape[1] == paths.kind.shape[1] + 2 == paths.bodies.shape[1] + 2
        assert not hasattr(result.paths, "rate")
    # The wall comes at 7 m/s relative to the radar; the ends of the specular paths are at rest, it comes at 2 m/s.
    wall = (exact.bodies == "wall").any(axis=1) & ((exact.kind == rc.InteractionType.REFLECT).sum(axis=1) == 1)
    assert exact.length_rate[wall] == pytest.approx(-4.0, abs=1e-3) and (exact.rate == exact.length_rate).all()
    lead = np.argmax(np.abs(result.paths.amplitude))
    assert result.paths.bodies[lead, 0] == "wall"
    assert result.paths.range_rate[lead] == pytest.approx(-7.0, abs=0.1)


def test_frames_and_visibility() -> None:
    each = assert_type(rc.frames(street(), 2, 0.05, seed=3), Iterator[Frame])
    first, second = each
    assert (first.time, second.time) == (0.0, 0.05)
    assert second.result.detections.range[0] == pytest.approx(first.result.detections.range[0] - 0.35, abs=0.1)
    seen = assert_type(rc.visibility(first.result, "wall"), Visibility)
    assert seen.occlusion.blocked == pytest.approx(0.0, abs=0.05)


def test_explain_and_a_result_saved_and_loaded(result: rc.Result, tmp_path: Path) -> None:
    assert_type(rc.save_result(result, tmp_path), None)
    back = assert_type(rc.load_result(tmp_path), rc.Result)
    assert back.paths.length.tobytes() == result.paths.length.tobytes()
    why = assert_type(rc.explain(back, detection=1), CellExplanation)
    assert "wall" in why.bodies


def test_directions_of_waves_at_an_array() -> None:
    line = np.arange(8)[:, None] * np.array([0.0, 2e-3, 0.0])
    wave = np.exp(2j * np.pi / 4e-3 * line[:, 1] * np.sin(0.3))
    found = assert_type(rc.doa(wave, line, 4e-3, "esprit", sources=1), Directions)
    assert_type(found.azimuth, NDArray[np.float64])
    assert found.azimuth == pytest.approx([0.3])
    radar = rc.Radar(rc.Waveform(74.9e9, 1e8, 20e-6, n_chirps=8, n_samples=16), elements=line)
    cube = Cube(np.tile(wave[:, None, None], (1, 8, 16)).astype(np.complex64), 0.0)
    angles = assert_type(rc.range_azimuth(cube, radar), rc.RangeAzimuth)
    assert angles.azimuth[angles.power[:, 0].argmax()] == pytest.approx(0.3, abs=0.02)


def test_rcs_of_a_mesh() -> None:
    found = assert_type(rc.rcs(trimesh.creation.icosphere(3, 0.2), 10e9, [0.0, 30.0]), Rcs)
    assert_type(found.sigma, NDArray[np.float64])
    assert found.sigma == pytest.approx(np.pi * 0.04, rel=0.1)


def test_a_stronger_target_is_detected_more_often() -> None:
    found = assert_type(rc.detection_probability([10.0, 15.0], rc.Detector(pfa=1e-6), 1), NDArray[np.float64])
    assert found[0] < found[1]


def test_a_spectrogram_shows_the_wall_at_its_range_rate() -> None:
    found = assert_type(rc.spectrogram(street(), 0.004, resolution=1.0), rc.Spectrogram)
    ridge = found.rate[found.power.argmax(axis=1)]
    # 7 m/s towards each other, and the ground at less.
    assert ridge == pytest.approx(np.full(len(ridge), -7.0), abs=0.3)
    assert_type(found.power, NDArray[np.float64])
