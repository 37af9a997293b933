"""What the ship's instruments say of it at a time between two frames of its loop: position, heading, attitude."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from datetime import datetime, timedelta

from raychan.hil import nmea
from raychan.hil.geodesy import Origin
from raychan.run.ship.loop import Frame, ShipLoop
from raychan.sensors.laser import Scanner


@dataclass(frozen=True)
class Reading:
    """The ship at `time` [s]: north, east, height [m]; heading, roll (starboard down is positive), pitch (bow up is
    positive), rudder [rad]; speed [m/s] and course [rad] over ground; rudder_sign as of a frame."""

    time: float
    north: float
    east: float
    height: float
    heading: float
    roll: float
    pitch: float
    rudder: float
    speed: float
    course: float
    rudder_sign: int


def reading(before: Frame, after: Frame, time: float) -> Reading:
    """Return the ship at a time [s], on the straight lines between two frames; angles take the shorter turn."""
    span = after.time - before.time
    share = (time - before.time) / span if span > 0.0 else 0.0
    north, east = after.north - before.north, after.east - before.east
    course = math.atan2(east, north) if north or east else before.heading

    def along(a: float, b: float) -> float:
        return a + share * (b - a)

    def turned(a: float, b: float) -> float:
        return a + share * math.remainder(b - a, math.tau)

    return Reading(
        time=time,
        north=along(before.north, after.north),
        east=along(before.east, after.east),
        height=along(before.z, after.z),
        heading=turned(before.heading, after.heading) % math.tau,
        roll=turned(before.roll, after.roll),
        pitch=0.0 - turned(before.pitch, after.pitch),
        rudder=along(before.rudder, after.rudder),
        speed=math.hypot(north, east) / span if span > 0.0 else 0.0,
        course=course % math.tau,
        rudder_sign=after.rudder_sign,
    )


class ScannedShip(ShipLoop):
    """A ship's loop whose scanner can change its fan under way."""

    def scan_with(self, scanner: Scanner) -> None:
        """Go on with another scanner from the scan that follows; ship, time and noise stay."""
        steered, steps, noise = self._steered, self._k, self._ranges
        super().__init__(replace(self.scene, scanner=scanner))
        self._steered, self._k, self._ranges = steered, steps, noise


@dataclass(frozen=True)
class Instruments:
    """Satellite receiver, compass, attitude sensor and rudder indicator: origin of the scene, and UTC of its 0 s."""

    origin: Origin
    epoch: datetime

    def place(self, at: Reading) -> tuple[float, float]:
        """Return latitude and longitude [deg]."""
        return self.origin.to_globe(at.north, at.east)

    def position(self, at: Reading) -> bytes:
        """Return `$GPRMC` and `$GPGGA`."""
        when = self.utc(at)
        fix = nmea.Fix(when.time(), *self.place(at), at.height)
        return nmea.rmc(fix, when.date(), at.speed, math.degrees(at.course)) + nmea.gga(fix)

    def heading(self, at: Reading) -> bytes:
        """Return `$HEHDT` of a gyro compass, and `$GPHDT` for gpsd, which drops the other."""
        degrees = math.degrees(at.heading)
        return nmea.hdt(degrees, "HE") + nmea.hdt(degrees)

    def attitude(self, at: Reading) -> bytes:
        """Return `$PASHR`, `$AGRSA` and `$PTNTHTM`."""
        angles = (math.degrees(a) for a in (at.heading, at.roll, at.pitch))
        attitude = nmea.Attitude(self.utc(at).time(), *angles)
        rudder = at.rudder_sign * math.degrees(at.rudder)
        return nmea.pashr(attitude) + nmea.rsa(rudder) + nmea.ptnthtm(attitude)

    def utc(self, at: Reading) -> datetime:
        """Return the time of a reading, to 10 ms as the sentences say it."""
        return self.epoch + timedelta(milliseconds=10 * round(100.0 * at.time))
