"""Limits of numbers with unit and reason, and those of waveforms, receivers, antennas, air and diffuse scattering; all
others, for scene files, options and Python arguments, are in `raychan.world.limits`.

A number beyond them is a mistake (a wrong unit, a digit too many) or asks for physics that is not modelled.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from raychan.scalars import plain, shown


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
        ends = f"above {_exact(self.low)} and at most" if self.above else f"between {_exact(self.low)} and"
        return f"{ends} {_exact(self.high)}{unit}: {self.why}"

    @property
    def text(self) -> str:
        """The same as a clause."""
        return f"must lie {self.allowed}"

    def problem(self, value: Any, whole: bool = False) -> str:
        """Return what is wrong with a value that should be a number (a whole one, which a float may be) within the
        limits, or ''."""
        number = _of_whole(plain(value)) if whole else plain(value)
        if isinstance(number, bool) or not isinstance(number, int if whole else int | float):
            return f"{shown(value)}: a {'whole ' if whole else ''}number is wanted; {self.text}"
        return "" if self.allows(number) else f"{shown(value)}: {self.text}"

    def check(self, name: str, value: Any, whole: bool = False) -> Any:
        """Return a number (a whole one, as int) within the limits as Python's own. Raises: ValueError where it is
        none."""
        if problem := self.problem(value, whole):
            raise ValueError(f"{name} = {problem}")
        return _of_whole(plain(value)) if whole else plain(value)

    def times(self, factor: float, unit: str) -> Limit:
        """Return the same limits in another unit, smaller by a factor."""
        return Limit(self.low * factor, self.high * factor, unit, self.why, self.above)


def _of_whole(value: Any) -> Any:
    """Return a float that is a whole number as int, anything else as it is."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _exact(value: float) -> str:
    """Return a number in short form; a whole one with all digits where the short form is another number."""
    return f"{value:,}" if isinstance(value, int) and float(f"{value:g}") != value else f"{value:g}"


FREQUENCY = Limit(1e8, 1e12, "Hz", "below, bodies are no longer large in wavelengths; above, surfaces no longer smooth")
CARRIER_GHZ = FREQUENCY.times(1e-9, "GHz")
BANDWIDTH_MHZ = Limit(1e-3, 1e6, "MHz", "a range cell from 0.15 mm to 150 km; it must also be below the carrier")
RAMP_US = Limit(1e-3, 1e6, "us", "a ramp lasts between a nanosecond and a second")
SAMPLES = Limit(1, 1 << 20, "", "no radar samples a ramp more often")
NOISE_DB = Limit(0.0, 60.0, "dB", "no receiver is quieter than 290 K noise in, nor useful above 60 dB")
KELVIN = Limit(0.0, 1e5, "K", "what an antenna sees: 3 K of cold sky, 290 K of ground, more of the sun or a jammer")
CELSIUS = Limit(-100.0, 100.0, "deg C", "the air of this planet; is it kelvin?")
PRESSURE_HPA = Limit(0.0, 1100.0, "hPa", "the air of this planet; 1013 at sea level, 0 in vacuum; is it Pa?")
VAPOUR_GM3 = Limit(0.0, 100.0, "g/m3", "7.5 in the reference air, 17 in saturated air of 20 deg C")
RAIN_MMH = Limit(0.0, 400.0, "mm/h", "2 is light rain, 10 heavy, 100 a cloudburst; the heaviest minutes reach 400")
FOG_GM3 = Limit(0.0, 5.0, "g/m3", "0.05 where one sees 300 m, 0.5 where one sees 50 m")
LOSS_DB = Limit(-60.0, 100.0, "dB", "above, an antenna radiates nothing; below 0, it corrects a published gain")
DIFFUSE_DB = Limit(-120.0, 30.0, "dB", "sigma-nought of natural surfaces lies between")
EXPONENT = Limit(1, 50, "", "of a lobe: 1 is nearly Lambert's, 50 a few degrees wide")
CROSS_DB = Limit(0.0, 100.0, "dB", "the cross-polarised return is weaker than the co-polarised one")
K_SHAPE = Limit(0.01, 1000.0, "", "0.1 is spiky, 100 nearly Rayleigh")
TEXTURE_M = Limit(1e-3, 1e4, "m", "side of a square of one texture")
