"""Latitude and longitude of positions near an origin: the local tangent plane of the WGS84 ellipsoid.

A position is north and east [m] in the plane that touches the ellipsoid at the origin. It is carried to the
geocentric frame and from there to latitude, longitude; both steps are exact, no radius of curvature is taken as
constant. Its height is told as that above the plane, which is the sea to d^2 / 2R (8 cm at 1 km).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

SEMI_MAJOR_M, FLATTENING = 6_378_137.0, 1.0 / 298.257223563
"""WGS84. Source: NGA.STND.0036, 2014, table 3.1."""
_E2 = FLATTENING * (2.0 - FLATTENING)
_ROUNDS = 5
"""Rounds of the iteration for latitude; each gains a factor of about e^2 = 1/149 and more near the surface."""


@dataclass(frozen=True)
class Origin:
    """Where north = east = 0: latitude and longitude [deg], north and east positive.

    Raises: ValueError off the globe, or so near a pole (0.1 deg) that north and east lose their meaning.
    """

    latitude_deg: float
    longitude_deg: float

    def __post_init__(self) -> None:
        if not abs(self.latitude_deg) <= 89.9:
            raise ValueError(f"latitude is {self.latitude_deg} deg; allowed: -89.9 to 89.9")
        if not abs(self.longitude_deg) <= 180.0:
            raise ValueError(f"longitude is {self.longitude_deg} deg; allowed: -180 to 180")

    def to_globe(self, north: float, east: float) -> tuple[float, float]:
        """Return latitude and longitude [deg] of a point [m] of the tangent plane.

        With (phi, lambda) of the origin and e, n its unit vectors east and north: P = P0 + east e + north n, then
        longitude = atan2(Y, X), tan latitude = (Z + e^2 N sin latitude) / hypot(X, Y), N = a / sqrt(1 - e^2 sin^2).
        Source: Hofmann-Wellenhof, Lichtenegger and Wasle 2008, GNSS, section 8.2.1.
        """
        lat, lon = math.radians(self.latitude_deg), math.radians(self.longitude_deg)
        x, y, z = geocentric(self.latitude_deg, self.longitude_deg)
        x += -math.sin(lon) * east - math.sin(lat) * math.cos(lon) * north
        y += math.cos(lon) * east - math.sin(lat) * math.sin(lon) * north
        z += math.cos(lat) * north
        flat = math.hypot(x, y)
        latitude = math.atan2(z, flat * (1.0 - _E2))
        for _ in range(_ROUNDS):
            s = math.sin(latitude)
            latitude = math.atan2(z + _E2 * SEMI_MAJOR_M * s / math.sqrt(1.0 - _E2 * s * s), flat)
        return math.degrees(latitude), math.degrees(math.atan2(y, x))


def geocentric(latitude_deg: float, longitude_deg: float, height_m: float = 0.0) -> tuple[float, float, float]:
    """Return X, Y, Z [m] of a point given by latitude and longitude [deg] and height [m] above the ellipsoid.

    Source: as `Origin.to_globe`.
    """
    lat, lon = math.radians(latitude_deg), math.radians(longitude_deg)
    s = math.sin(lat)
    across = SEMI_MAJOR_M / math.sqrt(1.0 - _E2 * s * s)
    flat = (across + height_m) * math.cos(lat)
    return flat * math.cos(lon), flat * math.sin(lon), (across * (1.0 - _E2) + height_m) * s
