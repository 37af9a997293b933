"""Physical limits of numbers with unit and reason, the same for scene files, options and Python arguments.

A number beyond them is a mistake (a wrong unit, a digit too many) or asks for physics that is not modelled.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Limit:
    """Lowest and highest plausible value, with unit and reason; `above`: the lowest itself is not allowed."""

    low: float
    high: float
    unit: str
    why: str
    above: bool = False

    def allows(self, value: float) -> bool:
        """Return whether a value lies within the limits; NaN does not."""
        return (self.low < value if self.above else self.low <= value) and value <= self.high

    @property
    def allowed(self) -> str:
        """What is allowed, and why, as messages say it."""
        unit = f" {self.unit}" if self.unit else ""
        ends = f"above {self.low:g} and at most" if self.above else f"between {self.low:g} and"
        return f"{ends} {self.high:g}{unit}: {self.why}"

    @property
    def text(self) -> str:
        """The same as a clause."""
        return f"must lie {self.allowed}"

    def problem(self, value: Any, whole: bool = False) -> str:
        """Return what is wrong with a value that should be a number (a whole one) within the limits, or ''."""
        number = hasattr(value, "__index__") or (not whole and hasattr(value, "__float__"))
        if isinstance(value, bool) or not number:
            return f"{value!r}: a {'whole ' if whole else ''}number is wanted; {self.text}"
        return "" if self.allows(value if whole else float(value)) else f"{value!r}: {self.text}"

    def check(self, name: str, value: Any, whole: bool = False) -> None:
        """Raise ValueError unless a value is a number (a whole one) within the limits."""
        if problem := self.problem(value, whole):
            raise ValueError(f"{name} = {problem}")

    def times(self, factor: float, unit: str) -> Limit:
        """Return the same limits in another unit, smaller by a factor."""
        return Limit(self.low * factor, self.high * factor, unit, self.why, self.above)


LENGTH = Limit(0.0, 1e6, "m", "a scene is no wider than a radar's horizon", above=True)
PLACE = Limit(-1e6, 1e6, "m", "a scene is no wider than a radar's horizon; count from an origin near it")
WIDTH = Limit(0.0, 1e4, "m", "float32 rays do not tell the facets of a wider body apart; is it the unit, as mm?")
SAG = Limit(1e-6, 10.0, "m", "a facet finer than a micrometre is flat at any wavelength allowed")
HOOPS = Limit(1, 1000, "", "a rack of so many hoops")
OFFSET_MM = Limit(-1e3, 1e3, "mm", "the elements of one array stand within a metre of its phase centre")
SLOTS = Limit(2, 64, "", "Doppler slots, at least the transmitters")
SPEED = Limit(-1e5, 1e5, "m/s", "range rates are of second order in v/c, and nothing here is faster than a spacecraft")
ANGLE = Limit(-3600.0, 3600.0, "deg", "ten turns are more than any pose needs")
CREASE = Limit(0.0, 180.0, "deg", "faces fold by at most half a turn")
BEAM = Limit(0.1, 360.0, "deg", "no antenna of a vehicle or ship has a narrower beam")
TURN = Limit(-1e7, 1e7, "deg/s", "no rotor turns faster than 1.6 million times a minute")

FREQUENCY = Limit(1e8, 1e12, "Hz", "below, bodies are no longer large in wavelengths; above, surfaces no longer smooth")
CARRIER_GHZ = FREQUENCY.times(1e-9, "GHz")
BANDWIDTH_MHZ = Limit(1e-3, 1e6, "MHz", "a range cell from 0.15 mm to 150 km; it must also be below the carrier")
RAMP_US = Limit(1e-3, 1e6, "us", "a ramp lasts between a nanosecond and a second")
CHIRPS = Limit(1, 1 << 20, "", "a frame of more ramps is no frame of any radar")
SAMPLES = Limit(1, 1 << 20, "", "a ramp of more samples is no ramp of any radar")
PAD = Limit(1, 64, "", "1 pads nothing; more than 64 only draws the same map finer")
CELLS = Limit(0, 1000, "cells", "cells about the one under test")

POWER_DBM = Limit(-100.0, 100.0, "dBm", "from less than a receiver's noise to ten megawatts")
NOISE_DB = Limit(0.0, 60.0, "dB", "no receiver is quieter than 290 K noise in, nor useful above 60 dB")
RCS_DBSM = Limit(-100.0, 100.0, "dBsm", "from a grain of dust to more than any ship seen broadside")
GAIN_DBI = Limit(-60.0, 80.0, "dBi", "from a leak to the largest dishes")
LOSS_DB = Limit(-60.0, 100.0, "dB", "an antenna that loses more sends nothing; below 0 it mends a published gain")
LEVEL_DB = Limit(-400.0, 400.0, "dB", "a level beyond is no level")
WAVELENGTHS = Limit(0.01, 100.0, "wavelengths", "elements closer couple, farther ones are no array")
ELEMENTS = Limit(1, 256, "", "a row of at most 256 elements")
ROW_WAVELENGTHS = 128.0
"""Most that a row of elements may span: its pattern is integrated over the sphere, to the square of this."""

PFA = Limit(1e-15, 0.5, "", "a probability of false alarm that training cells can tell")
SNR_DB = Limit(-100.0, 300.0, "dB", "a level over noise")
TOLERANCE_DB = Limit(1e-3, 40.0, "dB", "below, rounding shows; above, an error says nothing")
BOUNCES = Limit(1, 12, "", "each bounce costs more and brings less; paths hold 12")
LAYERS = Limit(0, 16, "", "paths hold 16 layers")
TRACINGS = Limit(1, 4096, "", "each is a tracing of its own")
FRAMES = Limit(1, 100_000, "", "each is a run and a folder of its own")
INTERVAL = Limit(1e-9, 1e6, "s", "from frame to frame")
SEED = Limit(0, (1 << 63) - 1, "", "seeds are whole numbers of 63 bits")

EPS_R = Limit(1.0, 1e4, "", "of passive materials: 1 is vacuum, 80 water")
SIGMA = Limit(0.0, 1e9, "S/m", "of passive materials: silver has 6e7")
THICKNESS_MM = Limit(1e-3, 1e4, "mm", "a thinner layer is none, a thicker one opaque: leave the key out", above=True)
ROUGHNESS_MM = Limit(0.0, 1e3, "mm", "rms height of a surface, not of a landscape")
SCALE = Limit(1e-9, 1e9, "", "a factor on a mesh's size", above=True)
