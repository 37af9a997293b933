"""The scene file's tables and keys: what may stand in them, in the units people use."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from raychan.world.limits import ROW_WAVELENGTHS
from raychan.world.quantities import (
    Angle,
    Bandwidth,
    Beam,
    Bearing,
    Bounces,
    Carrier,
    CellPair,
    Chirps,
    Conductivity,
    Crease,
    Gain,
    Layers,
    Level,
    Loss,
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
    Row,
    Samples,
    Scale,
    Snr,
    Spacing,
    Speed,
    Spin,
    Thickness,
    Tolerance,
    Tracings,
    Turn,
    Window,
)


class Table(BaseModel):
    """A table of a scene file: unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Header(Table):
    """Table [scene]."""

    title: str = ""
    frequency_ghz: Carrier | None = None
    """Frequency of the materials; default the radar's carrier, or 77 GHz without a radar."""


class PublishedTable(Table):
    """[published] of an antenna: figures that its source prints; `raychan info` shows them beside the computed ones."""

    gain_dbi: Gain | None = None
    hpbw_h_deg: Beam | None = None
    hpbw_v_deg: Beam | None = None
    sll_h_db: Level | None = None
    sll_v_db: Level | None = None


class AntennaTable(Table):
    """An antenna: a kind with what that kind takes, in a scene or in a TOML file of its own."""

    kind: Literal["isotropic", "cosine", "array", "measured"]
    source: str = ""
    published: PublishedTable | None = None
    gain_dbi: Gain | None = None
    """At boresight; the loss follows."""
    loss_db: Loss | None = None
    """Default 0 dB."""
    hpbw_h_deg: Beam | None = None
    hpbw_v_deg: Beam | None = None
    ny: Row = 1
    nz: Row = 1
    spacing_y: Spacing = 0.5
    """Wavelengths."""
    spacing_z: Spacing = 0.5
    taper_y: Window = "rect"
    taper_z: Window = "rect"
    element: AntennaTable | None = None
    """Default: isotropic ahead."""
    front: bool = False
    file: str | None = None

    @model_validator(mode="after")
    def _fits(self) -> AntennaTable:
        own = _OF_KIND[self.kind]
        if strange := sorted(self.model_fields_set - own - _OF_ANY):
            known = ", ".join(sorted(own | _OF_ANY))
            raise ValueError(f"{strange[0]} is no key of kind = '{self.kind}', which takes {known}")
        if self.gain_dbi is not None and self.loss_db is not None:
            raise ValueError("either gain_dbi or loss_db")
        if self.kind == "cosine" and (self.hpbw_h_deg is None or self.hpbw_v_deg is None):
            raise ValueError("hpbw_h_deg and hpbw_v_deg for kind = 'cosine'")
        if self.kind == "measured" and self.file is None:
            raise ValueError("file for kind = 'measured'")
        if max(self.ny * self.spacing_y, self.nz * self.spacing_z) > ROW_WAVELENGTHS:
            raise ValueError(f"elements times spacing at most {ROW_WAVELENGTHS:g} wavelengths, along y and z")
        return self


_OF_KIND = {
    "isotropic": {"front"},
    "cosine": {"hpbw_h_deg", "hpbw_v_deg"},
    "array": {"ny", "nz", "spacing_y", "spacing_z", "taper_y", "taper_z", "element"},
    "measured": {"file"},
}
_OF_ANY = {"kind", "source", "published", "gain_dbi", "loss_db"}


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
    chirps: Chirps = 128
    samples: Samples = 256
    iq: bool = True

    @model_validator(mode="after")
    def _fits(self) -> WaveformTable:
        if self.repetition_us is not None and self.repetition_us < self.chirp_us * (1.0 - 1e-9):
            raise ValueError("repetition_us not shorter than chirp_us")
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
    elements_mm: Annotated[list[Offset], Field(min_length=1, max_length=4096)] = [[0.0, 0.0, 0.0]]
    """Receiver phase centres in the antenna's frame."""
    waveform: WaveformTable


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
