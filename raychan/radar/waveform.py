"""Waveform: a frame of equal linear frequency ramps, at equal or staggered distances, and what it can tell apart.

The dechirped sample of a path of delay tau at time t after the start of ramp m is, with propagation exp(-j 2 pi f tau),

    x(m, t) = a exp(-j 2 pi [f_c (tau - tau_0) + S t tau - S tau^2 / 2]),   tau = tau_0 + 2 v (m T_r + t) / c,

where a is the path's amplitude at the start of the frame, which already holds exp(-j 2 pi f_c tau_0).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from raychan.limits import BANDWIDTH_MHZ, FREQUENCY, RAMP_US, SAMPLES, Limit
from raychan.radar.declared import check_declared, reals
from raychan.units import C0

Floats = NDArray[np.float64]
Complexes = NDArray[np.complexfloating[Any, Any]]

MOST_FOLDS = 64
"""Folds of a rate that are tested at most."""

_RAMP = RAMP_US.times(1e-6, "s")
_LIMITS = {
    "carrier": FREQUENCY,
    "bandwidth": BANDWIDTH_MHZ.times(1e6, "Hz"),
    "chirp_duration": _RAMP,
    # Every ramp of a channel: up to 64 transmitters or slots take turns.
    "repetition": Limit(_RAMP.low, 64.0 * _RAMP.high, "s", "a ramp lasts at most a second"),
    "n_samples": SAMPLES,
}


@runtime_checkable
class OwnWaveform(Protocol):
    """A waveform of one's own: a subclass of `Waveform` that says what is received and how it is compressed in range.

    The inherited figures say what it can tell apart: carrier, bandwidth (that of the range cell c/2B), chirp_duration
    (of one repetition's samples), repetition, n_chirps (repetitions), n_samples.
    """

    def received(self, amplitude: Complexes, delay: Floats, delay_rate: Floats) -> Complexes:
        """Return samples (n_chirps, n_samples) of echoes (n,): amplitude and delay [s] at the start of the frame,
        delay_rate the change of the delay per time; the amplitude holds the phase of the carrier there."""
        ...

    def compressed(self, samples: Complexes) -> Complexes:
        """Return the range profile (..., n_chirps, n_samples) of samples (..., n_chirps, n_samples), a range cell each
        from range 0 on, scaled so that a lone echo reads its amplitude."""
        ...


@dataclass(frozen=True)
class Waveform:
    """A frame of `n_chirps` equal linear frequency ramps, `n_samples` samples in each; SI units.

    Raises: ValueError for values that cannot be, are beyond the limits of scene files, or are of another type.

    >>> wave = Waveform(carrier=77e9, bandwidth=1e9, chirp_duration=25e-6)
    >>> round(wave.range_resolution, 3), round(wave.unambiguous_rate, 1)
    (0.15, 38.9)
    """

    carrier: float
    """Frequency at the start of the sampled part of the ramp [Hz]."""
    bandwidth: float
    """Frequency swept while sampling [Hz], below the carrier: from there up, a ramp spans less than an octave."""
    chirp_duration: float
    """Time that is sampled in a ramp [s]."""
    repetition: float = None  # type: ignore[assignment]
    """Time from ramp to ramp [s]; by default chirp_duration: ramps without a pause."""
    n_chirps: int = 128
    n_samples: int = 256
    complex_sampling: bool = True
    """I/Q sampling; else real."""
    stagger: tuple[float, ...] = ()
    """Times [s] from ramp to ramp in turn, in place of `repetition`, which becomes their mean."""

    def __post_init__(self) -> None:
        check_declared(Waveform, vars(self))
        try:
            object.__setattr__(self, "stagger", tuple(map(float, reals("Waveform.stagger", self.stagger))))
        except (TypeError, ValueError):
            raise ValueError(f"Waveform.stagger = {self.stagger!r}: times [s] wanted, as (25e-6, 31e-6)") from None
        if self.stagger:
            self._check_stagger()
            object.__setattr__(self, "repetition", sum(self.stagger) / len(self.stagger))
        if self.repetition is None:
            object.__setattr__(self, "repetition", self.chirp_duration)
        self._check_limits()
        if self.n_chirps < 1:  # a spectrogram has more than the most of a frame
            raise ValueError(f"Waveform.n_chirps = {self.n_chirps!r}: must be 1 or more")
        if self.repetition < self.chirp_duration * (1.0 - 1e-9):
            raise ValueError(
                f"Waveform.repetition = {self.repetition:g} s: shorter than chirp_duration = {self.chirp_duration:g} s"
            )

    def _check_limits(self) -> None:
        for name, limit in _LIMITS.items():
            limit.check(f"Waveform.{name}", getattr(self, name))
        if self.bandwidth >= self.carrier:
            raise ValueError(
                f"Waveform.bandwidth = {self.bandwidth:g} Hz: must be below the carrier of {self.carrier:g} Hz"
            )

    def _check_stagger(self) -> None:
        for number, time in enumerate(self.stagger):
            _RAMP.check(f"Waveform.stagger[{number}]", time)
        least = self.chirp_duration * (1.0 - 1e-9)
        if any(not (math.isfinite(t) and t >= least) for t in self.stagger):
            raise ValueError(
                f"Waveform.stagger = {self.stagger!r}: each at least the chirp's {self.chirp_duration:g} s"
            )
        if self.n_chirps % len(self.stagger):
            raise ValueError(
                f"Waveform.n_chirps = {self.n_chirps}: a multiple of the {len(self.stagger)} staggered times"
            )
        mean = sum(self.stagger) / len(self.stagger)
        if self.repetition is not None and abs(self.repetition - mean) > 1e-9 * mean:
            raise ValueError("Waveform: either repetition or stagger")

    def start_of(self, chirp: int) -> float:
        """Return the time [s] from the start of the frame to that of a ramp."""
        if not self.stagger:
            return chirp * self.repetition
        rounds, rest = divmod(chirp, len(self.stagger))
        return rounds * sum(self.stagger) + sum(self.stagger[:rest])

    @property
    def fold_count(self) -> int:
        """How many times farther than those of every K-th ramp rates are told apart by K staggered times: their sum
        over their greatest common divisor (to the nanosecond), 64 at most; 1 without stagger."""
        if not self.stagger:
            return 1
        steps = [round(1e9 * t) for t in self.stagger]
        return min(sum(steps) // math.gcd(*steps), MOST_FOLDS)

    def every(self, step: int) -> Waveform:
        """Return the waveform of every `step`-th ramp. Raises: ValueError if the ramps are no multiple of it."""
        if step == 1:
            return self
        if self.n_chirps % step:
            raise ValueError(
                f"{self.n_chirps} chirps cannot be shared among {step} transmitters or Doppler slots: "
                f"a multiple of {step} is wanted"
            )
        return replace(self, n_chirps=self.n_chirps // step, repetition=step * self.repetition, stagger=())

    @property
    def slope(self) -> float:
        """Frequency over time of the ramp [Hz/s]."""
        return self.bandwidth / self.chirp_duration

    @property
    def sample_rate(self) -> float:
        """Samples over time within a ramp [Hz]."""
        return self.n_samples / self.chirp_duration

    @property
    def wavelength(self) -> float:
        """Wavelength of the carrier [m]."""
        return C0 / self.carrier

    @property
    def middle(self) -> float:
        """Frequency at the middle sample of a ramp [Hz]: what turns a Doppler shift into the range rate of a map. Gains
        are those of this frequency."""
        return self.carrier + self.swept

    @property
    def swept(self) -> float:
        """Frequency swept from a ramp's start to its middle sample [Hz]."""
        return 0.5 * self.bandwidth * (1.0 - 1.0 / self.n_samples)

    @property
    def range_resolution(self) -> float:
        """c/2B: the range cell of a rectangular window [m]."""
        return C0 / (2.0 * self.bandwidth)

    @property
    def rate_resolution(self) -> float:
        """lambda/(2 M T_r): the range-rate cell of a rectangular window [m/s], nominal, by the carrier."""
        return self.wavelength / (2.0 * self.n_chirps * self.repetition)

    @property
    def unambiguous_range(self) -> float:
        """Range at which the beat folds [m]: f_s c/2S with I/Q, half of it with real sampling."""
        return self.range_resolution * self.n_samples / (1.0 if self.complex_sampling else 2.0)

    @property
    def unambiguous_rate(self) -> float:
        """lambda/(4 T_r): range rates between plus and minus this do not fold [m/s], nominal, by the carrier."""
        return self.wavelength / (4.0 * self.repetition)

    @property
    def resolved_rate(self) -> float:
        """Range rates between plus and minus this are told apart [m/s], nominal: by staggered times those up to the
        rate of their greatest common divisor, else `unambiguous_rate`."""
        return self.unambiguous_rate * self.fold_count / max(len(self.stagger), 1)

    @property
    def frame_duration(self) -> float:
        """Time from the first ramp's start to the end of the last repetition [s]."""
        return self.n_chirps * self.repetition

    @property
    def centre(self) -> float:
        """Middle of all sample instants [s]: the time to which the map's ranges and phases refer."""
        step = self.chirp_duration / self.n_samples
        return 0.5 * ((self.n_chirps - 1) * self.repetition + (self.n_samples - 1) * step)
