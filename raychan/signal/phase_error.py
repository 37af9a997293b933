"""Phase errors of the chirp in the beat of each path: chirp error and phase noise.

One oscillator feeds transmitter and mixer. With its phase error phi the beat of a path of delay tau turns by
phi(t - tau) - phi(t): what is slow against tau cancels (range correlation). So the error belongs to each path; a
filter over finished samples would err near and far alike.

Many paths are summed in groups of equal delay tau_k, h apart. The turn exp(j [phi(t - tau) - phi(t)]) of a path is
interpolated between the four nearest groups (Lagrange), which for a part of phi at frequency f errs by at most
3/128 (2 pi f h)^4 of it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from raychan.radar.dual_paths import amplitudes_of, columns_of, scaled
from raychan.radar.impairments import ChirpError, PhaseNoise
from raychan.radar.radar import Radar
from raychan.radar.waveform import Waveform
from raychan.records import Cube, Paths
from raychan.signal.baseband import synthesize
from raychan.units import C0

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

METHODS = ("auto", "groups", "direct")
# Error of the groups against their number: of the phase noise at the edge of the band -20 dB, an octave below -44 dB.
# 1e5 paths in 9 groups take 5 to 9 times as long as without phase noise (python -m bench --only phase_noise).
_NOISE_SHARE = 0.1
_CHIRP_SHARE = 1e-4  # of an echo, -80 dB: error of the groups for the chirp error
_FEW = 4  # paths up to which the direct sum is taken: it costs about as much a path as a group; not measured
_OVER = 4  # grid points of the phase noise a sample: between them cubic interpolation errs by 1 % at the band's edge
_MOST = 1 << 26  # grid points of a draw: 0.5 GB, a frame of 0.4 s at 20 MHz
_MARGIN = 4  # grid points beyond both ends, for interpolation


class PhaseTrack:
    """Phase error of the oscillator over one frame: one draw of its phase noise, and the chirp error."""

    def __init__(
        self, wave: Waveform, noise: PhaseNoise | None, error: ChirpError | None, delays: tuple[float, float],
        rng: np.random.Generator,
    ) -> None:  # fmt: skip
        """Draw the phase noise. Args: delays [s], the least and the most for which `turn` is asked.

        It is Gaussian and has the power density of the mask up to half the sample rate: what lies beyond is cut by the
        low-pass filter before the converter.
        """
        self.wave, self.error = wave, error
        self.step = wave.chirp_duration / wave.n_samples
        self.fine = self.step / _OVER
        self.start = -max(delays[1], 0.0) - _MARGIN * self.fine
        end = wave.frame_duration - min(delays[0], 0.0) + _MARGIN * self.fine
        self.phase = None if noise is None else self._drawn(noise, end - self.start, rng)

    def _drawn(self, noise: PhaseNoise, duration: float, rng: np.random.Generator) -> Floats:
        """Return phase noise [rad] on the fine grid. The draw repeats after twice the time asked for.

        Raises: ValueError for a frame that is too long for its sample rate.
        """
        needed = math.ceil(duration / self.fine) + 1
        if 2 * needed > _MOST:
            raise ValueError(
                f"phase noise of a frame of {duration:.3g} s at {1e-6 / self.step:.3g} MHz needs {2 * needed:.2g} "
                f"points, {_MOST:.2g} at most: a shorter frame or fewer samples a ramp"
            )
        length = int(scipy.fft.next_fast_len(2 * needed, real=True))
        spacing = 1.0 / (length * self.fine)
        lines = np.arange(1, int(0.5 / self.step / spacing))
        draws = rng.standard_normal((len(lines), 2)).view(np.complex128)[:, 0]
        spectrum = np.zeros(length // 2 + 1, np.complex128)
        spectrum[lines] = np.sqrt(0.5 * noise.density(lines * spacing) * spacing) * draws
        return np.asarray(scipy.fft.irfft(spectrum, length, norm="forward")[:needed])

    def at(self, first: Any, delay: Any) -> Floats:
        """Return the phase error [rad] in samples (s,) of a ramp, or (c, s) of ramps.

        Args: first, the start of the ramp in the frame [s], or of all ramps (c, 1); delay, one or (c, s) [s], by which
        each is earlier.
        """
        t: Floats = np.arange(self.wave.n_samples) * self.step - delay
        found = np.zeros(t.shape) if self.error is None else self.error.phase(t)
        return found if self.phase is None else found + self._noise(first + t)

    def _noise(self, time: Floats) -> Floats:
        """Return the phase noise [rad] at times [s], by cubic interpolation of the draw."""
        assert self.phase is not None
        place = (time - self.start) / self.fine
        row = np.floor(place).astype(np.int64)
        weights = lagrange(place - row)
        return np.asarray(sum(w * self.phase[row + i - 1] for i, w in enumerate(weights)))

    def turn(self, delay: float, some: slice = slice(None)) -> Complexes:
        """Return exp(j [phi(t - delay) - phi(t)]) in all samples (chirps, samples) of a frame, or of some chirps;
        delay [s]. Without phase noise one chirp stands for all."""
        chirps = starts(self.wave)[slice(1) if self.phase is None else some]
        return np.asarray(np.exp(1j * (self.at(chirps, delay) - self.at(chirps, 0.0))))


def starts(wave: Waveform) -> Floats:
    """Return when the ramps (c, 1) of a frame start [s]."""
    return np.array([[wave.start_of(m)] for m in range(wave.n_chirps)])


def lagrange(u: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Return the weights of four equally spaced values for a place u, 0 to 1, between the middle two."""
    return (
        -u * (u - 1.0) * (u - 2.0) / 6.0,
        (u + 1.0) * (u - 1.0) * (u - 2.0) / 2.0,
        -(u + 1.0) * u * (u - 2.0) / 2.0,
        (u + 1.0) * u * (u - 1.0) / 6.0,
    )


@dataclass(frozen=True)
class Delays:
    """Delays [s] of the echoes of a frame: from `least` to `most` at its middle, within it by `drift` more to both
    sides, and up to `latest` at its start."""

    least: float
    most: float
    drift: float
    latest: float

    @staticmethod
    def of(paths: Paths, wave: Waveform) -> Delays:
        """Return those of paths; with zero, which is always among them."""
        middle, latest = _middle(paths, wave), float(paths.delay.max(initial=0.0))
        drift = float(np.abs(paths.length_rate).max(initial=0.0)) / C0 * wave.frame_duration
        return Delays(float(middle.min(initial=0.0)), float(middle.max(initial=0.0)), drift, latest)

    def beside(self, least: float, most: float) -> Delays:
        """Return them with echoes whose delays lie from `least` to `most` throughout the frame."""
        return Delays(min(self.least, least), max(self.most, most), self.drift, max(self.latest, most))


@dataclass(frozen=True)
class Oscillator:
    """What turns the beats of a frame: the straight part of its chirp error, which is a ramp of its own, and the rest
    of it with one draw of the phase noise."""

    wave: Waveform
    off: float
    """By how much [Hz] its carrier lies above that of the radar's waveform."""
    track: PhaseTrack
    spacing: float
    """How far apart [s] delays may be that it turns as one group; infinite without errors."""

    @staticmethod
    def of(radar: Radar, delays: Delays, rng: np.random.Generator) -> Oscillator:
        """Return a radar's, drawn for echoes of such delays."""
        noise, wave = radar.impairments.phase_noise, radar.waveform
        bent, bend = _straightened(wave, radar.impairments.chirp_error, delays.latest)
        h = spacing(wave, noise, bend)
        reach = 3.0 * h if np.isfinite(h) else 0.0
        span = delays.least - reach - delays.drift, delays.most + reach + delays.drift
        return Oscillator(bent, bent.carrier - wave.carrier, PhaseTrack(wave, noise, bend, span, rng), h)

    def groups(self, delay: Floats) -> Iterator[tuple[float, Floats]]:
        """Yield the delays [s] of groups, and the shares of echoes of delays (...) [s] in each, all in one without
        errors. A path is in four groups."""
        if not np.isfinite(self.spacing):
            yield 0.0, np.ones(delay.shape)
            return
        node = np.floor(delay / self.spacing).astype(np.int64)
        weights = lagrange(delay / self.spacing - node)
        for k in range(int(node.min(initial=0)) - 1, int(node.max(initial=-4)) + 3):
            share = np.zeros(delay.shape)
            for i, weight in enumerate(weights):
                share = np.where(node + i - 1 == k, weight, share)
            if share.any():
                yield k * self.spacing, share


def faulty(paths: Paths, radar: Radar, by: np.random.Generator | Oscillator, method: str = "auto") -> Cube:
    """Return the noise-free samples of paths under the radar's chirp error and phase noise.

    Args: by, the oscillator, or what draws it; method groups (see above), direct (each path for itself, exact but for
    the interpolated draw; slow), or auto: direct for few paths. Groups take each path's delay at the middle of the
    frame.
    Raises: ValueError on an unknown method.
    """
    if method not in METHODS:
        raise ValueError(f"method {method!r}: must be one of {', '.join(METHODS)}")
    wave = radar.waveform
    # Complex samples inside: of real ones the other half, by which the turn shows, would be lost.
    inner = replace(radar, noise=False, waveform=replace(wave, complex_sampling=True))
    oscillator = by if isinstance(by, Oscillator) else Oscillator.of(radar, Delays.of(paths, wave), by)
    # Amplitudes hold exp(-j 2 pi f_c tau_0) of the carrier as it should be.
    turned = scaled(paths, np.exp(-2j * np.pi * oscillator.off * paths.delay))
    straight = replace(inner, waveform=replace(oscillator.wave, complex_sampling=True))
    if method == "direct" or (method == "auto" and len(paths.delay) <= _FEW):
        total = _direct(turned, straight, oscillator.track)
    else:
        total = _grouped(turned, straight, oscillator, _middle(paths, wave))
    if not wave.complex_sampling:
        total.imag = 0.0
    return Cube(samples=total.astype(np.complex64), noise_power=0.0)


def _middle(paths: Paths, wave: Waveform) -> Floats:
    """Return the delays (n,) [s] of paths at the middle of the frame."""
    return np.asarray(paths.delay + paths.length_rate / C0 * wave.centre)


def spacing(wave: Waveform, noise: PhaseNoise | None, error: ChirpError | None) -> float:
    """Return how far apart the delays of groups may be [s]; infinite without errors."""
    edge = 0.0 if noise is None else 0.5 * wave.sample_rate
    peak = 0.0 if error is None else max(abs(f) for _, f in error.table)
    sizes = ((edge, _NOISE_SHARE), (peak, _CHIRP_SHARE))
    found = [(share * 128.0 / 3.0) ** 0.25 / (2.0 * np.pi * f) for f, share in sizes if f > 0.0]
    return min(found, default=math.inf)


class _BentRamp(Waveform):
    """The waveform with the straight part of a chirp error: it may lie beyond what a radar is asked for."""

    def _check_limits(self) -> None:
        pass


def _straightened(wave: Waveform, error: ChirpError | None, latest: float) -> tuple[Waveform, ChirpError | None]:
    """Return a waveform with the straight part of a chirp error in it, and what is left of the error, which is small:
    a line fitted to it is a ramp of another carrier and slope, which is summed exactly. Args: latest delay [s]."""
    if error is None:
        return wave, None
    t = np.arange(wave.n_samples) * wave.chirp_duration / wave.n_samples
    # Echoes bring the error of up to their delay before the ramp's first sample.
    times = np.unique([x for x, _ in error.table] + [-latest, t[0], t[-1]])
    b, a = np.polyfit(t, error.frequency(t), 1) if len(t) > 1 else (0.0, float(error.frequency(0.0)))
    rest = ChirpError(np.column_stack([times, error.frequency(times) - a - b * times]))
    line = {"carrier": wave.carrier + a, "bandwidth": wave.bandwidth + b * wave.chirp_duration}
    return _BentRamp(**vars(wave) | line), rest


def _grouped(paths: Paths, radar: Radar, oscillator: Oscillator, delay: Floats) -> Complexes:
    """Return the sum of paths in groups of equal delay, one at delay zero; delay (n,) [s] of each path."""
    if not np.isfinite(oscillator.spacing):
        return synthesize(paths, radar).samples.astype(np.complex128)
    total = _nothing(paths, radar)
    for at, share in oscillator.groups(delay):
        rows = np.flatnonzero(share)
        group = synthesize(_rows(paths, rows, share[rows]), radar)
        total += group.samples * oscillator.track.turn(at)
    return total


def _direct(paths: Paths, radar: Radar, track: PhaseTrack) -> Complexes:
    """Return the sum of paths one by one, each with its own delay at each instant."""
    wave, rate = radar.waveform, paths.length_rate / C0
    chirps = starts(wave)
    t = chirps + np.arange(wave.n_samples) * track.step
    now = track.at(chirps, 0.0)
    total = _nothing(paths, radar)
    for i in range(len(rate)):
        lone = synthesize(_rows(paths, slice(i, i + 1), 1.0), radar, method="direct")
        total += lone.samples * np.exp(1j * (track.at(chirps, paths.delay[i] + rate[i] * t) - now))
    return total


def _nothing(paths: Paths, radar: Radar) -> Complexes:
    """Return samples of no path."""
    return synthesize(_rows(paths, slice(0), 0.0), radar).samples.astype(np.complex128)


def _rows(paths: Paths, rows: slice | NDArray[np.int64], share: Floats | float) -> Paths:
    """Return some of the paths, their amplitudes times a share."""
    columns = {name: getattr(paths, name)[rows] for name in (*columns_of(paths), "trajectory")}
    columns |= {name: columns[name] * share for name in amplitudes_of(paths)}
    return replace(paths, **columns)
