"""What a tracing's routes bring over many ramps, from few instants: as bodies move on, what turns them against paths of
constant rates is smooth in slow time.

Each part of a route is a path of constant rate times a factor, a sum of Chebyshev's polynomials of slow time, so that
the samples are a few sums over such paths, each times its polynomial, in place of one sum a chirp. Parts whose factor
is not such a sum are carried on chirp by chirp.
"""

from __future__ import annotations

import dataclasses
from functools import cached_property
from typing import Any

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebval
from numpy.typing import NDArray

from raychan.channel.slow_time import extrapolated
from raychan.radar.array import Transmission
from raychan.radar.radar import Radar
from raychan.run.carried_ramps import CarriedRamps, Pair, alone, middle_of
from raychan.run.segments import CarriedRoutes, Keyframe, echoes
from raychan.signal.baseband import synthesize
from raychan.units import C0

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Ints = NDArray[np.int64]
Samples = NDArray[np.complexfloating[Any, Any]]

_DEGREES = 8, 16, 32  # of the polynomials, tried in order; others not measured
_TAIL = 1e-5  # of a part's amplitude, in its last two polynomials: then it is a sum of these; others not measured
_LEAST = 1e-7  # of the root of all parts' power: what counts of a polynomial; with 1e-10 sums do not change at -92 dB
_SUM = 1e-6  # error of the sums, of all amplitudes (that of `synthesize`)
_GAIN = 2  # chirps a polynomial from which on these sums are tried; with 4 scenes of 64 and 128 take as long


class SmoothRamps(CarriedRamps):
    """What a radar receives of keyframes' routes at other chirps, summed over polynomials where they are such sums."""

    def between(self, pair: Pair, carried: CarriedRoutes, key: Keyframe, first: int, count: int) -> Samples:
        """Return the samples (chirp, sample) of what routes of a keyframe bring from a transmitter to a receiver, in so
        many of its chirps, the first of them from chirp `first` on."""
        out = np.zeros((count, self.radar.waveform.n_samples), np.complex128)
        if self.oscillator is None and self.every == 1.0:
            chirps = first + pair.sent.since(first).first + pair.sent.step * np.arange(count)
            for degree in (d for d in _DEGREES if d * _GAIN < count):
                parts = _Parts.of(carried, self, key, pair, degree, chirps)
                fits = parts.fit()
                out += parts.sums(self.radar, pair.sent, fits, chirps)
                carried = carried[~fits]
                if not len(carried):
                    return out
        return out + super().between(pair, carried, key, first, count)


@dataclasses.dataclass
class _Parts:
    """Parts (n, 3) of routes as paths of constant rate: lengths [m] at the first of some chirps and their growth [m]
    in a chirp of the frame, with factors (degree + 1, n, 3) of Chebyshev's polynomials of slow time, and those of these
    factors times how much longer [m] the parts are."""

    length: Floats
    growth: Floats
    factors: Complexes
    longer: Complexes

    @staticmethod
    def of(carried: CarriedRoutes, ramps: CarriedRamps, key: Keyframe, pair: Pair, degree: int, chirps: Ints) -> _Parts:
        """Return the parts of routes by their lengths and amplitudes at the extrema of the last polynomial."""
        wave = ramps.radar.waveform
        last = chirps[-1] - chirps[0]
        middle = middle_of(wave)
        to_factors = _to_polynomials(degree)
        at = middle + 0.5 * last * (1.0 - np.cos(np.pi * np.arange(degree + 1) / degree))
        poses = ramps.poses(key, pair, chirps[0] + at)
        lengths, amplitudes = extrapolated(carried.routes, carried.strengths, poses, wave.middle)
        carried.apply_gains(amplitudes, key.scene.radar, (chirps[0] + at - key.chirp) * wave.repetition)
        ramps.least, ramps.most = min(ramps.least, lengths.min() / C0), max(ramps.most, lengths.max() / C0)
        growth = (lengths[-1] - lengths[0]) / last
        length = lengths[0] - middle * growth
        k = 2.0 * np.pi * wave.middle / C0
        for now, amplitude, away in zip(at, amplitudes, lengths, strict=True):
            even = length + now * growth
            amplitude *= np.exp(1j * k * even)
            away -= even
        # Within a ramp what lies off the even length moves an echo along range by itself, and by its rate.
        faster = np.tensordot(_slopes(degree) @ to_factors * (2.0 / last / wave.repetition), lengths, 1)
        lengths += wave.middle * wave.chirp_duration / wave.bandwidth * faster
        factors, longer = (np.tensordot(to_factors, x, 1) for x in (amplitudes, amplitudes * lengths))
        return _Parts(length, growth, factors, longer)

    @cached_property
    def size(self) -> Floats:
        """The greatest factor (n, 3) of each part."""
        return np.asarray(np.abs(self.factors).max(axis=0))

    @cached_property
    def least(self) -> float:
        """The least factor that counts."""
        return _LEAST * float(np.linalg.norm(self.size))

    def fit(self) -> NDArray[np.bool_]:
        """Return which routes (n,) are sums of the polynomials."""
        tail = np.abs(self.factors[-2:]).max(axis=0)
        return np.asarray((tail <= np.maximum(_TAIL * self.size, self.least)).all(axis=1))

    def sums(self, radar: Radar, sent: Transmission, fits: NDArray[np.bool_], chirps: Ints) -> Complexes:
        """Return the samples (chirp, sample) of what some routes (n,) bring in a transmitter's chirps (chirp,)."""
        wave, rows = radar.waveform, fits[:, None] & (self.size > 0.0)
        growth, first = self.growth[rows], self.length[rows]
        turn = np.sqrt(radar.power) * np.exp(-2j * np.pi * wave.carrier / C0 * first)
        one = alone(radar, wave, len(chirps), sent.step * wave.repetition)
        # Of what the sweep turns beyond its middle the first order counts: it moves an echo along range.
        swept = 2.0 * np.pi / C0 * wave.bandwidth
        along = -1j * swept * ((np.arange(wave.n_samples) + 0.5) / wave.n_samples - 0.5)
        total = self.size[rows].sum()
        found = np.zeros((len(chirps), wave.n_samples), np.complex128)
        here, angle = np.zeros(3), np.arccos(2.0 * (chirps - chirps[0]) / (chirps[-1] - chirps[0]) - 1.0)
        for factors, across, weight in ((self.factors, 1.0, 1.0), (self.longer, along, 0.5 * swept)):
            for j, each in enumerate(factors[:, rows]):
                counts = np.flatnonzero(weight * np.abs(each) > self.least)
                if not len(counts):
                    continue
                brought = (each * turn)[counts]
                paths = echoes(first[counts], brought, growth[counts] / (C0 * wave.repetition), here)
                rough = min(1e-2, max(_SUM, _SUM * total / (weight * np.abs(each[counts]).sum())))
                samples = synthesize(paths, one, tolerance=rough).samples[0]
                found += np.cos(j * angle)[:, None] * across * samples
        return found * sent.code(chirps)[:, None]


def _slopes(degree: int) -> Floats:
    """Return the matrix (degree + 1, degree + 1) from factors of polynomials to the slopes of their sum at the extrema
    of the last one, the least place first."""
    at = -np.cos(np.pi * np.arange(degree + 1) / degree)
    return np.stack([chebval(at, chebder(one)) for one in np.eye(degree + 1)], axis=1)


def _to_polynomials(degree: int) -> Floats:
    """Return the matrix (degree + 1, degree + 1) from values at the extrema of the last of Chebyshev's polynomials,
    the least place first, to the factors of all (Trefethen 2013, Approximation Theory and Practice, ch. 3)."""
    j, half = np.arange(degree + 1), np.where(np.isin(np.arange(degree + 1), (0, degree)), 0.5, 1.0)
    # The least place is that of angle pi.
    table: Floats = np.cos(np.pi * np.outer(j, degree - j) / degree) * half * half[:, None] * 2.0 / degree
    return table
