"""Types of the numbers in a scene file, checked against the limits of raychan.world.limits."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import AfterValidator, Field, ValidationError, ValidatorFunctionWrapHandler, WrapValidator
from pydantic_core import PydanticCustomError

from raychan.world import limits
from raychan.world.limits import Limit

WRONG_TYPE = "wrong_type"
"""Type of the error of a value that is no number or no list, as pydantic's own end in _type."""


class Within(WrapValidator):
    """The check that a value is a number within a limit."""


def _within(limit: Limit, whole: bool = False) -> Within:
    """Return the check that a value is a number within a limit, or a whole one, which may be written as a float; its
    error says what is allowed."""
    allowed = f"{'a whole number' if whole else 'a number'} {limit.allowed}"

    def check(value: Any, parsed: ValidatorFunctionWrapHandler) -> Any:
        if whole and isinstance(value, float) and value.is_integer():
            value = int(value)  # 1e6 is how a large one is written
        try:
            found = parsed(value)
        except ValidationError as e:
            raise _refused(str(e.errors()[0]["type"]), allowed) from None
        if not limit.allows(found):
            raise _refused("limit", allowed)
        return found

    return Within(check)


def _whole(limit: Limit) -> Within:
    """Return the check that a value is a whole number within a limit."""
    return _within(limit, whole=True)


def _listed(allowed: str) -> WrapValidator:
    """Return the check that a value is a list of the right length; its error says what is allowed."""

    def check(value: Any, parsed: ValidatorFunctionWrapHandler) -> Any:
        try:
            return parsed(value)
        except ValidationError as e:
            # Errors of single items keep their own key and text.
            own = [str(x["type"]) for x in e.errors() if not x["loc"] or x["type"] == "missing"]
            if own:
                raise _refused(own[0], allowed) from None
            raise

    return WrapValidator(check)


def _refused(kind: str, allowed: str) -> PydanticCustomError:
    return PydanticCustomError(WRONG_TYPE if kind.endswith("_type") else "limit", "{allowed}", {"allowed": allowed})


def _file_name(name: str) -> str:
    """Check that a text can name a file."""
    if not name or "\0" in name:
        raise _refused("limit", "a name without a zero byte" if name else "the name of a file")
    return name


def _window(name: str) -> str:
    """Check the name of a window; the two most common names need no import of numpy."""
    if name not in ("rect", "hann"):
        from raychan.radar.windows import window

        try:
            window(name, 2)
        except ValueError as e:
            raise PydanticCustomError("window", "{allowed}", {"allowed": str(e).partition(": must be ")[2]}) from None
    return name


def _three(limit: Limit) -> WrapValidator:
    """Return the check that a value is a list of three numbers."""
    return _listed(f"3 numbers, each {limit.allowed}")


_REAL = Field(strict=True, allow_inf_nan=False)
_WHOLE = Field(strict=True)
_THREE = Field(min_length=3, max_length=3)

Switch = Annotated[bool, Field(strict=True)]
Place = Annotated[list[Annotated[float, _REAL, _within(limits.PLACE)]], _THREE, _three(limits.PLACE)]
Speed = Annotated[list[Annotated[float, _REAL, _within(limits.SPEED)]], _THREE, _three(limits.SPEED)]
Spin = Annotated[list[Annotated[float, _REAL, _within(limits.TURN)]], _THREE, _three(limits.TURN)]
Offset = Annotated[list[Annotated[float, _REAL, _within(limits.OFFSET_MM)]], _THREE, _three(limits.OFFSET_MM)]
Angle = Annotated[float, _REAL, _within(limits.ANGLE)]
Turn = Annotated[float, _REAL, _within(limits.TURN)]
Beam = Annotated[float, _REAL, _within(limits.BEAM)]
Crease = Annotated[float, _REAL, _within(limits.CREASE)]
DiffuseLevel = Annotated[float, _REAL, _within(limits.DIFFUSE_DB)]
Exponent = Annotated[int, _WHOLE, _whole(limits.EXPONENT)]
CrossLevel = Annotated[float, _REAL, _within(limits.CROSS_DB)]
KShape = Annotated[float, _REAL, _within(limits.K_SHAPE)]
Texture = Annotated[float, _REAL, _within(limits.TEXTURE_M)]
Scale = Annotated[float, _REAL, _within(limits.SCALE)]
Carrier = Annotated[float, _REAL, _within(limits.CARRIER_GHZ)]
Bandwidth = Annotated[float, _REAL, _within(limits.BANDWIDTH_MHZ)]
Ramp = Annotated[float, _REAL, _within(limits.RAMP_US)]
Power = Annotated[float, _REAL, _within(limits.POWER_DBM)]
SignalLevel = Annotated[float, _REAL, _within(limits.LEVEL_DBM)]
Noise = Annotated[float, _REAL, _within(limits.NOISE_DB)]
Rcs = Annotated[float, _REAL, _within(limits.RCS_DBSM)]
Swerling = Annotated[int, _WHOLE, _whole(limits.SWERLING)]
Gain = Annotated[float, _REAL, _within(limits.GAIN_DBI)]
Loss = Annotated[float, _REAL, _within(limits.LOSS_DB)]
Level = Annotated[float, _REAL, _within(limits.LEVEL_DB)]
Spacing = Annotated[float, _REAL, _within(limits.WAVELENGTHS)]
Pfa = Annotated[float, _REAL, _within(limits.PFA)]
Snr = Annotated[float, _REAL, _within(limits.SNR_DB)]
Tolerance = Annotated[float, _REAL, _within(limits.TOLERANCE_DB)]
Permittivity = Annotated[float, _REAL, _within(limits.EPS_R)]
Conductivity = Annotated[float, _REAL, _within(limits.SIGMA)]
Thickness = Annotated[float, _REAL, _within(limits.THICKNESS_MM)]
Roughness = Annotated[float, _REAL, _within(limits.ROUGHNESS_MM)]
Chirps = Annotated[int, _WHOLE, _whole(limits.CHIRPS)]
Samples = Annotated[int, _WHOLE, _whole(limits.SAMPLES)]
Row = Annotated[int, _WHOLE, _whole(limits.ELEMENTS)]
Slots = Annotated[int, _WHOLE, _whole(limits.SLOTS)]
Pad = Annotated[int, _WHOLE, _whole(limits.PAD)]
Cells = Annotated[int, _WHOLE, _whole(limits.CELLS)]
Bounces = Annotated[int, _WHOLE, _whole(limits.BOUNCES)]
Layers = Annotated[int, _WHOLE, _whole(limits.LAYERS)]
Tracings = Annotated[int, _WHOLE, _whole(limits.TRACINGS)]
Seed = Annotated[int, _WHOLE, _whole(limits.SEED)]
Rays = Annotated[int, _WHOLE, _whole(limits.RAYS)]
RunSeconds = Annotated[float, _REAL, _within(limits.RUN_SECONDS)]
MemoryMb = Annotated[float, _REAL, _within(limits.MEMORY_MB)]
Kelvin = Annotated[float, _REAL, _within(limits.KELVIN)]
Start = Annotated[float, _REAL, _within(limits.START_US)]
Instant = Annotated[float, _REAL, _within(limits.INSTANT_US)]
Deviation = Annotated[float, _REAL, _within(limits.DEVIATION_KHZ)]
FrequencyOffset = Annotated[float, _REAL, _within(limits.OFFSET_HZ)]
NoiseDensity = Annotated[float, _REAL, _within(limits.DBC_HZ)]
ChirpErrors = Annotated[
    list[Annotated[tuple[Instant, Deviation], _listed("[time us, error kHz], a pair of numbers")]],
    Field(min_length=2),
    _listed("2 or more pairs [time us, error kHz]"),
]
PhaseNoiseMask = Annotated[
    list[Annotated[tuple[FrequencyOffset, NoiseDensity], _listed("[offset Hz, level dBc/Hz], a pair of numbers")]],
    Field(min_length=1),
    _listed("1 or more pairs [offset Hz, level dBc/Hz]"),
]
Decibel = Annotated[float, _REAL, _within(limits.IMBALANCE_DB)]
Celsius = Annotated[float, _REAL, _within(limits.CELSIUS)]
Pressure = Annotated[float, _REAL, _within(limits.PRESSURE_HPA)]
Density = Annotated[float, _REAL, _within(limits.VAPOUR_GM3)]
RainRate = Annotated[float, _REAL, _within(limits.RAIN_MMH)]
Fog = Annotated[float, _REAL, _within(limits.FOG_GM3)]
Bits = Annotated[int, _WHOLE, _whole(limits.BITS)]
Window = Annotated[str, AfterValidator(_window)]
FileName = Annotated[str, AfterValidator(_file_name)]
Bearing = Annotated[tuple[Angle, Rcs], Field(strict=False), _listed("[azimuth_deg, dBsm], a pair of numbers")]
Bearings = Annotated[list[Bearing], Field(min_length=2), _listed("2 or more pairs [azimuth_deg, dBsm]")]
Offsets = Annotated[
    list[Offset], Field(min_length=1, max_length=4096), _listed("1 to 4096 receivers, each [x, y, z] in mm")
]
TxOffsets = Annotated[
    list[Offset], Field(min_length=1, max_length=64), _listed("1 to 64 transmitters, each [x, y, z] in mm")
]
Stagger = Annotated[list[Ramp], Field(min_length=2, max_length=16), _listed("2 to 16 times [us]")]
CellPair = Annotated[tuple[Cells, Cells], _listed(f"2 whole numbers, each {limits.CELLS.allowed}")]
PadPair = Annotated[tuple[Pad, Pad], _listed(f"2 whole numbers, each {limits.PAD.allowed}")]
Voyage = Annotated[float, _REAL, _within(limits.VOYAGE_S)]
ShipSpeed = Annotated[float, _REAL, _within(limits.SHIP_MPS)]
Heading = Annotated[float, _REAL, _within(limits.HEADING_DEG)]
Rudder = Annotated[float, _REAL, _within(limits.RUDDER_DEG)]
RudderRate = Annotated[float, _REAL, _within(limits.RUDDER_DPS)]
TurnRate = Annotated[float, _REAL, _within(limits.TURN_DPS)]
Weight = Annotated[float, _REAL, _within(limits.WEIGHT)]
LoopRate = Annotated[float, _REAL, _within(limits.LOOP_RATE)]
Damping = Annotated[float, _REAL, _within(limits.DAMPING)]
FeedbackGain = Annotated[float, _REAL, _within(limits.GAIN)]
Spread = Annotated[float, _REAL, _within(limits.DEVIATION)]
Strength = Annotated[float, _REAL, _within(limits.STRENGTH)]
Reflectivity = Annotated[float, _REAL, _within(limits.REFLECTIVITY)]
BeamRange = Annotated[float, _REAL, _within(limits.BEAM_RANGE)]
WaveHeight = Annotated[float, _REAL, _within(limits.WAVE_HEIGHT_M)]
WavePeriod = Annotated[float, _REAL, _within(limits.WAVE_PERIOD_S)]
Peak = Annotated[float, _REAL, _within(limits.PEAK)]
Divergence = Annotated[float, _REAL, _within(limits.DIVERGENCE_MRAD)]
SpotWidth = Annotated[float, _REAL, _within(limits.SPOT_MM)]
Rings = Annotated[int, _WHOLE, _whole(limits.RINGS)]
Merge = Annotated[float, _REAL, _within(limits.MERGE_M)]
ScanStep = Annotated[float, _REAL, _within(limits.SCAN_STEP_DEG)]
Fan = Annotated[float, _REAL, _within(limits.FAN_DEG)]
Mirror = Annotated[float, _REAL, _within(limits.MIRROR_HZ)]
Horizontal = Annotated[
    list[Annotated[float, _REAL, _within(limits.PLACE)]],
    Field(min_length=2, max_length=2),
    _listed(f"2 numbers, each {limits.PLACE.allowed}"),
]
WayPointList = Annotated[list[Horizontal], Field(min_length=2), _listed("2 or more way-points [x, y] in m")]
Course = Annotated[
    tuple[Annotated[float, _REAL, _within(limits.INSTANT_S)], Heading],
    Field(strict=False),
    _listed("[time in s, heading in deg], a pair of numbers"),
]
Courses = Annotated[list[Course], Field(min_length=1), _listed("1 or more pairs [time in s, heading in deg]")]
Weights = Annotated[
    list[Weight],
    Field(min_length=5, max_length=5),
    _listed("5 weights, of sway velocity, roll rate, yaw rate, roll and heading"),
]
Gains = Annotated[
    list[FeedbackGain],
    Field(min_length=5, max_length=5),
    _listed("5 gains, of sway velocity, roll rate, yaw rate, roll and heading"),
]
