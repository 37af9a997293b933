"""The tables and keys of a scene file, with types and limits in the units of the file."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from raychan.world.scene_files.antenna import AntennaTable
from raychan.world.scene_files.base import Table
from raychan.world.scene_files.impairments import AtmosphereTable, ImpairmentsTable
from raychan.world.scene_files.materials import MaterialTable
from raychan.world.scene_files.quantities import (
    Angle,
    Bandwidth,
    Bearings,
    Bounces,
    Carrier,
    CellPair,
    Chirps,
    Crease,
    FileName,
    Kelvin,
    Layers,
    MemoryMb,
    Noise,
    Offsets,
    PadPair,
    Pfa,
    Place,
    Power,
    Ramp,
    Rays,
    Rcs,
    RunSeconds,
    Samples,
    Scale,
    Slots,
    Snr,
    Speed,
    Spin,
    Stagger,
    Start,
    Swerling,
    Switch,
    Tolerance,
    Tracings,
    Turn,
    TxOffsets,
    Window,
)


class Header(Table):
    """Table [scene]."""

    title: str = ""
    frequency_ghz: Carrier | None = None
    """Frequency of the materials; default the middle of the radar's ramp, or 77 GHz without a radar."""


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
    stagger_us: Stagger | None = None
    """Times from ramp to ramp in turn, in place of repetition_us."""
    chirps: Chirps = 128
    samples: Samples = 256
    iq: Switch = True

    @model_validator(mode="after")
    def _fits(self) -> WaveformTable:
        if self.repetition_us is not None and self.repetition_us < self.chirp_us * (1.0 - 1e-9):
            raise ValueError(f"repetition_us not shorter than chirp_us, {self.chirp_us:g}")
        if self.stagger_us is not None:
            if self.repetition_us is not None or min(self.stagger_us) < self.chirp_us * (1.0 - 1e-9):
                raise ValueError("either repetition_us or stagger_us, none of it shorter than chirp_us")
            if self.chirps % len(self.stagger_us):
                raise ValueError(f"chirps a multiple of the {len(self.stagger_us)} times of stagger_us")
        if self.bandwidth_mhz >= 1e3 * self.carrier_ghz:
            raise ValueError(f"bandwidth_mhz below the carrier of {self.carrier_ghz:g} GHz")
        return self

    @property
    def middle_ghz(self) -> float:
        """Frequency at the middle sample of a ramp (see `Waveform.middle`)."""
        return self.carrier_ghz + 0.5e-3 * self.bandwidth_mhz * (1.0 - 1.0 / self.samples)


class RadarTable(Table):
    """Table [radar]."""

    position: Place = [0.0, 0.0, 0.5]
    yaw_deg: Angle = 0.0
    pitch_deg: Angle = 0.0
    roll_deg: Angle = 0.0
    velocity_mps: Speed = [0.0, 0.0, 0.0]
    power_dbm: Power = 12.0
    noise_figure_db: Noise = 15.0
    noise_temperature_k: Kelvin = 290.0
    """Of the antenna: the noise power is k (T + 290 K (F - 1)) times the sample rate."""
    noise: Switch = True
    antenna: FileName | AntennaTable = AntennaTable(kind="isotropic", front=True)
    """Of transmitter and receiver; a text names an antenna file, relative to the scene's."""
    tx_antenna: FileName | AntennaTable | None = None
    rx_antenna: FileName | AntennaTable | None = None
    polarization: Literal["V", "H"] = "V"
    rx_polarization: Literal["V", "H", "both"] | None = None
    """Of the receivers; default `polarization`; both: co-polarised, then as many cross-polarised ones."""
    elements_mm: Offsets = [[0.0, 0.0, 0.0]]
    """Receiver phase centres in the antenna's frame."""
    tx_elements_mm: TxOffsets = [[0.0, 0.0, 0.0]]
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
    impairments: ImpairmentsTable = ImpairmentsTable()

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


class InterfererTable(Table):
    """Table [[interferers]]: a second radar that transmits into the receiver."""

    name: Annotated[str, Field(min_length=1, max_length=100)]
    position: Place
    yaw_deg: Angle = 0.0
    pitch_deg: Angle = 0.0
    roll_deg: Angle = 0.0
    velocity_mps: Speed = [0.0, 0.0, 0.0]
    power_dbm: Power = 12.0
    antenna: FileName | AntennaTable = AntennaTable(kind="isotropic", front=True)
    polarization: Literal["V", "H"] = "V"
    waveform: WaveformTable
    """Its samples do not matter."""
    start_us: Start = 0.0
    """Start of its first ramp after that of the radar."""
    locked: Switch = False
    """Ramps keep their phase to the radar's; else each begins at a random phase."""


class ProcessingTable(Table):
    """[processing]: what the receiver does."""

    range_window: Window = "hann"
    rate_window: Window = "hann"
    pad: PadPair = (2, 2)
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


PREVIEW = "preview"
"""The mode of `Model` whose frames are coarse and fast."""


class Model(Table):
    """[model]: the mechanisms that are modelled, and the tolerance."""

    mode: Literal["physical", "auto", "preview"] = "physical"
    """physical: all that max_bounces and max_transmissions allow; auto: of these only what detections need, to
    tolerance_db, by a coarse launch; preview: a fast, coarse picture, without bounces from body to body (see
    `raychan run --preview`)."""
    max_bounces: Bounces = 3
    tolerance_db: Tolerance = 0.5
    max_transmissions: Layers = 4
    """Thin layers that a wave may pass on each stretch from surface to surface: the way out and the way back count
    apart, so a direct echo may pass twice as many. Of interferers and `specular_paths`: on the whole way."""
    speckle: Switch = False
    """Levels that makers' tolerances of the bodies move by more than tolerance_db are refined to that only."""
    max_rays: Literal["auto"] | Rays = "auto"
    """Rays that a frame may cast to reach tolerance_db, about; auto: those of its first launch and half
    as many again, or 1,000,000 more where that is more; below 1 dB what comes on top is divided by the tolerance."""
    max_seconds: RunSeconds | None = None
    """Time that a run may take: refinement takes no further step where the run might not end within it."""
    max_memory_mb: MemoryMb | None = None
    """Memory of paths: refinement takes no further step that is foreseen to take more."""
    retrace: Literal["auto"] | Tracings = "auto"
    """Number of tracings of a frame. auto: if bodies turn, as many as tolerance_db needs; 1: one, at its middle, whose
    range rates paths keep; more: all moving bodies are extrapolated between the tracings, of an even number one more,
    at the middle, for the paths."""
    diffuse: Literal["stated", "rough", "off"] = "stated"
    """Diffuse scattering, as clutter. stated: of materials with a diffuse table; rough: also of those with a roughness,
    by Lambert's law; off: none."""
    diffraction: Switch = False
    """Single diffraction at wedges on the ways to targets given by their RCS."""
    simplify: Switch = True
    """Trace finely tessellated smooth surfaces by fewer facets, as near to them as tolerance_db asks for."""


class PlacedBodyTable(Table):
    """What tables of bodies have in every kind of scene: a shape or a mesh, its place and how it moves."""

    name: Annotated[str, Field(min_length=1, max_length=100, pattern=r"^[^.\s\p{C}]+$")]
    shape: str | None = None
    params: dict[str, Any] = {}
    """Parameters of the shape [m]."""
    mesh: FileName | None = None
    unit: str = "m"
    up: str | None = None
    forward: str | None = None
    scale: Scale = 1.0
    crease_deg: Crease = 20.0
    material: str | None = None
    position: Place = [0.0, 0.0, 0.0]
    yaw_deg: Angle = 0.0
    pitch_deg: Angle = 0.0
    roll_deg: Angle = 0.0
    velocity_mps: Speed = [0.0, 0.0, 0.0]
    turn_rate_dps: Turn = 0.0

    @model_validator(mode="after")
    def _shape_or_mesh(self) -> PlacedBodyTable:
        if (self.shape is None) == (self.mesh is None):
            raise ValueError("either shape or mesh" + (", here both" if self.shape else ", here neither"))
        return self


class BodyTable(PlacedBodyTable):
    """Table [[bodies]]."""

    materials: dict[str, str] = {}
    """By part; names may hold * and ?."""
    spin_dps: Spin = [0.0, 0.0, 0.0]
    """About the body's own axes through its origin, as a wheel spins."""
    rcs_dbsm: Rcs | Bearings | None = None
    """Makes the body a point target: a number, or [azimuth_deg, dBsm] pairs relative to its heading."""
    rcs_point: Place | None = None
    """Place of the point target, body frame [m]; default the middle of the body."""
    swerling: Swerling = 0
    """How that RCS fluctuates: 0 steady, 1 and 3 from frame to frame, 2 and 4 from chirp to chirp."""
    role: Literal["scatterer", "mirror", "blocker"] | None = None

    @model_validator(mode="after")
    def _fluctuates(self) -> BodyTable:
        if self.swerling and self.rcs_dbsm is None:
            raise ValueError("rcs_dbsm with swerling: only a given RCS fluctuates")
        return self


class SceneFile(Table):
    """A whole scene file."""

    scene: Header = Header()
    radar: RadarTable | None = None
    interferers: list[InterfererTable] = []
    atmosphere: AtmosphereTable | None = None
    """None: no loss on the way."""
    processing: ProcessingTable = ProcessingTable()
    model: Model = Model()
    materials: dict[str, MaterialTable] = {}
    bodies: list[BodyTable] = []
