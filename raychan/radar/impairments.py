"""What a real receiver does wrong: chirp error, phase noise, I/Q imbalance, DC offset, a converter of few bits."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from raychan.radar.declared import check_declared, is_whole
from raychan.scalars import shown
from raychan.units import undb, watt

Floats = NDArray[np.float64]


def _table(name: str, rows: ArrayLike, least: int, pair: str) -> tuple[tuple[float, float], ...]:
    """Return pairs of finite numbers, the first of each rising."""
    wanted = f"{name}: at least {least} pair{'' if least == 1 else 's'} of finite numbers wanted, {pair}"
    try:
        table = np.array(rows, np.float64)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{wanted}; {shown(rows)} given") from None
    if not table.size:
        raise ValueError(f"{wanted}; none given")
    if table.ndim != 2 or table.shape[1] != 2 or len(table) < least or not np.isfinite(table).all():
        raise ValueError(f"{wanted}; {table.tolist()} given")
    if (np.diff(table[:, 0]) <= 0.0).any():
        raise ValueError(f"{name}: a first number does not rise; allowed: rows whose first numbers rise")
    return tuple((float(x), float(y)) for x, y in table)


@dataclass(frozen=True)
class PhaseNoise:
    """Phase noise of the oscillator by its mask: rows of offset from the carrier [Hz] and level L [dBc/Hz].

    Between offsets L is linear in dB over log offset; beyond the ends it stays as at the ends. One oscillator feeds
    transmitter and mixer, so a path of delay tau sees phi(t - tau) - phi(t).
    Raises: ValueError for a mask that rises with offset, or with offsets not positive and rising.
    """

    mask: tuple[tuple[float, float], ...]

    def __init__(self, mask: ArrayLike) -> None:
        rows = _table("PhaseNoise.mask", mask, 1, "[offset Hz, level dBc/Hz]")
        if rows[0][0] <= 0.0:
            raise ValueError(f"PhaseNoise.mask: an offset of {rows[0][0]:g} Hz; allowed: positive offsets")
        for (f0, low), (f1, high) in pairwise(rows):
            if high > low:
                raise ValueError(
                    f"PhaseNoise.mask: rises from {low:g} dBc/Hz at {f0:g} Hz to {high:g} dBc/Hz at {f1:g} Hz; "
                    "allowed: levels that fall with offset or stay, as those of oscillators do"
                )
        if rows[0][1] > 0.0:
            raise ValueError(f"PhaseNoise.mask: {rows[0][1]:g} dBc/Hz is above the carrier; allowed: at most 0")
        object.__setattr__(self, "mask", rows)

    def density(self, offset: ArrayLike) -> Floats:
        """Return the two-sided power density of phi [rad2/Hz] at offsets [Hz] of either sign: 10^(L/10).

        Source: IEEE Std 1139-2008 (L is half of the one-sided density of phi).
        """
        f, level = np.array(self.mask).T
        size = np.maximum(np.abs(np.asarray(offset, float)), f[0])
        return np.asarray(undb(np.interp(np.log(size), np.log(f), level)))

    def beat_density(self, offset: ArrayLike, delay: float) -> Floats:
        """Return the two-sided power density [1/Hz] of the beat of one path over its power: 4 sin2(pi f tau) S(f).

        Args: offset from the beat [Hz]; delay of the path [s].
        Source: range correlation, Budge and Burt, IEEE National Radar Conf., 1993.
        """
        return np.asarray(4.0 * np.sin(np.pi * np.asarray(offset) * delay) ** 2 * self.density(offset))


@dataclass(frozen=True)
class ChirpError:
    """Departure of a ramp from a straight line: rows of time from the start of sampling [s] and frequency error [Hz].

    Linear in between; before and after the table the error stays as at its ends. The same in each ramp.
    Raises: ValueError for fewer than two rows, or times that do not rise.
    """

    table: tuple[tuple[float, float], ...]

    def __init__(self, table: ArrayLike) -> None:
        object.__setattr__(self, "table", _table("ChirpError.table", table, 2, "[time s, frequency error Hz]"))

    def frequency(self, time: ArrayLike) -> Floats:
        """Return the frequency error [Hz] at times [s] in the ramp."""
        t, error = np.array(self.table).T
        return np.asarray(np.interp(np.asarray(time, float), t, error))

    def lowest(self, carrier: float, slope: float, duration: float) -> float:
        """Return the lowest frequency [Hz] of a ramp that errs so. Args: its carrier [Hz], slope [Hz/s], duration [s]
        of sampling."""
        times = np.clip([0.0, duration, *(t for t, _ in self.table)], 0.0, duration)
        return float((carrier + slope * times + self.frequency(times)).min())

    def phase(self, time: ArrayLike) -> Floats:
        """Return the phase error [rad] at times [s]: 2 pi times the integral of the frequency error from time 0."""
        return 2.0 * np.pi * (self._integral(np.asarray(time, float)) - self._integral(np.zeros(())))

    def _integral(self, time: Floats) -> Floats:
        t, error = np.array(self.table).T
        inner = np.concatenate([[0.0], np.cumsum(0.5 * (error[1:] + error[:-1]) * np.diff(t))])
        at = np.clip(time, t[0], t[-1])
        row = np.clip(np.searchsorted(t, at, side="right") - 1, 0, len(t) - 2)
        part = 0.5 * (error[row] + np.interp(at, t, error)) * (at - t[row])
        return np.asarray(inner[row] + part + np.interp(time, t, error) * (time - at))


@dataclass(frozen=True)
class Converter:
    """The analogue-to-digital converter, one each for I and Q.

    Args: bits; full_scale_dbm [dBm] of the sine as wide as all 2^bits steps, its amplitude A, referred to the antenna
    as the samples are. Zero is a level (mid-tread): levels run from -A to A - step, and A - step / 2 is the amplitude
    of the strongest sine that is not clipped. With 1 bit they are -A and 0: no comparator, whose levels are opposite.
    Raises: ValueError for bits beyond 1 to 24 or a full scale that is not finite.
    """

    bits: int
    full_scale_dbm: float

    def __post_init__(self) -> None:
        if not (is_whole(self.bits) and 1 <= self.bits <= 24):
            raise ValueError(f"Converter.bits = {shown(self.bits)}: a whole number from 1 to 24 wanted")
        check_declared(Converter, vars(self))

    @property
    def step(self) -> float:
        """Size of one step [sqrt(W)]."""
        return float(2.0 * np.sqrt(watt(self.full_scale_dbm)) / 2.0**self.bits)

    @property
    def snr_db(self) -> float:
        """Power of a full-scale sine over the noise of rounding [dB], 6.02 bits + 1.76 (Bennett, Bell Syst. Tech. J.
        27, 1948). That its upper crests clip, by up to a step, takes 1.5 dB more at 6 bits, 0.4 dB at 10."""
        return 20.0 * float(np.log10(2.0)) * self.bits + 10.0 * float(np.log10(1.5))

    def noise_power(self, complex_sampling: bool = True) -> float:
        """Return the noise of rounding in a sample [W]: step2 / 12, twice that for I and Q."""
        return self.step**2 / 12.0 * (2.0 if complex_sampling else 1.0)


@dataclass(frozen=True)
class Impairments:
    """Imperfections of a receiver; none by default.

    Args: chirp_error; phase_noise; converter; iq_gain_db [dB] and iq_phase_deg [deg] of Q relative to I;
    dc_offset_dbm [dBm], power of a constant in all samples, its phase 45 deg.
    Raises: ValueError for values not finite, or of another type.
    """

    chirp_error: ChirpError | None = None
    phase_noise: PhaseNoise | None = None
    converter: Converter | None = None
    iq_gain_db: float = 0.0
    iq_phase_deg: float = 0.0
    dc_offset_dbm: float | None = None

    def __post_init__(self) -> None:
        check_declared(Impairments, vars(self))

    @property
    def phase_errors(self) -> bool:
        """Whether the phase of the beat suffers."""
        return self.chirp_error is not None or self.phase_noise is not None

    @property
    def iq_balanced(self) -> bool:
        """Whether I and Q are alike and at right angles."""
        return self.iq_gain_db == 0.0 and self.iq_phase_deg == 0.0
