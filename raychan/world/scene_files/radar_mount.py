"""Between the radar table of a scene file and a Radar object, both ways."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from raychan.units import watt
from raychan.world.errors import SceneError, nearest, shown
from raychan.world.scene_files import bundled, overrides
from raychan.world.scene_files.antenna import AntennaTable
from raychan.world.scene_files.errors import checked
from raychan.world.scene_files.impairments import ImpairmentsTable
from raychan.world.scene_files.schema import ProcessingTable, RadarTable

if TYPE_CHECKING:
    from raychan.radar.antenna import Antenna
    from raychan.radar.impairments import Impairments
    from raychan.radar.processing import Processing
    from raychan.radar.radar import Radar


def mount(radar: Radar | RadarTable | Mapping[str, object] | None, file: Any = None) -> RadarTable | None:
    """Return the radar table of what a scene is given; SceneError for values that a scene file could not have."""
    if radar is None or isinstance(radar, RadarTable | Mapping):
        return None if radar is None else checked(RadarTable, radar, file, "radar")  # type: ignore[no-any-return]
    from raychan.radar.radar import Radar
    from raychan.world.scene_files.scene_text import radar_table_of

    if not isinstance(radar, Radar):
        allowed = "a Radar, its table, or None"
        raise SceneError(f"{shown(radar)} is not possible", file=file, key="radar", value=radar, allowed=allowed)
    return radar_table_of(radar)


def processing_of(given: Processing | Mapping[str, object] | None, radar: object, file: Any = None) -> Processing:
    """Return the receiver's settings: those given, else the radar object's own, else the defaults."""
    from raychan.radar.processing import Processing

    own = getattr(radar, "processing", None) if given is None else given
    table = asdict(own) if isinstance(own, Processing) else {} if own is None else own
    return Processing(**checked(ProcessingTable, table, file, "processing").model_dump())


def radar_of(table: RadarTable, processing: Processing, folder: Path, file: Any = None) -> Radar:
    """Return the radar of a radar table; antenna files are looked up in `folder`."""
    from raychan.radar.radar import Radar
    from raychan.radar.waveform import Waveform

    w = table.waveform
    antennas = {
        key: antenna_of(given, table.polarization, folder, f"radar.{key}", file) for key, given in mounted(table)
    }
    tx, rx = (antennas[key] for key, _ in mounted(table))
    waveform = Waveform(
        carrier=w.carrier_ghz * 1e9,
        bandwidth=w.bandwidth_mhz * 1e6,
        chirp_duration=w.chirp_us / 1e6,
        repetition=None if w.stagger_us else (w.repetition_us or w.chirp_us) / 1e6,  # type: ignore[arg-type]
        stagger=tuple(t / 1e6 for t in w.stagger_us or ()),
        n_chirps=w.chirps,
        n_samples=w.samples,
        complex_sampling=w.iq,
    )
    return Radar(
        waveform,
        table.position,
        antenna=tx,
        rx_antenna=None if rx is tx else rx,
        yaw_deg=table.yaw_deg,
        pitch_deg=table.pitch_deg,
        roll_deg=table.roll_deg,
        velocity=table.velocity_mps,
        elements=1e-3 * np.array(table.elements_mm),
        tx_elements=1e-3 * np.array(table.tx_elements_mm),
        multiplexing=table.multiplexing,
        ddm_slots=table.ddm_slots,
        rx_polarization=table.rx_polarization,
        rx_position=table.rx_position,
        rx_velocity=table.rx_velocity_mps,
        rx_yaw_deg=table.rx_yaw_deg,
        processing=processing,
        power=float(watt(table.power_dbm)),
        noise_figure_db=table.noise_figure_db,
        noise_temperature_k=table.noise_temperature_k,
        noise=table.noise,
        impairments=_impairments(table.impairments, w.iq, file),
    )


def _impairments(table: ImpairmentsTable, iq: bool, file: Any) -> Impairments:
    """Return the impairments of a table; SceneError where they need I/Q sampling and there is none."""
    from raychan.radar.impairments import ChirpError, Converter, Impairments, PhaseNoise

    errors, mask, bits, scale = (
        table.chirp_error_us_khz, table.phase_noise_hz_dbc, table.adc_bits, table.adc_full_scale_dbm,
    )  # fmt: skip
    found = Impairments(
        chirp_error=None if errors is None else ChirpError([(1e-6 * t, 1e3 * f) for t, f in errors]),
        phase_noise=None if mask is None else PhaseNoise(mask),
        converter=None if bits is None or scale is None else Converter(bits, scale),
        iq_gain_db=table.iq_gain_db,
        iq_phase_deg=table.iq_phase_deg,
        dc_offset_dbm=table.dc_offset_dbm,
    )
    if not (iq or found.iq_balanced):
        raise SceneError(
            "I/Q imbalance of a radar with real sampling", file=file, key="radar.impairments",
            allowed="waveform.iq = true, or iq_gain_db and iq_phase_deg of 0",
        )  # fmt: skip
    return found


def mounted(table: RadarTable) -> list[tuple[str, str | AntennaTable]]:
    """Return for transmitter and receiver the key of the radar table that gives the antenna, and what stands there."""
    own = (("tx_antenna", table.tx_antenna), ("rx_antenna", table.rx_antenna))
    return [("antenna", table.antenna) if given is None else (key, given) for key, given in own]


def antenna_table(given: str | AntennaTable, folder: Path, key: str, file: Any = None) -> tuple[AntennaTable, Any]:
    """Return an antenna's table and the file it stands in: `file`, or one of its own in `folder` if `given` is a name.

    Raises: SceneError where there is no such file, or where it is wrong.
    """
    if isinstance(given, AntennaTable):
        return given, file
    if "\0" in given or not given:
        allowed = "a name without a zero byte" if given else "a table, or the name of a TOML file"
        raise SceneError(f"{shown(given)} is not possible", file=file, key=key, value=given, allowed=allowed)
    path = bundled.found(given, folder)
    try:
        text = path.read_text(encoding="utf-8")
    except (FileNotFoundError, IsADirectoryError, NotADirectoryError):
        # Beside a scene lie scenes; by custom the antennas have a folder of their own.
        beside = (folder / "antennas" if path.parent == folder else path.parent).glob("*.toml")
        found = [Path(os.path.relpath(p, folder)).as_posix() for p in beside] + bundled.antenna_names()
        named = [name for name in found if Path(name).stem == Path(given).stem]
        allowed = (
            nearest(named[0] if named else given, found)
            if found
            else "a table, or a TOML file by its path from the scene file"
        )
        raise SceneError(f"no antenna file {path}", file=file, key=key, value=given, allowed=allowed) from None
    except UnicodeDecodeError as e:
        raise overrides.no_toml(e, path) from None
    except OSError as e:
        reason = getattr(e, "strerror", None) or e
        raise SceneError(f"{path} cannot be read ({reason})", file=file, key=key, value=given) from None
    return checked(AntennaTable, overrides.parsed(text, path), path), path


def is_antenna(file: Path) -> bool:
    """Say whether a file is an antenna's: TOML whose tables have the antenna's key `kind` at the top."""
    try:
        return "kind" in overrides.parsed(file.read_text(encoding="utf-8"), file)
    except (OSError, UnicodeDecodeError, SceneError):
        return False


def load_antenna(path: str | Path, polarization: str = "V") -> Antenna:
    """Return the antenna of a file, or one that comes with raychan by its name, such as 'antennas/patch'.

    Args: path of the TOML file; polarization V or H. Raises: SceneError where there is none, or where it is wrong.
    """
    return antenna_of(str(path), polarization, Path(), "path")


def antenna_of(given: str | AntennaTable, polarization: str, folder: Path, key: str, file: Any = None) -> Antenna:
    """Return the antenna that a table or an antenna file describes."""
    from raychan.radar.pattern import gain_dbi

    table, own = antenna_table(given, folder, key, file)
    if isinstance(given, str):
        folder, file, key = own.parent, own, ""
    try:
        if table.gain_dbi is None:
            return _made(table, table.loss_db or 0.0, polarization, folder, key, file)
        ahead = gain_dbi(_made(table, 0.0, polarization, folder, key, file))
        if not np.isfinite(ahead):
            raise ValueError("gain_dbi for an antenna that has no gain at boresight")
        return _made(table, ahead - table.gain_dbi, polarization, folder, key, file)
    except SceneError:
        raise
    except (ValueError, OSError) as e:
        raise SceneError(str(e), file=file, key=key, value=given) from e


def _made(table: AntennaTable, loss_db: float, polarization: str, folder: Path, key: str, file: Any) -> Antenna:
    from raychan.radar import antenna as kinds
    from raychan.radar.pattern import MeasuredAntenna

    if table.kind == "isotropic":
        return kinds.IsotropicAntenna(polarization, table.front, loss_db)
    if table.kind == "cosine":
        return kinds.CosineAntenna(table.hpbw_h_deg, table.hpbw_v_deg, polarization, loss_db)  # type: ignore[arg-type]
    if table.kind == "measured":
        pattern = MeasuredAntenna.load(folder / str(table.file), polarization)
        return replace(pattern, gain_db=pattern.gain_db - loss_db)
    element: Antenna = kinds.IsotropicAntenna(polarization, front=True)
    if table.element is not None:
        element = antenna_of(table.element, polarization, folder, f"{key}.element".removeprefix("."), file)
    return kinds.ArrayAntenna(
        table.ny, table.nz, table.spacing_y, table.spacing_z, table.taper_y, table.taper_z, element, loss_db
    )
