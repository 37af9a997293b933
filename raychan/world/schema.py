"""The scene file's tables and keys: what may stand in them, in the units people use."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from raychan.world.quantities import (
    Angle,
    Bandwidth,
    Bearing,
    Bounces,
    Carrier,
    CellPair,
    Chirps,
    Conductivity,
    Crease,
    Layers,
    Noise,
    Offset,
    Pad,
    Permittivity,
    Pfa,
    Place,
    Power,
    Ramp,
    Rcs,
    Roughness,
    Samples,
    Scale,
    Slots,
    Snr,
    Speed,
    Spin,
    Thickness,
    Tolerance,
    Tracings,
    Turn,
    Window,
)
from raychan.world.schema_antenna import AntennaTable


class Table(BaseModel):
    """A table of a scene file: unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Header(Table):
    """Table [scene]."""

    title: str = ""
    frequency_ghz: Carrier | None = None
    """Frequency of the materials; default the radar's carrier, or 77 GHz without a radar."""


class WaveformTable(Table):
    """Table [radar.waveform]."""

    carrier_ghz: Carrier = 77.0
    """At the start of the sampled ramp."""
    bandwidth_mhz: Bandwidth
    """Swept while sampling."""
    chirp_us: Ramp
    """Sampled time of a ramp."""
    repetition_us: Ramp | None = None
    """From ramp to ramp; default chirp_us."""
    stagger_us: Annotated[list[Ramp], Field(min_length=2, max_length=16)] | None = None
    """Times from ramp to ramp in turn, in place of repetition_us."""
    chirps: Chirps = 128
    samples: Samples = 256
    iq: bool = True

    @model_validator(mode="after")
    def _fits(self) -> WaveformTable:
        if self.repetition_us is not None and self.repetition_us < self.chirp_us * (1.0 - 1e-9):
            raise ValueError("repetition_us not shorter than chirp_us")
        if self.stagger_us is not None:
            if self.repetition_us is not None or min(self.stagger_us) < self.chirp_us * (1.0 - 1e-9):
                raise ValueError("either repetition_us or stagger_us, none of it shorter than chirp_us")
            if self.chirps % len(self.stagger_us):
                raise ValueError(f"chirps a multiple of the {len(self.stagger_us)} times of stagger_us")
        if self.bandwidth_mhz >= 1e3 * self.carrier_ghz:
            raise ValueError(f"bandwidth_mhz below the carrier of {self.carrier_ghz:g} GHz")
        return self


class RadarTable(Table):
    """Table [radar]."""

    position: Place = [0.0, 0.0, 0.5]
    yaw_deg: Angle = 0.0
    pitch_deg: Angle = 0.0
    roll_deg: Angle = 0.0
    velocity_mps: Speed = [0.0, 0.0, 0.0]
    power_dbm: Power = 12.0
    noise_figure_db: Noise = 15.0
    noise: bool = True
    antenna: str | AntennaTable = AntennaTable(kind="isotropic", front=True)
    """Of transmitter and receiver; a text names an antenna file, relative to the scene's."""
    tx_antenna: str | AntennaTable | None = None
    rx_antenna: str | AntennaTable | None = None
    polarization: Literal["V", "H"] = "V"
    rx_polarization: Literal["V", "H", "both"] | None = None
    """Of the receivers; default `polarization`; both: co-polarised, then as many cross-polarised ones."""
    elements_mm: Annotated[list[Offset], Field(min_length=1, max_length=4096)] = [[0.0, 0.0, 0.0]]
    """Receiver phase centres in the antenna's frame."""
    tx_elements_mm: Annotated[list[Offset], Field(min_length=1, max_length=64)] = [[0.0, 0.0, 0.0]]
    """Transmitter phase centres in the antenna's frame."""
    multiplexing: Literal["none", "tdm", "ddm"] = "none"
    """Of transmitters: by time division, chirp m by transmitter m modulo their number, or by Doppler division."""
    rx_position: Place | None = None
    """Of receivers elsewhere, with the radar's clock; default beside the transmitter."""
    rx_velocity_mps: Speed | None = None
    """Default the radar's, as rx_yaw_deg."""
    rx_yaw_deg: Angle | None = None
    ddm_slots: Slots | None = None
    """Doppler slots; default one more than transmitters."""
    waveform: WaveformTable

    @model_validator(mode="after")
    def _transmitters_fit(self) -> RadarTable:
        many, chirps = len(self.tx_elements_mm), self.waveform.chirps
        if self.waveform.stagger_us is not None and many > 1:
            raise ValueError("one transmitter with waveform.stagger_us")
        if self.rx_position is None and (self.rx_velocity_mps is not None or self.rx_yaw_deg is not None):
            raise ValueError("rx_velocity_mps and rx_yaw_deg only with rx_position")
        if self.rx_position is not None and many > 1:
            raise ValueError("one transmitter with rx_position")
        if self.multiplexing == "none" and many > 1:
            raise ValueError(f"multiplexing = 'tdm' or 'ddm' for {many} transmitters")
        if self.ddm_slots is not None and (self.multiplexing != "ddm" or self.ddm_slots < many):
            raise ValueError(f"ddm_slots only with multiplexing = 'ddm', and not below the {many} transmitters")
        slots = (self.ddm_slots or many + 1) if self.multiplexing == "ddm" else many
        if chirps % slots:
            what = "Doppler slots" if self.multiplexing == "ddm" else "transmitters"
            raise ValueError(f"waveform.chirps a multiple of the {slots} {what}, not {chirps}")
        return self


class ProcessingTable(Table):
    """[processing]: what the receiver does."""

    range_window: Window = "hann"
    rate_window: Window = "hann"
    pad: tuple[Pad, Pad] = (2, 2)
    """Zero padding along range and range rate, as a multiple of the samples."""
    cfar: Literal["ca", "os"] = "os"
    pfa: Pfa = 1e-7
    min_snr_db: Snr = 20.0
    guard: CellPair | None = None
    """Cells along range and range rate; none: the detector's own choice."""
    train: CellPair | None = None
    beams: Literal["coherent", "mean"] = "coherent"
    """Of several receivers: detect in the strongest of a bank of beams, or in their mean power."""
    doa: Literal["bartlett", "capon", "music", "esprit"] = "bartlett"
    """Directions of echoes."""
    beam_window: Window = "rect"
    """Taper of the detector's beams over a uniform line or rectangle."""


class Model(Table):
    """[model]: what the channel takes into account, and how well."""

    mode: Literal["physical", "auto"] = "physical"
    """physical: all that max_bounces and max_transmissions allow; auto: of these only what tolerance_db needs."""
    max_bounces: Bounces = 3
    tolerance_db: Tolerance = 0.5
    max_transmissions: Layers = 4
    retrace: Literal["auto"] | Tracings = "auto"
    """How often a frame is traced; auto: if bodies turn, as often as tolerance_db needs; 1: once, and paths keep the
    rates of the frame's start; more: so often, and all that moves is carried on in between."""
    diffraction: bool = False
    """Single diffraction at wedges on the ways to targets given by their RCS."""


class MaterialTable(Table):
    """Table [materials.NAME]."""

    eps_r: Permittivity = 1.0
    sigma: Conductivity = 0.0
    """S/m."""
    thickness_mm: Thickness | None = None
    roughness_mm: Roughness = 0.0
    pec: bool = False
    source: str = ""


class BodyTable(Table):
    """Table [[bodies]]."""

    name: Annotated[str, Field(min_length=1, max_length=100, pattern=r"^[^.\s\p{C}]+$")]
    shape: str | None = None
    params: dict[str, Any] = {}
    """Parameters of the shape [m]."""
    mesh: str | None = None
    unit: str = "m"
    up: str | None = None
    forward: str | None = None
    scale: Scale = 1.0
    crease_deg: Crease = 20.0
    material: str | None = None
    materials: dict[str, str] = {}
    """By part; names may hold * and ?."""
    position: Place = [0.0, 0.0, 0.0]
    yaw_deg: Angle = 0.0
    pitch_deg: Angle = 0.0
    roll_deg: Angle = 0.0
    velocity_mps: Speed = [0.0, 0.0, 0.0]
    turn_rate_dps: Turn = 0.0
    spin_dps: Spin = [0.0, 0.0, 0.0]
    """About the body's own axes, as of a wheel: about its origin."""
    rcs_dbsm: Rcs | Annotated[list[Bearing], Field(min_length=2)] | None = None
    """Makes the body a point target: a figure, or [azimuth_deg, dBsm] pairs seen from its heading."""
    rcs_point: Place | None = None
    """Where it stands, body frame; default the middle of the body."""
    role: Literal["scatterer", "mirror", "blocker"] | None = None

    @model_validator(mode="after")
    def _one_of(self) -> BodyTable:
        if (self.shape is None) == (self.mesh is None):
            raise ValueError("either shape or mesh")
        return self


class SceneFile(Table):
    """A whole scene file."""

    scene: Header = Header()
    radar: RadarTable | None = None
    processing: ProcessingTable = ProcessingTable()
    model: Model = Model()
    materials: dict[str, MaterialTable] = {}
    bodies: list[BodyTable] = []
