"""Results on disk: result.nc (netCDF-4), detections.csv, summary.json."""

from __future__ import annotations

import dataclasses
import json
import math
import platform
from importlib.metadata import PackageNotFoundError, version
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from raychan.radar.declared import check_type
from raychan.radar.waveform import Waveform
from raychan.run.files.contents import Contents
from raychan.run.files.netcdf import GROUPS, as_netcdf, read_record
from raychan.run.files.output import StoreError, csv_bytes, staging
from raychan.run.ledger_entry import entry_of
from raychan.run.receiver import aperture_of
from raychan.run.result import LABELS, Contribution, Explanation, Receiver, Result
from raychan.scalars import shown
from raychan.units import dbm

FORMAT = 3
_HDF5 = b"\x89HDF\r\n\x1a\n"  # how a file of HDF5, and so of netCDF-4, begins
_READS = (2, FORMAT)  # format 2 has delay and range rate of paths instead of length and its rate
PICTURES = ("scene.png", "profile.png", "rdmap.png")
ARRAY_PICTURES = ("range_azimuth.png", "beams.png")
"""Drawn where an array measures azimuth."""
_FRAMES = tuple("frame_" + digits * "[0-9]" for digits in (4, 5))
CONTENTS = Contents(
    names=("result.nc", "detections.csv", "summary.json", *PICTURES, *ARRAY_PICTURES, *(f"{x}/" for x in _FRAMES)),
    signs=("result.nc", "summary.json", *(f"{x}/result.nc" for x in _FRAMES)),
    begins={"summary.json": b'{"scene":'},
)
"""What `raychan run` writes into its folder; a sequence has a folder of the same for each frame."""
_ALLOWED = "a directory that `raychan run` or rc.save_result wrote, or the result.nc in it"
_CHANGED = "# changed: "  # how a scene notes overridden keys below its text
COLUMNS = (
    "range_m",
    "range_rate_mps",
    "speed_mps",
    "azimuth_deg",
    "snr_db",
    "power_dbm",
    "error_db",
    "converged",
    "folded",
    "true_range_m",
    "true_range_rate_mps",
    "label",
    "bodies",
)
_JSON = ("receiver", "provenance", "timings", "ledger", "stats", "warnings")


def save_result(result: Result, directory: str | Path) -> None:
    """Write a result into a directory as `raychan run` does, without pictures; `load_result` reads it.

    Args: directory, made where it is missing; an earlier result there is replaced, pictures and frames included, all at
    once, and other files stay.
    Raises: StoreError for errors of the disk, for a file in its place, or where files of the same names stand in a
    directory without results; ValueError for another type, no name, or one with a zero byte.
    """
    check_type("result", result, Result)
    check_type("directory", directory, str, PathLike)
    if "\0" in str(directory) or not str(directory):
        raise ValueError(f"directory = {shown(str(directory))}: a name is wanted, without a zero byte")
    with staging(directory, CONTENTS) as stage:
        write_result(result, stage)


def write_result(result: Result, directory: Path) -> None:
    """Write result.nc, detections.csv and summary.json into an existing directory.

    Use inside `output_files.staging`, which makes all files appear at once. Raises: StoreError for errors of the disk.
    """
    try:
        (directory / "result.nc").write_bytes(as_netcdf(result, _attrs(result)))
        (directory / "detections.csv").write_bytes(csv_bytes([columns_of(result), *rows(result)]))
        (directory / "summary.json").write_text(json.dumps(summary(result), indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        raise StoreError(f"{directory}: cannot write the result: {error.strerror or error}") from error


def load_result(path: str | Path) -> Result:
    """Return the Result stored in a directory or a result.nc; its scene is read again from the text if that can be.

    Raises: StoreError if there is no such file or it is not one of ours, ValueError for no path.
    """
    import xarray as xr

    check_type("path", path, str, PathLike)
    path = Path(path)
    file = path / "result.nc" if path.is_dir() else path
    if not file.is_file():
        problem = "a directory without a result.nc" if path.is_dir() else "no such file or directory"
        raise StoreError(f"{path}: {problem}; allowed: {_ALLOWED}")
    try:
        with file.open("rb") as stream:
            if not stream.read(len(_HDF5)) == _HDF5:
                raise StoreError(f"{file}: cannot be read: it is not a raychan result; allowed: {_ALLOWED}")
        with xr.open_dataset(file, engine="h5netcdf") as root:
            attrs = dict(root.attrs)
        if int(attrs.get("format", 0)) not in _READS:
            raise StoreError(f"{file}: not a result of this version of raychan")
        records = {name: read_record(file, name, kind) for name, kind in GROUPS.items()}
    except (OSError, ValueError, KeyError, TypeError) as error:
        if isinstance(error, StoreError):
            raise
        why = getattr(error, "strerror", None) or error
        raise StoreError(f"{file}: cannot be read as a raychan result: {why}; allowed: {_ALLOWED}") from error
    held = {name: json.loads(attrs[name]) for name in _JSON}
    receiver = held["receiver"] | {"waveform": Waveform(**held["receiver"]["waveform"])}
    receiver["background"] = tuple(receiver["background"])
    text, where = str(attrs["scene"]), str(attrs["scene_path"])
    return Result(
        **records,
        provenance=tuple(_explanation(e) for e in held["provenance"]),
        receiver=Receiver(**receiver),
        seed=int(attrs["seed"]),
        timings=held["timings"],
        ledger={name: entry_of(e) for name, e in held["ledger"].items()},
        stats=held["stats"],
        warnings=tuple(held["warnings"]),
        scene=_scene(text, where),
        text=text,
        path=where,
    )


def columns_of(result: Result) -> tuple[str, ...]:
    """Return the names of the columns of detections.csv: COLUMNS, and elevation_deg where an array measures it."""
    at = COLUMNS.index("azimuth_deg") + 1
    return (*COLUMNS[:at], "elevation_deg", *COLUMNS[at:]) if elevated(result) else COLUMNS


def elevated(result: Result) -> bool:
    """Return whether the receivers of a result measure elevation."""
    radar = result.scene.radar if result.scene is not None else None
    return bool(np.isfinite(result.detections.elevation).any()) if radar is None else aperture_of(radar).scans[1]


def rows(result: Result) -> list[tuple[str, ...]]:
    """Return the detections as text, a tuple of `columns_of(result)` each.

    Empty is what is unknown: an azimuth that no array gives, the error of a detection that is not converged, the true
    place of noise.
    """
    d, elevation = result.detections, elevated(result)
    return [
        (
            f"{d.range[i]:.4f}",
            f"{d.rate[i]:.4f}",
            f"{d.speed[i]:.4f}",
            _known(math.degrees(d.azimuth[i]), 3),
            *([_known(math.degrees(d.elevation[i]), 3)] if elevation else []),
            f"{d.snr[i]:.2f}",
            f"{dbm(d.power[i]):.2f}",
            _known(d.error_db[i], 2),
            _word(d.converged[i]),
            _word(d.folded[i]),
            _known(d.true_range[i], 4),
            _known(d.true_rate[i], 4),
            why.label,
            why.bodies,
        )
        for i, why in enumerate(result.provenance)
    ]


def _known(value: float, digits: int) -> str:
    return "" if math.isnan(value) else f"{value:.{digits}f}"


def _word(value: bool) -> str:
    return "true" if value else "false"


def summary(result: Result) -> dict[str, Any]:
    """Return what summary.json holds: counts, timings, tolerance reached, warnings, unmodelled effects."""
    return {
        "scene": result.path,
        "seed": result.seed,
        "paths": len(result.paths.delay),
        "detections": len(result.detections.range),
        "labels": {x: sum(e.label == x for e in result.provenance) for x in LABELS},
        **_plain(result.stats),
        "timings_s": {k: round(v, 4) for k, v in result.timings.items()},
        "warnings": list(result.warnings),
        "left_out": _plain(result.ledger),
        "versions": versions(),
    }


def versions() -> dict[str, str]:
    """Return the versions of Python and of the libraries that shape a result."""
    found = {"python": platform.python_version()}
    for name in ("raychan", "numpy", "scipy", "numba", "embreex", "finufft", "trimesh"):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "unknown"
    return found


def _attrs(result: Result) -> dict[str, Any]:
    """Return what goes beside the records: the scene, how it was run and what was told."""
    attrs = {
        "format": FORMAT,
        "source": f"raychan {versions()['raychan']}, ray-traced radar channel simulation",
        "comment": "SI; x forward, y left, z up; exp(+jwt); range rate positive = receding; NAME_re + j NAME_im",
        "seed": result.seed,
        "scene": result.text or _written(result.scene),
        "scene_path": result.path,
        "versions": json.dumps(versions()),
    }
    return attrs | {name: json.dumps(_plain(getattr(result, name))) for name in _JSON}


def _written(scene: Any) -> str:
    """Return a scene made in Python as the text of a file; empty where no file can hold it."""
    try:
        return "" if scene is None else str(scene.to_toml())
    except ValueError:
        return ""


def _plain(value: Any) -> Any:
    """Return a value as JSON can hold it."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: _plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, dict):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else ("inf" if value > 0 else "-inf")
    return value if isinstance(value, bool | int | float | str) or value is None else str(value)


def _explanation(held: dict[str, Any]) -> Explanation:
    parts = tuple(Contribution(**(c | {"chain": tuple(c["chain"])})) for c in held["contributions"])
    numbers = {name: math.nan for name, value in held.items() if value is None}  # as JSON has it
    ways: dict[str, Any] = {name: tuple(held[name]) for name in ("departure", "arrival", "drift") if name in held}
    return Explanation(**(held | numbers | ways | {"contributions": parts}))


def _scene(text: str, where: str) -> Any:
    if not text:
        return None
    from raychan.world.errors import SceneError
    from raychan.world.scene import Scene
    from raychan.world.scene_files.overrides import LATER

    try:
        changes = [line.removeprefix(_CHANGED) for line in text.splitlines() if line.startswith(_CHANGED)]
        later = sum(float(line.removeprefix(LATER)) for line in text.splitlines() if line.startswith(LATER))
        return Scene.from_text(text, where or None).override(changes).at(later)
    except (SceneError, OSError):
        return None
