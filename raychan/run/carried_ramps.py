"""Samples of a tracing's routes at the chirps about it, as their bodies move on, with and without phase errors."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raychan.channel.slow_time import Poses
from raychan.radar.array import Transmission
from raychan.radar.radar import Radar
from raychan.radar.waveform import Waveform
from raychan.run.between_chirps import carried_between
from raychan.run.segments import CarriedRoutes, Keyframe, Segment, echoes, joined, reach
from raychan.signal.baseband import synthesize
from raychan.signal.dechirp import ramp_sums
from raychan.signal.phase_error import Delays, Oscillator
from raychan.units import C0

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Samples = NDArray[np.complexfloating[Any, Any]]

# Trade time against memory; single values not measured.
_AT_ONCE = 64  # chirps whose routes are held in memory at once
_FEW = 3_000_000  # samples times parts of routes up to which the plain sum is faster than a transform


class Pair(NamedTuple):
    """A transmitter and a receiver, (3,) [m] off the radar's place in world axes."""

    sent: Transmission
    element: Floats


@dataclass
class CarriedRamps:
    """What a radar receives of keyframes' routes at other chirps than theirs."""

    radar: Radar
    turns: NDArray[np.bool_]
    """Which bodies (b,) are carried on."""
    every: float = 1.0
    """Chirps from one computed pose to the next."""
    oscillator: Oscillator | None = None
    """By which routes that meet these bodies are turned."""
    least: float = 0.0
    """Delays [s] of these routes so far: the least and the most, and zero."""
    most: float = 0.0

    def both(self, key: Keyframe, first: int, last: int) -> Samples:
        """Return the samples (2, antenna, chirp, sample) of a keyframe's paths extrapolated to chirps first to last: of
        those that meet turning bodies, and of all others."""
        out = self._nothing(2, first, last)
        out[1] = self._others(key, first, last)
        self._carry(out[0], key, first)
        return out

    def turning(self, key: Keyframe, first: int, last: int) -> Samples:
        """Return the first half (1, antenna, chirp, sample) of `both`."""
        out = self._nothing(1, first, last)
        self._carry(out[0], key, first)
        return out

    def _nothing(self, halves: int, first: int, last: int) -> Samples:
        shape = halves, len(self.radar.elements), last - first + 1, self.radar.waveform.n_samples
        return np.zeros(shape, np.complex64)

    def _others(self, key: Keyframe, first: int, last: int) -> Samples:
        """Return the samples (antenna, chirp, sample) of paths that meet no turning body, at chirps first to last."""
        wave = self.radar.waveform
        delay_rate = key.others.length_rate / C0 * (first - key.since) * wave.repetition
        way = key.others.trajectories
        late = key.others.replace(
            length=key.others.length + C0 * delay_rate,
            amplitude=key.others.amplitude * np.exp(-2j * np.pi * wave.carrier * delay_rate),
            trajectories=way.replace(instant=way.instant + (key.since - first) * wave.repetition),
        )
        frame = dataclasses.replace(wave, n_chirps=last - first + 1)
        return synthesize(late, dataclasses.replace(self.radar, waveform=frame), first=first).samples

    def _carry(self, out: Samples, key: Keyframe, first: int) -> None:
        """Add to samples (antenna, chirp, sample) from a chirp on what routes bring that meet turning bodies."""
        for routes in key.routes:
            for sent in self.radar.transmissions:
                for layer, element in zip(out, self.radar.elements_world, strict=True):
                    rows = layer[sent.since(first).first :: sent.step]
                    rows += self.between(Pair(sent, element), routes, key, first, len(rows))

    def between(self, pair: Pair, carried: CarriedRoutes, key: Keyframe, first: int, count: int) -> Samples:
        """Return the samples (chirp, sample) of what routes of a keyframe bring from a transmitter to a receiver, in so
        many of its chirps, the first of them from chirp `first` on."""
        wave, sent = self.radar.waveform, pair.sent
        out = np.zeros((count, wave.n_samples), np.complex128)
        begin = first + sent.since(first).first
        for start in range(0, count, _AT_ONCE):
            # An instant more than chirps at both ends: rates are central differences.
            chirps = begin + sent.step * np.arange(start - 1, min(start + _AT_ONCE, count) + 1, dtype=float)
            at = chirps + middle_of(wave)
            lengths, amplitudes = carried_between(
                carried.routes, carried.strengths, partial(self.poses, key, pair), at, self.every, wave.middle
            )
            carried.apply_gains(amplitudes, key.scene.radar, (at - key.chirp) * wave.repetition)
            # Phases are those of the carrier, of ramps at whose middle the parts are so long.
            amplitudes *= np.sqrt(self.radar.power) * np.exp(2j * np.pi * wave.swept / C0 * lengths)
            brought = self._ramps(lengths, amplitudes, chirps)
            out[start : start + len(brought)] = brought * sent.code(chirps[1:-1])[:, None]
        return out

    def _ramps(self, lengths: Floats, amplitudes: Complexes, chirps: Floats) -> Samples:
        """Return the samples (chirp, sample) of all chirps (chirp + 2,) but the first and the last one, of parts
        (chirp + 2, n, 3) of routes with these lengths [m] at the middle of ramps."""
        wave, count = self.radar.waveform, len(chirps) - 2
        amplitudes = amplitudes[1:-1]
        parts = np.flatnonzero((amplitudes != 0.0).any(axis=0))
        delay = lengths.reshape(count + 2, -1)[:, parts] / C0
        delay_rate = (delay[2:] - delay[:-2]) / ((chirps[2] - chirps[0]) * wave.repetition)
        grown = middle_of(wave) * wave.repetition * delay_rate
        delay = delay[1:-1] - grown
        strength = amplitudes.reshape(count, -1)[:, parts] * np.exp(2j * np.pi * wave.carrier * grown)
        if not delay.size:
            return np.zeros((len(delay), wave.n_samples), np.complex128)
        self.least, self.most = min(self.least, float(delay.min())), max(self.most, float(delay.max()))
        if (by := self.oscillator) is None:
            return self._sums(wave, strength, delay, delay_rate)
        strength = strength * np.exp(-2j * np.pi * by.off * delay)
        step = int(chirps[1] - chirps[0])
        some = slice(int(chirps[1]), int(chirps[-2]) + 1, step)
        total = np.zeros((len(delay), wave.n_samples), np.complex128)
        for at, share in by.groups(delay):
            mine = share.any(axis=0)
            group = self._sums(by.wave, (strength * share)[:, mine], delay[:, mine], delay_rate[:, mine])
            total += group * by.track.turn(at, some)
        return total

    def _sums(self, wave: Waveform, strength: Complexes, delay: Floats, delay_rate: Floats) -> Complexes:
        """Return the samples (chirp, sample) of echoes (chirp, n) of so many delays [s] at each ramp of a waveform."""
        if strength.shape[1] * wave.n_samples <= _FEW:
            waves, d, g = np.ascontiguousarray(strength), np.ascontiguousarray(delay), np.ascontiguousarray(delay_rate)
            step = wave.chirp_duration / wave.n_samples
            return np.asarray(ramp_sums(waves, d, g, wave.carrier, wave.slope, step, wave.n_samples))
        one, here = alone(self.radar, wave, 1, wave.repetition), np.zeros(3)
        return np.stack(
            [
                synthesize(echoes(*row, here), one).samples[0, 0]
                for row in zip(C0 * delay, strength, delay_rate, strict=True)
            ]
        )

    def poses(self, key: Keyframe, pair: Pair, chirps: Floats) -> Poses:
        """Return the poses of bodies and of a pair of elements at chirps, relative to a keyframe."""
        late = (chirps - key.chirp) * self.radar.waveform.repetition
        motions, radar = [b.motion for b in key.scene.bodies], key.scene.radar
        turn = np.broadcast_to(np.eye(3), (len(late), len(motions), 3, 3)).copy()
        for b in np.flatnonzero(self.turns):
            turn[:, b] = motions[b].poses(late)[0] @ motions[b].rotation().T
        origin = np.array([m.origin() for m in motions])
        there = radar.position + late[:, None] * radar.velocity
        return Poses(
            origin=origin,
            turn=turn,
            place=np.stack([m.poses(late)[1] for m in motions], axis=1),
            tx=there + pair.sent.offset,
            rx=there + pair.element,
        )


def middle_of(wave: Waveform) -> float:
    """Return how far after its start the middle sample of a ramp is, in chirps."""
    return wave.swept / wave.slope / wave.repetition


def alone(radar: Radar, wave: Waveform, chirps: int, repetition: float) -> Radar:
    """Return a radar of one element at its phase centre, with so many chirps of a waveform at equal distances [s]."""
    wave, here = (
        dataclasses.replace(wave, n_chirps=chirps, repetition=repetition, complex_sampling=True),
        np.zeros((1, 3)),
    )
    single: dict[str, Any] = {"elements": here, "tx_elements": here, "multiplexing": "none", "ddm_slots": None}
    return dataclasses.replace(radar, **single, waveform=wave, power=1.0)


@dataclass(frozen=True, eq=False)
class MadeAgain:
    """The keyframes of a frame, from which its samples are made again as an oscillator turns them."""

    keys: tuple[Keyframe, ...]
    ramps: CarriedRamps
    """That made the samples without phase errors."""

    def beside(self, delays: Delays) -> Delays:
        """Return the delays of a frame's paths and of the echoes here."""
        return delays.beside(self.ramps.least, self.ramps.most)

    def samples(self, oscillator: Oscillator) -> Samples:
        """Return the samples (antenna, chirp, sample) of what meets turning bodies under phase errors."""
        made = dataclasses.replace(self.ramps, oscillator=oscillator)
        parts = []
        if len(self.keys) == 1:
            parts.append(made.turning(self.keys[0], 0, self.ramps.radar.waveform.n_chirps - 1))
        for start, end in pairwise(self.keys):
            far = reach(end.chirp - start.chirp)
            a = made.turning(start, start.chirp, start.chirp + far)
            b = made.turning(end, end.chirp - far, end.chirp)
            parts.append(Segment(start, end, a, b).blend())
        whole: Samples = joined(parts)[0]
        return whole if self.ramps.radar.waveform.complex_sampling else whole.real.astype(complex)
