"""From the radar table of a scene file to a radar.Sensor."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from raychan.units import watt
from raychan.world.errors import SceneError, nearest
from raychan.world.schema import AntennaTable, RadarTable


def sensor_of(table: RadarTable, folder: Path, file: Any = None) -> Any:
    """Return the radar.Sensor of a radar table; pattern files are looked up in `folder`."""
    from raychan.radar.sensor import Sensor
    from raychan.radar.waveform import Waveform

    w = table.waveform
    tx, rx = (
        antenna_of(table.antenna if own is None else own, table.polarization, folder, f"radar.{key}", file)
        for key, own in (("tx_antenna", table.tx_antenna), ("rx_antenna", table.rx_antenna))
    )
    waveform = Waveform(
        carrier=w.carrier_ghz * 1e9,
        bandwidth=w.bandwidth_mhz * 1e6,
        chirp_duration=w.chirp_us * 1e-6,
        repetition=(w.repetition_us or w.chirp_us) * 1e-6,
        n_chirps=w.chirps,
        n_samples=w.samples,
        complex_sampling=w.iq,
    )
    yaw, pitch, roll = (float(x) for x in np.radians([table.yaw_deg, table.pitch_deg, table.roll_deg]))
    return Sensor(
        position=np.array(table.position),
        yaw=yaw,
        pitch=pitch,
        roll=roll,
        velocity=np.array(table.velocity_mps),
        tx=tx,
        rx=rx,
        elements=1e-3 * np.array(table.elements_mm),
        waveform=waveform,
        power=float(watt(table.power_dbm)),
        noise_figure_db=table.noise_figure_db,
        noise=table.noise,
    )


def antenna_of(given: str | AntennaTable, polarization: str, folder: Path, key: str, file: Any = None) -> Any:
    """Return the antenna that a preset's name or a table describes."""
    from raychan.radar import antenna as kinds
    from raychan.radar.pattern import MeasuredPattern

    table = AntennaTable(preset=given) if isinstance(given, str) else given
    if table.preset is not None:
        if table.preset not in kinds.PRESETS:
            allowed = nearest(table.preset, kinds.PRESETS)
            raise SceneError(
                f"unknown antenna '{table.preset}'", file=file, key=key, value=table.preset, allowed=allowed
            )
        return kinds.preset(table.preset, polarization)
    try:
        if table.kind == "isotropic":
            return kinds.Isotropic(polarization, table.front, table.loss_db)
        if table.kind == "cosine":
            return kinds.CosinePattern(table.hpbw_h_deg, table.hpbw_v_deg, polarization, table.loss_db)  # type: ignore[arg-type]
        if table.kind == "measured":
            return MeasuredPattern.load(folder / str(table.file), polarization)
        element = kinds.Isotropic(polarization, front=True)
        if table.element is not None:
            element = antenna_of(table.element, polarization, folder, f"{key}.element", file)
        return kinds.UniformArray(
            table.ny, table.nz, table.spacing_y, table.spacing_z, table.taper_y, table.taper_z, element, table.loss_db
        )
    except SceneError:
        raise
    except (ValueError, OSError) as e:
        raise SceneError(str(e), file=file, key=key, value=given) from e
