"""A scene written down: a scene's objects as the tables of a scene file, and these as TOML."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from raychan.units import dbm, watt
from raychan.world.limbs import wholes
from raychan.world.material import Material, material, names
from raychan.world.scene_files import bundled
from raychan.world.scene_files.errors import checked
from raychan.world.scene_files.schema import RadarTable, SceneFile

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from raychan.radar.antenna import Antenna
    from raychan.radar.radar import Radar
    from raychan.radar.waveform import Waveform
    from raychan.world.body import Body
    from raychan.world.scene import Scene

_BODY = (
    "shape", "unit", "up", "forward", "role", "rcs_dbsm", "swerling", "scale", "crease_deg",
    "turn_rate_dps", "params",
)  # fmt: skip
_ANGLES = ("yaw_deg", "pitch_deg", "roll_deg")
_BARE = re.compile(r"[A-Za-z0-9_-]+")


def toml_of(scene: Scene) -> str:
    """Return a scene as TOML, with meshes and antennas from files by their whole path.

    Raises: ValueError for what no file can hold: a mesh from memory, an antenna of a class of its own.
    """
    materials = dict(scene.materials)
    data: dict[str, Any] = {
        "scene": {"title": scene.title},
        "processing": {k: v for k, v in vars(scene.processing).items() if v is not None},
        "model": scene.model.model_dump(),
        "bodies": [_body_table(body, materials, scene.material_frequency) for body in wholes(scene.bodies)],
    }
    if scene.material_frequency == scene.frequency:  # given, or of no radar
        data["scene"]["frequency_ghz"] = figure(scene.frequency / 1e9, scene.frequency, _giga)
    if scene.radar_table is not None:
        if scene.is_radar_object and not _antennas(scene.radar):
            raise ValueError("antennas of a class of their own, from files, or of two polarisations cannot be written")
        data["radar"] = with_files(scene.radar_table.model_dump(exclude_defaults=True), scene.folder)
    from raychan.world.scene_files.surroundings_text import surroundings_tables

    data |= surroundings_tables(scene)
    data["materials"] = {name: _material_table(m) for name, m in materials.items()}
    tables = checked(SceneFile, data, scene.path)
    return "\n".join(_lines(tables.model_dump(exclude_defaults=True))).lstrip() + "\n"


def radar_table_of(radar: Radar) -> RadarTable:
    """Return the table that says what a radar object is; its antennas where they have a table.

    Raises: SceneError for a value beyond the limits of scene files.
    """
    from raychan.world.scene_files.surroundings_text import impairments_table

    return checked(  # type: ignore[no-any-return]
        RadarTable,
        {
            "position": radar.position.tolist(),
            **{name: float(getattr(radar, name)) for name in ("yaw_deg", "pitch_deg", "roll_deg")},
            "velocity_mps": radar.velocity.tolist(),
            "power_dbm": figure(float(dbm(radar.power)), radar.power, lambda x: float(watt(x))),
            "noise_figure_db": float(radar.noise_figure_db),
            "noise_temperature_k": float(radar.noise_temperature_k),
            "noise": radar.noise,
            **_antennas(radar),
            **{f"{name}_mm": _millimetres(getattr(radar, name)) for name in ("elements", "tx_elements")},
            "multiplexing": radar.multiplexing,
            "ddm_slots": radar.ddm_slots,
            "rx_polarization": radar.rx_polarization,
            **_elsewhere(radar),
            "waveform": _waveform_table(radar.waveform),
            "impairments": impairments_table(radar.impairments),
        },
    )


def _giga(x: float) -> float:
    return x * 1e9


def _mega(x: float) -> float:
    return x * 1e6


def _milli(x: float) -> float:
    return x * 1e-3


def _micro(x: float) -> float:
    return x / 1e6


def figure(guess: float, value: float, read: Callable[[float], float]) -> float:
    """Return the shortest number near a guess that reads as a value, or the guess where rounding leaves none."""
    for digits in (6, 9, 12, 15):
        short = float(f"{guess:.{digits}g}")
        if read(short) == value:
            return short
    near = (guess, math.nextafter(guess, math.inf), math.nextafter(guess, -math.inf))
    return next((x for x in near if read(x) == value), guess)


def _elsewhere(radar: Radar) -> dict[str, Any]:
    if radar.rx_position is None:
        return {}
    speed = None if radar.rx_velocity is None else radar.rx_velocity.tolist()
    return {"rx_position": radar.rx_position.tolist(), "rx_velocity_mps": speed, "rx_yaw_deg": radar.rx_yaw_deg}


def _millimetres(places: NDArray[np.float64]) -> list[list[float]]:
    return [[figure(1e3 * x, x, _milli) for x in row] for row in places.tolist()]


def _waveform_table(wave: Waveform) -> dict[str, Any]:
    table: dict[str, Any] = {
        "carrier_ghz": figure(wave.carrier / 1e9, wave.carrier, _giga),
        "bandwidth_mhz": figure(wave.bandwidth / 1e6, wave.bandwidth, _mega),
        "chirp_us": figure(wave.chirp_duration * 1e6, wave.chirp_duration, _micro),
        "chirps": wave.n_chirps,
        "samples": wave.n_samples,
        "iq": wave.complex_sampling,
    }
    if wave.stagger:
        table["stagger_us"] = [figure(t * 1e6, t, _micro) for t in wave.stagger]
    elif wave.repetition != wave.chirp_duration:
        table["repetition_us"] = figure(wave.repetition * 1e6, wave.repetition, _micro)
    return table


def _antennas(radar: Radar) -> dict[str, Any]:
    """Return the keys of a radar's antennas; none where no table describes them."""
    given = {name: getattr(radar, name) for name in ("antenna", "tx_antenna", "rx_antenna")}
    found = {name: _antenna_table(antenna) for name, antenna in given.items() if antenna is not None}
    waves = {wave for _, wave in found.values()}
    if len(waves) > 1 or any(not table for table, _ in found.values()):
        return {}
    return {name: table for name, (table, _) in found.items()} | {"polarization": waves.pop()}


def _antenna_table(antenna: Antenna) -> tuple[dict[str, Any], str]:
    """Return the table of an antenna and its polarisation; an empty table where there is none that describes it."""
    from raychan.radar.antenna import ArrayAntenna, CosineAntenna, IsotropicAntenna

    if isinstance(antenna, IsotropicAntenna):
        table: dict[str, Any] = {"kind": "isotropic", "front": antenna.front}
    elif isinstance(antenna, CosineAntenna):
        table = {"kind": "cosine", "hpbw_h_deg": antenna.hpbw_h_deg, "hpbw_v_deg": antenna.hpbw_v_deg}
    elif isinstance(antenna, ArrayAntenna):
        names = ("ny", "nz", "spacing_y", "spacing_z", "taper_y", "taper_z")
        element, wave = _antenna_table(antenna.element)
        table = {"kind": "array", "element": element, **{name: getattr(antenna, name) for name in names}}
        return (table | _loss(antenna.loss_db) if element else {}), wave
    else:
        return {}, ""
    return table | _loss(antenna.loss_db), antenna.polarization


def _loss(loss_db: float) -> dict[str, float]:
    return {"loss_db": loss_db} if loss_db else {}


def with_files(table: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Return a radar's table with the files of its antennas by their whole path."""
    for key in ("antenna", "tx_antenna", "rx_antenna"):
        given = table.get(key)
        if isinstance(given, str):
            table[key] = bundled.found(given, folder).resolve().as_posix()
        elif given and given.get("file"):
            given["file"] = (folder / given["file"]).resolve().as_posix()
    return table


def _body_table(body: Body, materials: dict[str, Material], frequency: float) -> dict[str, Any]:
    """Return the table of a body; materials that it brings as objects are added to `materials`."""
    table = {name: value for name in _BODY if (value := getattr(body, name)) is not None}
    table |= {"name": body.name, **{name: float(getattr(body, name)) for name in _ANGLES}}
    vectors = {"position": body.position, "velocity_mps": body.velocity, "spin_dps": body.spin_dps}
    table |= {name: [float(x) for x in value] for name, value in vectors.items()}
    if body.rcs_point is not None:
        table["rcs_point"] = [float(x) for x in body.rcs_point]
    if body.mesh is not None:
        if not isinstance(body.mesh, str | Path):
            raise ValueError(f"body '{body.name}': its mesh is in memory; save it and give the file's name")
        table["mesh"] = Path(body.mesh).resolve().as_posix()
    if body.material is not None:
        table["material"] = _named(body.material, materials, frequency)
    table["materials"] = {part: _named(m, materials, frequency) for part, m in body.materials.items()}
    return table


def _named(given: str | Material, materials: dict[str, Material], frequency: float) -> str:
    """Return the name of a material; one given as an object gets a name of its own unless it has one already."""
    if isinstance(given, str):
        return given
    known = {m: name for name, m in materials.items()}
    if given in known:
        return known[given]
    if given.name in names() and material(given.name, frequency) == given:
        return given.name
    own = given.name if given.name and given.name not in (*names(), *materials) else f"material_{len(materials) + 1}"
    materials[own] = given
    return own


def _material_table(m: Material) -> dict[str, Any]:
    own = {} if m.diffuse is None else {"diffuse": {k: v for k, v in asdict(m.diffuse).items() if v is not None}}
    if m.pec:
        return {"pec": True, "source": m.source} | own
    table: dict[str, Any] = {"eps_r": float(m.eps_r), "sigma": float(m.sigma), "source": m.source}
    table["roughness_mm"] = figure(1e3 * m.roughness, m.roughness, _milli)
    if m.thickness is not None:
        table["thickness_mm"] = figure(1e3 * m.thickness, m.thickness, _milli)
    return table | own


def _lines(table: Mapping[str, Any], path: str = "") -> Iterator[str]:
    """Yield the lines of TOML of a table: its values, then the tables in it.

    The parameters of a shape and the element of an array stay on one line.
    """
    inner = {k: v for k, v in table.items() if _is_table(k, v)}
    for key, value in table.items():
        if key not in inner:
            yield f"{_key(key)} = {_value(value)}"
    for key, value in inner.items():
        name = f"{path}{_key(key)}"
        for one in value if isinstance(value, list) else [value]:
            yield f"\n[[{name}]]" if isinstance(value, list) else f"\n[{name}]"
            yield from _lines(one, f"{name}.")


def _is_table(key: str, value: Any) -> bool:
    return (isinstance(value, dict) and key not in ("params", "element")) or key in ("bodies", "interferers")


def _key(key: str) -> str:
    return key if _BARE.fullmatch(key) else json.dumps(key)


def _value(value: Any) -> str:
    if isinstance(value, bool | str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(k)} = {_value(v)}" for k, v in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_value, value)) + "]"
    return repr(value)
