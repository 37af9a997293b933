"""Impairments, interferers and air written down as the tables of a scene file."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from raychan.world.scene_files.scene_text import figure, radar_table_of, with_files

if TYPE_CHECKING:
    from raychan.radar.impairments import Impairments
    from raychan.world.scene import Scene

_OF_INTERFERER = {
    "position", "yaw_deg", "pitch_deg", "roll_deg", "velocity_mps", "power_dbm", "antenna", "polarization", "waveform",
}  # fmt: skip


def surroundings_tables(scene: Scene) -> dict[str, Any]:
    """Return the tables `atmosphere` and `interferers` of a scene; those that it has.

    Raises: ValueError for an interferer with an antenna of a class of its own.
    """
    found: dict[str, Any] = {}
    if scene.atmosphere is not None:
        found["atmosphere"] = asdict(scene.atmosphere)
    if scene.interferers:
        found["interferers"] = [_interferer_table(x, scene) for x in scene.interferers]
    return found


def _interferer_table(interferer: Any, scene: Scene) -> dict[str, Any]:
    """Return the table that describes an interferer."""
    if interferer.table is not None:
        return with_files(interferer.table.model_dump(exclude_defaults=True), scene.folder)
    full = radar_table_of(interferer.radar)
    if "antenna" not in full.model_fields_set:
        raise ValueError(f"interferer '{interferer.name}': an antenna of a class of its own cannot be written")
    start = figure(1e6 * interferer.start, interferer.start, lambda x: 1e-6 * x)
    own = {"name": interferer.name, "start_us": start, "locked": interferer.locked}
    return own | {
        name: value for name, value in full.model_dump(exclude_defaults=True).items() if name in _OF_INTERFERER
    }


def impairments_table(given: Impairments) -> dict[str, Any]:
    """Return the table that says what impairments are."""
    found: dict[str, Any] = {"iq_gain_db": float(given.iq_gain_db), "iq_phase_deg": float(given.iq_phase_deg)}
    if given.chirp_error is not None:
        found["chirp_error_us_khz"] = [
            (figure(1e6 * t, t, lambda x: 1e-6 * x), figure(1e-3 * f, f, lambda x: 1e3 * x))
            for t, f in given.chirp_error.table
        ]
    if given.phase_noise is not None:
        found["phase_noise_hz_dbc"] = list(given.phase_noise.mask)
    if given.converter is not None:
        found |= {"adc_bits": given.converter.bits, "adc_full_scale_dbm": float(given.converter.full_scale_dbm)}
    if given.dc_offset_dbm is not None:
        found["dc_offset_dbm"] = float(given.dc_offset_dbm)
    return found
