"""A spectrogram as netCDF-4 by the CF conventions."""

from __future__ import annotations

import io

import numpy as np

from raychan.run.files.netcdf import CONVENTIONS
from raychan.run.spectrogram import Spectrogram
from raychan.units import dbm, watt

_UNITS = {"resolution": "m s-1", "ranges": "m", "noise": "W", "error_db": "dB", "tracings": "1"}
"""Of the attributes of a file; the seed has none."""
_NO_POWER = -300.0  # dBm: for cells without any power


def as_netcdf(found: Spectrogram, text: str = "") -> memoryview:
    """Return a spectrogram as the bytes of a netCDF-4 file, made in memory; text of its scene, kept as an attribute."""
    import h5netcdf
    import h5py

    made = io.BytesIO()
    with h5py.File(made, "w") as held, h5netcdf.File(held, "w") as file:
        file.attrs.update({"Conventions": CONVENTIONS, "title": "raychan spectrogram", "scene": text})
        file.attrs.update({"seed": found.seed, "warnings": "\n".join(found.warnings)})
        for name, unit in _UNITS.items():
            file.attrs.update({name: np.array(getattr(found, name)), f"{name}_units": unit})
        file.dimensions = {"time": len(found.time), "range_rate": len(found.rate)}
        columns = {
            "time": (("time",), found.time, "s", "middle of the stretch"),
            "range_rate": (("range_rate",), found.rate, "m s-1", "range rate, receding positive"),
            "power_dbm": (
                ("time", "range_rate"), dbm(np.maximum(found.power, watt(_NO_POWER))).astype(np.float32), "dBm",
                "received power",
            ),
        }  # fmt: skip
        for name, (axes, values, unit, title) in columns.items():
            variable = file.create_variable(name, axes, values.dtype, data=values)
            variable.attrs.update({"units": unit, "long_name": title})
    return made.getbuffer()
