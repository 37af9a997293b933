"""The scene file's tables and keys: what may stand in them, in the units people use."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from raychan.world.errors import SceneError, nearest

Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0.0)]
NotNegative = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0.0)]
Count = Annotated[int, Field(strict=True, ge=1)]
Vector = Annotated[list[Number], Field(min_length=3, max_length=3)]
Pair = Annotated[tuple[Number, Number], Field(strict=False)]
CountPair = tuple[Annotated[int, Field(strict=True, ge=0)], Annotated[int, Field(strict=True, ge=0)]]


class Table(BaseModel):
    """A table of a scene file: unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Header(Table):
    """[scene]"""

    title: str = ""
    frequency_ghz: Positive | None = None
    """Frequency of the materials; default the radar's carrier, or 77 GHz without a radar."""


class PublishedTable(Table):
    """[published] of an antenna: what its source prints of it; `raychan info` sets it beside the computed figures."""

    gain_dbi: Number | None = None
    hpbw_h_deg: Number | None = None
    hpbw_v_deg: Number | None = None
    sll_h_db: Number | None = None
    sll_v_db: Number | None = None


class AntennaTable(Table):
    """An antenna: a kind with what that kind takes, in a scene or in a TOML file of its own."""

    kind: Literal["isotropic", "cosine", "array", "measured"]
    source: str = ""
    published: PublishedTable | None = None
    gain_dbi: Number | None = None
    """At boresight; the loss follows."""
    loss_db: Number | None = None
    """Default 0 dB."""
    hpbw_h_deg: Positive | None = None
    hpbw_v_deg: Positive | None = None
    ny: Count = 1
    nz: Count = 1
    spacing_y: Positive = 0.5
    """Wavelengths."""
    spacing_z: Positive = 0.5
    taper_y: str = "rect"
    taper_z: str = "rect"
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
        return self


_OF_KIND = {
    "isotropic": {"front"},
    "cosine": {"hpbw_h_deg", "hpbw_v_deg"},
    "array": {"ny", "nz", "spacing_y", "spacing_z", "taper_y", "taper_z", "element"},
    "measured": {"file"},
}
_OF_ANY = {"kind", "source", "published", "gain_dbi", "loss_db"}


class WaveformTable(Table):
    """[radar.waveform]"""

    carrier_ghz: Positive = 77.0
    """At the start of the sampled ramp."""
    bandwidth_mhz: Positive
    """Swept while sampling."""
    chirp_us: Positive
    """Sampled time of a ramp."""
    repetition_us: Positive | None = None
    """From ramp to ramp; default chirp_us."""
    chirps: Count = 128
    samples: Count = 256
    iq: bool = True

    @model_validator(mode="after")
    def _fits(self) -> WaveformTable:
        if self.repetition_us is not None and self.repetition_us < self.chirp_us * (1.0 - 1e-9):
            raise ValueError("repetition_us not shorter than chirp_us")
        return self


class RadarTable(Table):
    """[radar]"""

    position: Vector = [0.0, 0.0, 0.5]
    yaw_deg: Number = 0.0
    pitch_deg: Number = 0.0
    roll_deg: Number = 0.0
    velocity_mps: Vector = [0.0, 0.0, 0.0]
    power_dbm: Number = 12.0
    noise_figure_db: NotNegative = 15.0
    noise: bool = True
    antenna: str | AntennaTable = AntennaTable(kind="isotropic", front=True)
    """Of transmitter and receiver; a text names an antenna file, relative to the scene's."""
    tx_antenna: str | AntennaTable | None = None
    rx_antenna: str | AntennaTable | None = None
    polarization: Literal["V", "H"] = "V"
    elements_mm: Annotated[list[Vector], Field(min_length=1)] = [[0.0, 0.0, 0.0]]
    """Receiver phase centres in the antenna's frame."""
    waveform: WaveformTable


class Processing(Table):
    """[processing]: what the receiver does."""

    range_window: str = "hann"
    rate_window: str = "hann"
    pad: CountPair = (2, 2)
    """Zero padding along range and range rate, as a multiple of the samples."""
    cfar: Literal["ca", "os"] = "os"
    pfa: Annotated[float, Field(strict=True, gt=0.0, lt=1.0)] = 1e-7
    min_snr_db: Number = 20.0
    guard: CountPair | None = None
    """Cells along range and range rate; none: the detector's own choice."""
    train: CountPair | None = None


class Model(Table):
    """[model]: what the channel takes into account, and how well."""

    mode: Literal["physical", "auto"] = "physical"
    """physical: all that max_bounces and max_transmissions allow; auto: of these only what tolerance_db needs."""
    max_bounces: Annotated[int, Field(strict=True, ge=1, le=12)] = 3
    tolerance_db: Positive = 0.5
    max_transmissions: Annotated[int, Field(strict=True, ge=0, le=16)] = 4
    retrace: Literal["auto"] | Count = "auto"
    """How often a frame is traced; auto: if bodies turn, as often as tolerance_db needs; 1: once, and paths keep the
    rates of the frame's start; more: so often, and all that moves is carried on in between."""
    diffraction: bool = False
    """Single diffraction at wedges on the ways to targets given by their RCS."""


class MaterialTable(Table):
    """[materials.NAME]"""

    eps_r: Annotated[float, Field(strict=True, allow_inf_nan=False, ge=1.0)] = 1.0
    sigma: NotNegative = 0.0
    """S/m."""
    thickness_mm: Positive | None = None
    roughness_mm: NotNegative = 0.0
    pec: bool = False
    source: str = ""


class BodyTable(Table):
    """[[bodies]]"""

    name: Annotated[str, Field(min_length=1, pattern=r"^[^.\s]+$")]
    shape: str | None = None
    params: dict[str, Any] = {}
    """Parameters of the shape [m]."""
    mesh: str | None = None
    unit: str = "m"
    up: str | None = None
    forward: str | None = None
    scale: Positive = 1.0
    crease_deg: Annotated[float, Field(strict=True, ge=0.0, le=180.0)] = 20.0
    material: str | None = None
    materials: dict[str, str] = {}
    """By part; names may hold * and ?."""
    position: Vector = [0.0, 0.0, 0.0]
    yaw_deg: Number = 0.0
    pitch_deg: Number = 0.0
    roll_deg: Number = 0.0
    velocity_mps: Vector = [0.0, 0.0, 0.0]
    turn_rate_dps: Number = 0.0
    spin_dps: Vector = [0.0, 0.0, 0.0]
    """About the body's own axes, as of a wheel: about its origin."""
    rcs_dbsm: Number | Annotated[list[Pair], Field(min_length=2)] | None = None
    """Makes the body a point target: a figure, or [azimuth_deg, dBsm] pairs seen from its heading."""
    rcs_point: Vector | None = None
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
    processing: Processing = Processing()
    model: Model = Model()
    materials: dict[str, MaterialTable] = {}
    bodies: list[BodyTable] = []


def checked(kind: type[Any], data: Any, file: Any = None) -> Any:
    """Return `data` checked as a table of `kind`; SceneError for the first thing that is wrong."""
    try:
        return kind.model_validate(data)
    except ValidationError as e:
        raise _explained(kind, data, e, file) from None


def _explained(kind: type[BaseModel], data: Any, error: ValidationError, file: Any) -> SceneError:
    # Unknown keys first: a misspelt key also makes its right spelling missing.
    found = sorted(error.errors(), key=_weight)[0]
    loc, value = found["loc"], found.get("input")
    key = _dotted(loc, data, found["type"] in ("missing", "extra_forbidden"))
    if found["type"] == "extra_forbidden":
        known = _table_at(kind, loc[:-1]).model_fields
        return SceneError(
            f"unknown key '{loc[-1]}'", file=file, key=key, value=value, allowed=nearest(str(loc[-1]), known)
        )
    message = found["msg"].removeprefix("Input should be ").removeprefix("Value error, ")
    if found["type"] == "missing":
        return SceneError("key is missing", file=file, key=key, allowed="a value")
    if found["type"] == "value_error":
        return SceneError("keys do not fit together", file=file, key=key, value=value, allowed=message)
    return SceneError(f"{value!r} is not possible", file=file, key=key, value=value, allowed=message)


def _weight(found: Any) -> tuple[bool, bool, int]:
    # Of a union's branches, the one of the right type says more than that the other is of the wrong one.
    return found["type"] != "extra_forbidden", found["type"].endswith("_type"), -len(found["loc"])


def _table_at(kind: type[BaseModel], loc: tuple[Any, ...]) -> type[BaseModel]:
    at: type[BaseModel] = kind
    for step in loc:
        # Steps that are no field (indices, names of materials, branches of a union) stay in or lead to the table.
        if isinstance(step, str) and step in at.model_fields:
            inner = _tables_in(at.model_fields[step].annotation)
            at = inner[0] if inner else at
    return at


def _tables_in(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [t for part in getattr(annotation, "__args__", ()) for t in _tables_in(part)]


def _dotted(loc: tuple[Any, ...], data: Any, whole: bool) -> str:
    """Return the key as people write it: bodies by name, no branches of unions; `whole` if its end may be absent."""
    words: list[str] = []
    for step in loc:
        if isinstance(data, list) and isinstance(step, int) and step < len(data):
            data = data[step]
            name = data.get("name") if isinstance(data, dict) else None
            words.append(str(name if isinstance(name, str) else step))
        elif isinstance(data, dict) and (step in data or (whole and step == loc[-1])):
            data = data.get(step)
            words.append(str(step))
    return ".".join(words)
