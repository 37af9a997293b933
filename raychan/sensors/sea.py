"""A wavy sea: a sum of travelling waves whose spectrum is stated, and where rays first meet it.

Height at (x, y) and time t: z = sum a cos(k_x x + k_y y - w t + e) over components of amplitude a, wave vector k,
angular frequency w with w^2 = g k (deep water), and phase e. Heights add linearly: no breaking, no sharpened crests.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.columns import Record, column
from raychan.compile.jit import njit

Floats = NDArray[np.float64]

GRAVITY = 9.81
_LOW, _HIGH = 0.6, 4.0  # of the peak frequency: 99.5 % of a Pierson-Moskowitz sea's variance lies between
_ON = 1e-9  # height [m] over the surface at which a ray has met it


@dataclass(frozen=True)
class SeaState:
    """What a sea's spectrum is.

    Fields: significant_height [m], 4 sqrt(m0); peak_period [s]; gamma peak enhancement, 1 a fully developed sea
    (Pierson and Moskowitz), 3.3 the mean of JONSWAP; heading [rad] towards which waves run, from +x to +y; spread:
    whether directions vary as cos^2 within 90 deg of it.
    Raises: ValueError for figures that no sea has.
    """

    significant_height: float
    peak_period: float
    gamma: float = 1.0
    heading: float = 0.0
    spread: bool = True

    def __post_init__(self) -> None:
        if not (0.0 <= self.significant_height < math.inf and 0.0 < self.peak_period < math.inf):
            raise ValueError("significant_height, peak_period; allowed: at least 0 m, above 0 s")
        if not (1.0 <= self.gamma <= 7.0 and math.isfinite(self.heading)):
            raise ValueError(f"gamma is {self.gamma}, heading {self.heading} rad; allowed: gamma from 1 to 7")

    def spectrum(self, frequency: Floats) -> Floats:
        """Return the spectral density (n,) [m^2 s] of the height at angular frequencies (n,) [rad/s].

        S = 5/16 H^2 w_p^4 w^-5 exp(-5/4 (w_p/w)^4), for gamma > 1 times (1 - 0.287 ln gamma) gamma^r with
        r = exp(-(w - w_p)^2 / (2 s^2 w_p^2)), s = 0.07 up to the peak w_p and 0.09 above.
        Source: Pierson and Moskowitz 1964, J. Geophys. Res. 69, 5181-5190; Hasselmann et al. 1973 (JONSWAP); in this
        form DNV-RP-C205, section 3.5.5.
        """
        w, peak = np.asarray(frequency, float), 2.0 * math.pi / self.peak_period
        ratio = (peak / w) ** 4
        density = 0.3125 * self.significant_height**2 * ratio / w * np.exp(-1.25 * ratio)
        width = np.where(w <= peak, 0.07, 0.09) * peak
        raised = self.gamma ** np.exp(-0.5 * ((w - peak) / width) ** 2)
        return np.asarray(density * (1.0 - 0.287 * math.log(self.gamma)) * raised)


@dataclass(frozen=True)
class Waves(Record):
    """Components of a sea; m components."""

    amplitude: Floats = column("m", unit="m")
    wave_x: Floats = column("m", unit="rad/m")
    wave_y: Floats = column("m", unit="rad/m")
    frequency: Floats = column("m", unit="rad/s")
    phase: Floats = column("m", unit="rad")

    def at(self, time: float) -> Waves:
        """Return the sea whose time 0 is `time` [s] of this one."""
        return self.rebuilt(phase=np.mod(self.phase - self.frequency * time, 2.0 * math.pi))

    def height(self, x: Floats, y: Floats, time: Floats | float = 0.0) -> Floats:
        """Return the height (...) [m] of the surface at places (...) [m] and times (...) [s]."""
        x, y, t = (np.asarray(v, float)[..., None] for v in (x, y, time))
        return np.asarray(
            (self.amplitude * np.cos(self.wave_x * x + self.wave_y * y - self.frequency * t + self.phase)).sum(-1)
        )

    def normal(self, x: Floats, y: Floats, time: Floats | float = 0.0) -> Floats:
        """Return the upward unit normal (..., 3) of the surface at places (...) [m] and times (...) [s]."""
        x, y, t = (np.asarray(v, float)[..., None] for v in (x, y, time))
        sine = self.amplitude * np.sin(self.wave_x * x + self.wave_y * y - self.frequency * t + self.phase)
        up = np.stack([sine @ self.wave_x, sine @ self.wave_y, np.ones(sine.shape[:-1])], axis=-1)
        return np.asarray(up / np.linalg.norm(up, axis=-1, keepdims=True))


def waves(state: SeaState, rng: np.random.Generator, count: int = 48) -> Waves:
    """Return a sea of a state: `count` waves of random phases and directions, at random within equal steps of log w.

    Frequencies reach from 0.6 to 4 times the peak; the amplitudes a = sqrt(2 S dw) are scaled so that the sum of
    a^2 / 2 is m0 = (significant_height / 4)^2. Time grows with the count; fewer repeat sooner (not measured).
    Source: Longuet-Higgins 1952, J. Marine Research 11, 245-266; spreading cos^2: DNV-RP-C205, section 3.5.8.
    """
    if count < 1:
        raise ValueError(f"{count} waves; allowed: at least 1")
    step = math.log(_HIGH / _LOW) / count
    frequency = _LOW * np.exp(step * (np.arange(count) + rng.uniform(size=count))) * 2.0 * math.pi / state.peak_period
    power = state.spectrum(frequency) * frequency * step
    m0 = (0.25 * state.significant_height) ** 2
    amplitude = np.sqrt(2.0 * power * (m0 / power.sum() if m0 > 0.0 else 0.0))
    # The distribution of cos^2 is (theta + sin theta cos theta) / pi + 1/2, inverted by a table.
    off = np.linspace(-0.5, 0.5, 2001) * math.pi
    share = (off + np.sin(off) * np.cos(off)) / math.pi + 0.5
    heading = state.heading + np.interp(rng.uniform(size=count), share, off) * state.spread
    number = frequency**2 / GRAVITY
    return Waves(
        amplitude=amplitude,
        wave_x=number * np.cos(heading),
        wave_y=number * np.sin(heading),
        frequency=frequency,
        phase=rng.uniform(0.0, 2.0 * math.pi, count),
    )


def flat_sea_range(origin: Floats, towards: Floats) -> Floats:
    """Return the distance (n,) [m] from points (n, 3) along unit directions (n, 3) to the plane z = 0; inf from below
    or looking up: height over the sine of the angle of depression."""
    down = -towards[:, 2]
    hits = (down > 0.0) & (origin[:, 2] > 0.0)
    return np.divide(origin[:, 2], down, out=np.full(len(down), np.inf), where=hits)


def wavy_sea_range(
    sea: Waves, origin: Floats, towards: Floats, time: Floats, reach: Floats, together: int = 1
) -> Floats:
    """Return the distance (n,) [m] at which rays first meet a wavy sea, inf from below it and beyond reach.

    Args: origin (n, 3) [m]; towards (n, 3) unit; time (n,) [s] of each; reach (n,) [m] to which they are followed;
    together: so many rows after each other are of one time and near each other, which saves time.
    """
    parts = np.stack([sea.amplitude, sea.wave_x, sea.wave_y, sea.frequency, sea.phase])
    rays = (np.ascontiguousarray(x, float) for x in (origin, towards, time, reach))
    found: Floats = _wave_hits(parts, *rays, together)
    return found


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _sums(amplitude, start, rate, s):  # type: ignore[no-untyped-def]
    """Return sum a cos(start + rate s) and its slope along s; by polynomials, which compilers turn into vectors.

    An angle within a turn is quartered, its sine and cosine are Taylor's to the 13th and 14th power (2e-14), then
    doubled twice.
    """
    height, slope = 0.0, 0.0
    for i in range(len(amplitude)):
        turns = (start[i] + rate[i] * s) * (0.5 / math.pi)
        x = (turns - math.floor(turns + 0.5)) * (0.5 * math.pi)
        y = x * x
        sine = 1.0 - y / 110.0 * (1.0 - y / 156.0)
        sine = x * (1.0 - y / 6.0 * (1.0 - y / 20.0 * (1.0 - y / 42.0 * (1.0 - y / 72.0 * sine))))
        cosine = 1.0 - y / 90.0 * (1.0 - y / 132.0 * (1.0 - y / 182.0))
        cosine = 1.0 - y / 2.0 * (1.0 - y / 12.0 * (1.0 - y / 30.0 * (1.0 - y / 56.0 * cosine)))
        for _ in range(2):
            sine, cosine = 2.0 * sine * cosine, 1.0 - 2.0 * sine * sine
        height += amplitude[i] * cosine
        slope -= amplitude[i] * rate[i] * sine
    return height, slope


@njit(cache=True, nogil=True, error_model="numpy")
def _first_root(amplitude, start, rate, z, rise, begin, reach):  # type: ignore[no-untyped-def]
    """Return the distance at which a ray of height z + rise s first meets the surface after `begin`, inf beyond
    `reach`, -1 where the ray is below it at the beginning.

    With f the height over the surface, |f'| never exceeds L = |rise| + sum a |rate|, nor |f''| C = sum a rate^2: the
    ray is above the surface for f / L, and up to the root of f + f' h - C h^2 / 2. Steps of the longer of both pass no
    root, and near one they are Newton's: a dozen to a beam.
    """
    top, fastest, bend = 0.0, abs(rise), 0.0
    for i in range(len(amplitude)):
        top += amplitude[i]
        fastest += amplitude[i] * abs(rate[i])
        bend += amplitude[i] * rate[i] * rate[i]
    s = begin
    if z > top and rise < 0.0:
        s = max(s, (z - top) / -rise)
    while s <= reach:
        height, slope = _sums(amplitude, start, rate, s)
        f, down = z + rise * s - height, slope - rise
        if f < _ON:
            return s if f > -_ON or s > begin else -1.0
        if rise >= 0.0 and z + rise * s > top:
            return np.inf
        root = math.sqrt(down * down + 2.0 * bend * f)
        h = 2.0 * f / (down + root) if down >= 0.0 else (root - down) / bend
        s += max(h, f / fastest)
    return np.inf


@njit(cache=True, nogil=True, error_model="numpy")
def _begin(parts, origin, towards, time, reach):  # type: ignore[no-untyped-def]
    """Return a distance before which none of a few rays (k, 3) of one time meets the surface.

    Up to s all are within e + b s of the first one, over which height above the surface changes by no more than
    G = |(1, sum a |k|)| times that: a ray lower by so much meets the surface before any of them.
    """
    amplitude, wave_x, wave_y, frequency, phase = parts
    start = wave_x * origin[0, 0] + wave_y * origin[0, 1] - frequency * time + phase
    rate = wave_x * towards[0, 0] + wave_y * towards[0, 1]
    steep = math.sqrt(1.0 + (amplitude * np.sqrt(wave_x**2 + wave_y**2)).sum() ** 2)
    beside, apart = 0.0, 0.0
    for i in range(1, len(origin)):
        beside = max(beside, math.sqrt(((origin[i] - origin[0]) ** 2).sum()))
        apart = max(apart, math.sqrt(((towards[i] - towards[0]) ** 2).sum()))
    lowered = origin[0, 2] - steep * beside, towards[0, 2] - steep * apart
    return max(0.0, _first_root(amplitude, start, rate, lowered[0], lowered[1], 0.0, reach.max()))


@njit(cache=True, nogil=True, error_model="numpy")
def _wave_hits(parts, origin, towards, time, reach, together):  # type: ignore[no-untyped-def]
    """Return the distance (n,) of rays on waves (5, m); see `wavy_sea_range`."""
    amplitude, wave_x, wave_y, frequency, phase = parts
    n, m, begin = len(origin), len(amplitude), 0.0
    start, rate = np.empty(m), np.empty(m)
    distance = np.full(n, np.inf)
    for i in range(n):
        if together > 1 and i % together == 0:
            few = slice(i, i + together)
            begin = _begin(parts, origin[few], towards[few], time[i], reach[few])
        (x, y, z), (dx, dy, dz) = origin[i], towards[i]
        for k in range(m):
            start[k] = wave_x[k] * x + wave_y[k] * y - frequency[k] * time[i] + phase[k]
            rate[k] = wave_x[k] * dx + wave_y[k] * dy
        s = _first_root(amplitude, start, rate, z, dz, begin, reach[i])
        if s >= 0.0:
            distance[i] = s
    return distance
