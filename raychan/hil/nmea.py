"""NMEA 0183 sentences of position (GGA, RMC), heading (HDT), attitude (PASHR, PTNTHTM) and rudder (RSA).

Check sums and framing are by pynmeagps, which is imported when used. Angles in degrees, time in UTC.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import date, time

_GPS_FIX, _GEOID_M = 1, "0.0"
_KNOT = 1852.0 / 3600.0


@dataclass(frozen=True)
class Fix:
    """A position: UTC time; latitude and longitude [deg], north and east positive; height [m]; satellites; HDOP."""

    at: time
    latitude_deg: float
    longitude_deg: float
    height_m: float
    satellites: int = 8
    hdop: float = 1.0


@dataclass(frozen=True)
class Attitude:
    """An attitude: UTC time; heading [deg] from true north, clockwise; roll [deg], port side up is positive; pitch
    [deg], bow up is positive. Roll and pitch are Tait-Bryan angles, in the order heading, pitch, roll."""

    at: time
    heading_deg: float
    roll_deg: float
    pitch_deg: float


def gga(fix: Fix) -> bytes:
    """Return `$GPGGA` with seven decimals of a minute (0.2 mm).

    Raises: ValueError for a position off the globe, NaN or infinity.
    """
    ns, lat, ew, lon = _place(fix)
    height = f"{_finite(fix.height_m):.3f}"
    fields = [_clock(fix.at), lat, ns, lon, ew, str(_GPS_FIX), f"{fix.satellites:02d}", f"{_finite(fix.hdop):.1f}"]
    return _sentence("GP", "GGA", [*fields, height, "M", _GEOID_M, "M", "", ""])


def rmc(fix: Fix, on: date, speed: float, course_deg: float) -> bytes:
    """Return `$GPRMC`: the position of a fix with its date, speed [m/s] and course [deg] over ground.

    Raises: ValueError as `gga`, and for a speed or course that is NaN or infinity.
    """
    ns, lat, ew, lon = _place(fix)
    motion = [f"{_finite(speed) / _KNOT:.3f}", _heading(course_deg), f"{on:%d%m%y}"]
    return _sentence("GP", "RMC", [_clock(fix.at), "A", lat, ns, lon, ew, *motion, "", "", "A"])


def rsa(rudder_deg: float) -> bytes:
    """Return `$AGRSA`, the angle of a single rudder [deg]; negative turns the bow to port (NMEA 0183, RSA)."""
    angle = round(_finite(rudder_deg), 2) + 0.0  # no -0.00
    return _sentence("AG", "RSA", [f"{angle:.2f}", "A", "", "V"])


def hdt(heading_deg: float, talker: str = "GP") -> bytes:
    """Return the heading [deg] as `$GPHDT`: gpsd 3.22 reads GP, and drops HE without a word."""
    return _sentence(talker, "HDT", [_heading(heading_deg), "T"])


def pashr(attitude: Attitude) -> bytes:
    """Return `$PASHR` in OxTS form: time, heading, T, roll, pitch, heave, three deviations (0), quality.

    Not last in a cycle: gpsd's reports of the fix suffer.
    """
    angles = [f"{_finite(a):+.3f}" for a in (attitude.roll_deg, attitude.pitch_deg)]
    fields = [_clock(attitude.at), _heading(attitude.heading_deg), "T", *angles, "+0.00"]
    return _sentence("P", "ASHR", [*fields, "0.000", "0.000", "0.000", str(_GPS_FIX), "1"])


def ptnthtm(attitude: Attitude) -> bytes:
    """Return `$PTNTHTM`, of which gpsd takes heading, pitch and roll; each is followed by its status, N (normal).

    Dip angle and strength of the magnetic field are not simulated: 0.
    Source: gpsd, driver_nmea0183.c, processTNTHTM.
    """
    pitch, roll = (f"{_finite(a):.3f}" for a in (attitude.pitch_deg, attitude.roll_deg))
    return _sentence("P", "TNTHTM", [_heading(attitude.heading_deg), "N", pitch, "N", roll, "N", "0.0", "0"])


def _sentence(talker: str, name: str, fields: list[str]) -> bytes:
    from pynmeagps import calc_checksum

    content = ",".join([talker + name, *fields])
    return f"${content}*{calc_checksum(content)}\r\n".encode("ascii")


def _place(fix: Fix) -> tuple[str, str, str, str]:
    """Return hemisphere and angle, north or south and then east or west."""
    ns, lat = ("S" if fix.latitude_deg < 0.0 else "N"), _minutes(fix.latitude_deg, 90.0, 2)
    ew, lon = ("W" if fix.longitude_deg < 0.0 else "E"), _minutes(fix.longitude_deg, 180.0, 3)
    return ns, lat, ew, lon


def _clock(at: time) -> str:
    return f"{at:%H%M%S}.{at.microsecond // 10_000:02d}"


def _finite(value: float) -> float:
    if not math.isfinite(value):
        raise ValueError(f"value is {value}; allowed: a finite number")
    return value


def _heading(degrees: float) -> str:
    text = f"{_finite(degrees) % 360.0:.3f}"
    return "0.000" if text == "360.000" else text


def _minutes(degrees: float, most: float, digits: int) -> str:
    """Return degrees as ddmm.mmmmmmm (digits 2) or dddmm.mmmmmmm (3), without a sign."""
    if not abs(degrees) <= most:
        raise ValueError(f"angle is {degrees} deg; allowed: -{most} to {most}")
    # Counted in units of the last decimal, so that rounding never shows 60 minutes.
    whole, rest = divmod(round(abs(degrees) * 60e7), 600_000_000)
    return f"{whole:0{digits}d}{rest // 10_000_000:02d}.{rest % 10_000_000:07d}"
