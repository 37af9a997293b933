"""The records of a result as netCDF-4 by the CF conventions, and back.

Each record is a group, each column a variable with its unit; range and range rate are coordinates. A complex column is
two real ones, `_re` and `_im`, so that xarray, MATLAB's h5read and any HDF5 reader open it alike. Label, bodies and
stated error of each detection are variables beside its columns, the beams of an array's detections a group.
"""

from __future__ import annotations

import dataclasses
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.processing.range_azimuth import RangeAzimuth
from raychan.radar.dual_paths import DualPaths
from raychan.records import Cube, MapError, Paths, Profile, RangeDoppler
from raychan.run.explanation.directions import angles_in
from raychan.run.result import ExplainedDetections, Result
from raychan.trajectories import Trajectories
from raychan.units import C0, dbm

CONVENTIONS = "CF-1.11"
GROUPS: dict[str, Any] = {
    "paths": Paths,
    "profile": Profile,
    "cube": Cube,
    "rdmap": RangeDoppler,
    "error": MapError,
    "detections": ExplainedDetections,
}
_AXES = {
    "a": "antenna",
    "c": "chirp",
    "s": "sample",
    "v": "range_rate",
    "r": "range",
    "p": "peak",
    "d": "vertex",
    "b": "azimuth",
    "e": "end",
}
_ROWS = {"paths": "path", "detections": "detection"}
_CALLED = {"rate": "range_rate", "true_rate": "true_range_rate"}
"""Columns with another name in the file than in their record."""
_FORMER = {"length": ("delay", C0), "length_rate": ("range_rate", 2.0)}
"""Columns that files of format 2 have instead, and the factor on them."""
_ADDED = {"elevation": np.nan, "ambiguous": False}
"""Columns that older files of format 3 do not have, and what stands for them."""
_NOT_STORED = ("spare", "slots")
"""Of a map: what the detector alone asks for."""
_OF_ARRAYS = ("aside", "drift", "instant")
"""Columns of paths that ask where the elements of an array stand."""
_BEAMS = "beams"
"""Group of the beams of an array's detections: beside these, so that a table of detections has a row each."""
_UNITS = {"sqrt(W)": "V"}
"""Units as UDUNITS writes them, for waves at 1 ohm. UDUNITS has no decibel: it is written dB."""
_TITLES = {
    "rate": "range rate, receding positive",
    "speed": "speed over ground",
    "power": "received power",
    "snr": "signal-to-noise ratio in dB",
    "error_db": "stated error in dB",
    "length": "length of the path, from transmitter to receiver",
    "length_rate": "rate of the length, growing positive",
    "amplitude": "complex gain of the path",
    "samples": "dechirped voltage wave at 1 ohm",
    "spectrum": "range-Doppler spectrum, voltage wave at 1 ohm",
    "tx": "position of the transmitter",
    "rx": "position of the receiver",
}
_STANDARD = {"rate": "radial_velocity_of_scatterers_away_from_instrument"}
_KINDS = ("none", "reflect", "transmit", "scatter", "point_target", "diffract")
_COMMENTS = {
    "length": "the whole path; range is half of it, delay is length / c",
    "length_rate": "of the whole path; range rate is half of it",
    "vertices": "places of the interactions, without tx and rx; unused slots repeat rx",
    "body": "row of the attribute body_names; -1 in unused slots",
    "part": "row of the attribute part_names; -1 in unused slots",
    "aside": "image of a corner or point of a footprint minus that of its centre, as transmitter and receiver see it",
}
_SCALARS = {"noise": "W", "noise_power": "W", "range_resolution": "m", "rate_resolution": "m s-1"} | {
    "unambiguous_range": "m",
    "unambiguous_rate": "m s-1",
}
_CELL = ("rate_cell", "range_cell")
_TOLD = ("label", "bodies", "error_db", "converged", "folded")


def as_netcdf(result: Result, attrs: dict[str, Any]) -> memoryview:
    """Return a result as the bytes of a netCDF-4 file, made in memory; `attrs` go beside those of the conventions.

    HDF5 must not meet a full disk: it crashes when it cannot close what it could not write.
    """
    import h5netcdf
    import h5py

    made = io.BytesIO()
    with h5py.File(made, "w") as held, h5netcdf.File(held, "w") as file:
        file.attrs.update({"Conventions": CONVENTIONS, "title": "raychan result"} | attrs)
        for name in GROUPS:
            # Most slots of paths are unused and compress well; samples are noise and do not.
            packed = name == "paths" and len(result.paths.delay) > 0
            _write(file.create_group(name), name, result, {"compression": 1, "shuffle": True} if packed else {})
        if result.detections.beam.shape[1]:
            of = next(f for f in columns(ExplainedDetections) if f.name == "beam")
            _column(file.create_group(_BEAMS), "detections", of, result.detections.beam, {})
        angles = angles_in(result)
        if angles is not None:
            _directions(file.create_group("range_azimuth"), angles)
    return made.getbuffer()


def read_record(file: Path, group: str, kind: Any) -> Any:
    """Return the record of a group of a file. Raises: OSError, KeyError, ValueError for a file of another origin."""
    import xarray as xr

    with xr.open_dataset(file, engine="h5netcdf", group=group, decode_cf=False) as data:
        values: dict[str, Any] = {}
        if kind is Paths and "cross_re" in data:
            kind = DualPaths
        for f in columns(kind):
            name = _CALLED.get(f.name, f.name)
            if name in _OF_ARRAYS and name not in data:
                continue  # a radar without an array, or an older file
            if name not in data and issubclass(kind, Paths) and name in _FORMER:
                former, factor = _FORMER[name]
                values[f.name] = factor * data[former].values
            elif f.name == "beam":
                values[f.name] = _beams(file, data.sizes[_ROWS[group]])
            elif f.name in _ADDED and name not in data:
                values[f.name] = np.full(data.sizes[_ROWS[group]], _ADDED[f.name], f.metadata["dtype"])
            elif f.name == "cell" and "cell" not in data:
                values[f.name] = np.stack([data[axis].values for axis in _CELL], axis=1)
            elif "axes" not in f.metadata:
                told = data.attrs[f.name]
                values[f.name] = tuple(json.loads(told)) if isinstance(told, str) else float(told)
            elif f.metadata["dtype"].kind == "c":
                real = data[f"{name}_re"].values
                value = np.empty(real.shape, f.metadata["dtype"])
                value.real, value.imag = real, data[f"{name}_im"].values
                values[f.name] = value
            else:
                values[f.name] = data[name].values.astype(f.metadata["dtype"], copy=False)
    return kind.of(**values) if issubclass(kind, Paths) else kind(**values)


def _beams(file: Path, count: int) -> NDArray[np.complex128]:
    """Return the beams (count, a) of detections; no columns without an array, and of older files."""
    import h5netcdf

    with h5netcdf.File(file, "r") as held:
        if _BEAMS not in held.groups:
            return np.zeros((count, 0), np.complex128)
        return np.asarray(held[_BEAMS]["beam_re"][:] + 1j * held[_BEAMS]["beam_im"][:])


def columns(kind: Any) -> list[dataclasses.Field[Any]]:
    """Return the columns of a record; in a file all columns of paths have a row for each path."""
    if not issubclass(kind, Paths):
        return list(dataclasses.fields(kind))
    own = [f for f in dataclasses.fields(kind) if f.name not in ("trajectory", "trajectories")]
    return [*own, *dataclasses.fields(Trajectories)]


def _write(group: Any, name: str, result: Result, packed: dict[str, Any]) -> None:
    """Write one record with its coordinates and attributes."""
    record = getattr(result, name)
    wave = result.receiver.waveform
    for f in columns(type(record)):
        if f.name in _NOT_STORED:
            continue
        value = record.trajectories.vertices[record.trajectory] if f.name == "vertices" else getattr(record, f.name)
        if "axes" in f.metadata:
            if f.name == "beam" or (f.name in _OF_ARRAYS and not _held(record, f.name).size):
                continue
            if f.name == "cell":  # a column each, so that a table of detections has a row each
                for k, axis in enumerate(_CELL):
                    about = {"units": "1", "long_name": f"index of the peak along {axis.split('_')[0]}"}
                    _variable(group, axis, (_ROWS[name],), value[:, k], about, packed)
                continue
            _column(group, name, f, value, packed)
        else:
            group.attrs[f.name] = json.dumps(value) if isinstance(value, tuple) else value
            if f.name in _SCALARS:
                group.attrs[f"{f.name}_units"] = _SCALARS[f.name]
    if name == "error":
        for f in columns(RangeDoppler):
            if f.name in ("range", "rate"):
                _column(group, name, f, getattr(result.rdmap, f.name), {})
    if name == "cube":
        times = (
            # The receiver's waveform is that of a virtual channel; samples are those of all chirps as sent.
            ("chirp", wave.repetition * (wave.n_chirps / len(group.dimensions["chirp"])), "start of the ramp"),
            ("sample", 1.0 / wave.sample_rate, "time in the ramp"),
        )
        for axis, step, title in times:
            time = step * np.arange(len(group.dimensions[axis]))
            _variable(group, f"{axis}_time", (axis,), time, {"units": "s", "long_name": title}, {})
        for part in ("re", "im"):
            group.variables[f"samples_{part}"].attrs["coordinates"] = "chirp_time sample_time"
    if name in ("profile", "rdmap", "detections"):
        _decibels(group, record)
    if name == "detections":
        _told(group, result)


def _directions(group: Any, angles: RangeAzimuth) -> None:
    """Write the range-azimuth map, which is made again from the range-Doppler map when a result is read."""
    for f in columns(RangeAzimuth):
        if "axes" in f.metadata:
            _column(group, "range_azimuth", f, getattr(angles, f.name), {})
    group.attrs.update({"noise": angles.noise, "noise_units": "W"})
    _decibels(group, angles)


def _column(group: Any, name: str, f: dataclasses.Field[Any], value: Any, packed: dict[str, Any]) -> None:
    """Write a column of a record: a complex one as two, booleans as 0 and 1."""
    axes = [_ROWS[name] if a in "nw" else _AXES.get(a) or _fixed(f.name, a) for a in f.metadata["axes"]]
    title = _TITLES.get(f.name, f.name.replace("_", " "))
    if name == "error" and f.name == "power":
        title = "stated error of the received power"
    unit = f.metadata["unit"]
    about = {"units": _UNITS.get(unit, unit.replace("/", " ").replace("m s", "m s-1")), "long_name": title}
    if f.metadata["doc"]:
        about["comment"] = f.metadata["doc"]
    if f.name == "kind":
        about["flag_values"] = np.arange(len(_KINDS), dtype=np.int8)
        about["flag_meanings"] = " ".join(_KINDS)
    about |= {"comment": _COMMENTS[f.name]} if f.name in _COMMENTS else {}
    if f.name in _STANDARD:
        about["standard_name"] = _STANDARD[f.name]
    if not f.metadata["finite"]:
        about["_FillValue"] = np.asarray(value).dtype.type(np.nan)
    if np.iscomplexobj(value):
        for part, half in (("real", value.real), ("imag", value.imag)):
            said = about | {"long_name": f"{title}, {part}{'inary' if part == 'imag' else ''} part"}
            _variable(group, f"{f.name}_{part[:2]}", axes, half, said, packed)
    else:
        _variable(group, _CALLED.get(f.name, f.name), axes, value, about, packed)


def _held(record: Paths, name: str) -> NDArray[Any]:
    """Return what tells whether a column that asks where elements stand is written: where nothing drifts, no instant is
    asked for."""
    return np.asarray(getattr(record, "drift" if name == "instant" else name))


def _fixed(column: str, size: str) -> str:
    """Return the name of an axis of a given length."""
    return "xyz" if size == "3" else f"{column}_axis"


def _decibels(group: Any, record: Any) -> None:
    """Write the power also in dBm, for plots; zero power is NaN."""
    level = np.full(record.power.shape, np.nan, np.float32)
    some = record.power > 0.0
    level[some] = dbm(record.power[some])
    about = {"units": "dBm", "long_name": "received power", "_FillValue": np.float32(np.nan)}
    _variable(group, "power_dbm", group.variables["power"].dimensions, level, about, {})


def _told(group: Any, result: Result) -> None:
    """Write label, bodies and error of each detection, unless the record has them as columns."""
    for name in (n for n in _TOLD if n not in group.variables):
        if all(hasattr(why, name) for why in result.provenance):
            values = np.array([getattr(why, name) for why in result.provenance])
            about: dict[str, Any] = {"long_name": _TITLES.get(name, name)}
            if name in ("label", "bodies"):
                values = values.astype(object)
            else:
                values = values.astype(bool if name in ("converged", "folded") else float)
            if name == "error_db":
                about |= {"units": "dB", "_FillValue": np.nan}
            _variable(group, name, ("detection",), values, about, {})


def _variable(
    group: Any, name: str, axes: Any, value: NDArray[Any], about: dict[str, Any], packed: dict[str, Any]
) -> None:
    import h5py

    value = np.asarray(value)
    for axis, size in zip(axes, value.shape, strict=True):
        if axis not in group.dimensions:
            group.dimensions[axis] = size
    dtype: Any = value.dtype
    if dtype.kind == "b":
        about = {k: v for k, v in about.items() if k != "units"} | {"dtype": "bool"}
        about |= {"flag_values": np.array([0, 1], np.int8), "flag_meanings": "no yes"}
        value, dtype = value.astype(np.int8), np.dtype(np.int8)
    elif dtype.kind == "O":
        dtype, packed = h5py.string_dtype(), {}
    fill = about.pop("_FillValue", None)
    made = group.create_variable(name, tuple(axes), dtype=dtype, data=value, fillvalue=fill, **packed)
    made.attrs.update(about)
