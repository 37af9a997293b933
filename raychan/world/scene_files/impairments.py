"""The scene file's tables of what degrades a radar: its receiver's imperfections, and the air."""

from __future__ import annotations

from typing import Any, Self

from pydantic import BaseModel, ConfigDict, ValidationInfo, field_validator, model_validator

from raychan.world.scene_files.quantities import (
    Angle,
    Bits,
    Celsius,
    ChirpErrors,
    Decibel,
    Density,
    Fog,
    PhaseNoiseMask,
    Power,
    Pressure,
    RainRate,
    SignalLevel,
)

_CLOSED = ConfigDict(extra="forbid", frozen=True)
"""Unknown keys are errors."""


class ImpairmentsTable(BaseModel):
    """Table [radar.impairments]: what the receiver does wrong; nothing by default."""

    model_config = _CLOSED

    chirp_error_us_khz: ChirpErrors | None = None
    """[time in the ramp, frequency error] pairs; linear in between, level beyond the ends."""
    phase_noise_hz_dbc: PhaseNoiseMask | None = None
    """[offset, dBc/Hz] pairs of the oscillator's mask; linear in dB over log offset, level beyond the ends."""
    adc_bits: Bits | None = None
    adc_full_scale_dbm: Power | None = None
    """Sine as wide as all steps, referred to the antenna; half a step less is not clipped."""
    iq_gain_db: Decibel = 0.0
    """Of Q over I."""
    iq_phase_deg: Angle = 0.0
    """By which Q is off 90 deg from I."""
    dc_offset_dbm: SignalLevel | None = None
    """A constant in all samples, referred to the antenna."""

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if (self.adc_bits is None) != (self.adc_full_scale_dbm is None):
            raise ValueError("adc_bits and adc_full_scale_dbm together")
        return self

    @field_validator("chirp_error_us_khz", "phase_noise_hz_dbc")
    @classmethod
    def _rises(cls, rows: Any, info: ValidationInfo) -> Any:
        from raychan.radar.impairments import ChirpError, PhaseNoise

        kind, name = (PhaseNoise, "mask") if info.field_name == "phase_noise_hz_dbc" else (ChirpError, "table")
        try:
            if rows is not None:
                kind(rows)
        except ValueError as e:
            # Of the class, whose name no file has.
            raise ValueError(str(e).removeprefix(f"{kind.__name__}.{name}: ")) from None
        return rows


class AtmosphereTable(BaseModel):
    """Table [atmosphere]: the air, the same everywhere."""

    model_config = _CLOSED

    temperature_c: Celsius = 15.0
    pressure_hpa: Pressure = 1013.25
    """Of the dry air."""
    vapour_gm3: Density = 7.5
    rain_mmh: RainRate = 0.0
    fog_gm3: Fog = 0.0
    """Liquid water."""
