"""Types of the numbers in a scene file, checked against the limits of raychan.world.limits."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field
from pydantic_core import PydanticCustomError

from raychan.world import limits
from raychan.world.limits import Limit


def _within(limit: Limit) -> AfterValidator:
    """Return the check that a number lies within a limit."""

    def check(value: float) -> float:
        if not limit.allows(value):
            raise PydanticCustomError("limit", "{allowed}", {"allowed": limit.allowed})
        return value

    return AfterValidator(check)


def _window(name: str) -> str:
    """Check the name of a window; the two most common names need no import of numpy."""
    if name not in ("rect", "hann"):
        from raychan.radar.windows import window

        try:
            window(name, 2)
        except ValueError as e:
            raise PydanticCustomError("window", "{allowed}", {"allowed": str(e).partition(": must be ")[2]}) from None
    return name


_REAL = Field(strict=True, allow_inf_nan=False)
_WHOLE = Field(strict=True)
_THREE = Field(min_length=3, max_length=3)

Place = Annotated[list[Annotated[float, _REAL, _within(limits.PLACE)]], _THREE]
Speed = Annotated[list[Annotated[float, _REAL, _within(limits.SPEED)]], _THREE]
Spin = Annotated[list[Annotated[float, _REAL, _within(limits.TURN)]], _THREE]
Offset = Annotated[list[Annotated[float, _REAL, _within(limits.OFFSET_MM)]], _THREE]
Angle = Annotated[float, _REAL, _within(limits.ANGLE)]
Turn = Annotated[float, _REAL, _within(limits.TURN)]
Beam = Annotated[float, _REAL, _within(limits.BEAM)]
Crease = Annotated[float, _REAL, _within(limits.CREASE)]
Scale = Annotated[float, _REAL, _within(limits.SCALE)]
Carrier = Annotated[float, _REAL, _within(limits.CARRIER_GHZ)]
Bandwidth = Annotated[float, _REAL, _within(limits.BANDWIDTH_MHZ)]
Ramp = Annotated[float, _REAL, _within(limits.RAMP_US)]
Power = Annotated[float, _REAL, _within(limits.POWER_DBM)]
Noise = Annotated[float, _REAL, _within(limits.NOISE_DB)]
Rcs = Annotated[float, _REAL, _within(limits.RCS_DBSM)]
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
Chirps = Annotated[int, _WHOLE, _within(limits.CHIRPS)]
Samples = Annotated[int, _WHOLE, _within(limits.SAMPLES)]
Slots = Annotated[int, _WHOLE, _within(limits.SLOTS)]
Row = Annotated[int, _WHOLE, _within(limits.ELEMENTS)]
Pad = Annotated[int, _WHOLE, _within(limits.PAD)]
Cells = Annotated[int, _WHOLE, _within(limits.CELLS)]
Bounces = Annotated[int, _WHOLE, _within(limits.BOUNCES)]
Layers = Annotated[int, _WHOLE, _within(limits.LAYERS)]
Tracings = Annotated[int, _WHOLE, _within(limits.TRACINGS)]
Window = Annotated[str, AfterValidator(_window)]
Bearing = Annotated[tuple[Angle, Rcs], Field(strict=False)]
CellPair = tuple[Cells, Cells]
