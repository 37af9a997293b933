"""Segments of a frame between two keyframes (tracings): the samples extrapolated from both, blended, and their
error."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from raychan.channel.moving_directions import MovingDirections
from raychan.channel.slow_time import strengths
from raychan.columns import take
from raychan.radar.antenna import IsotropicAntenna
from raychan.radar.radar import Radar
from raychan.records import Cube, DiffractedRoutes, Facets, Paths, Routes
from raychan.signal.phase_error import Delays, Oscillator
from raychan.units import C0
from raychan.world.scene import Scene

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Samples = NDArray[np.complexfloating[Any, Any]]


class UnderPhaseErrors(Protocol):
    """The part of a frame's samples that comes from turning bodies, under phase errors."""

    def beside(self, delays: Delays) -> Delays:
        """Return delays of other echoes of the frame, with those of its own."""
        ...

    def samples(self, oscillator: Oscillator) -> Samples:
        """Return the samples (antenna, chirp, sample) as an oscillator turns them."""
        ...


@dataclass(frozen=True)
class Retraced:
    """Noise-free samples of a frame whose bodies turn, from several tracings, or pass fast, from one."""

    samples: Samples
    """(antenna, chirp, sample) [sqrt(W)]."""
    turning: Samples
    """The part of them that comes from turning bodies."""
    turns: NDArray[np.bool_]
    """Which bodies (b,) those are."""
    error: Samples
    """Their error, from the difference of neighbouring tracings."""
    times: tuple[float, ...]
    """When the scene was traced [s]."""
    rays: int
    reached: bool
    """Whether the error is under the tolerance."""
    again: UnderPhaseErrors | None = None
    """What makes the turning part again under phase errors, where the radar has any."""
    tracings: tuple[tuple[Paths, float], ...] = ()
    """Paths of each tracing, and how long [s] after the instant to which their delays refer it was made."""

    @property
    def once(self) -> bool:
        """Whether the frame was traced once, so that no other tracing tells its error."""
        return len(self.times) == 1

    @property
    def cube(self) -> Cube:
        """The samples of all receivers and chirps."""
        return Cube(samples=self.samples.astype(np.complex64), noise_power=0.0)

    def level(self) -> float:
        """Return the power of the error over that of the samples."""
        power = float((np.abs(self.samples) ** 2).sum())
        return float((np.abs(self.error) ** 2).sum()) / power if power > 0.0 else 0.0


@dataclass(frozen=True)
class Traced:
    """Paths and routes of one tracing of a scene."""

    paths: Paths
    routes: tuple[Routes | DiffractedRoutes, ...]


@dataclass(frozen=True)
class CarriedRoutes:
    """Routes that are carried on, with their `strengths` (n, 3), and their directions at both ends unless antennas are
    isotropic."""

    routes: Routes
    strengths: Complexes
    directions: MovingDirections | None

    @staticmethod
    def of(routes: Routes, facets: Facets, radar: Radar) -> CarriedRoutes:
        """Return routes at a radar."""
        isotropic = all(isinstance(antenna, IsotropicAntenna) for antenna in (radar.tx, radar.rx))
        directions = None if isotropic else MovingDirections.of(routes, facets, radar)
        return CarriedRoutes(routes, strengths(routes, facets, radar, radar.waveform.middle), directions)

    def __len__(self) -> int:
        return len(self.strengths)

    def __getitem__(self, rows: NDArray[Any]) -> CarriedRoutes:
        directions = None if self.directions is None else self.directions[rows]
        return CarriedRoutes(take(self.routes, rows), self.strengths[rows], directions)

    def apply_gains(self, amplitudes: Complexes, radar: Radar, late: Floats) -> None:
        """Multiply amplitudes (t, n, 3) by what the gains of antennas change until instants (t,) [s] after tracing."""
        if self.directions is not None:
            amplitudes *= self.directions.gains(radar, late)[:, :, None]


@dataclass(frozen=True)
class Keyframe:
    """One tracing at a chirp: the routes that meet turning bodies, the other paths, and all paths."""

    chirp: int
    scene: Scene
    routes: tuple[CarriedRoutes, ...]
    others: Paths
    paths: Paths
    since: int
    """The chirp to whose start the delays and phases of paths refer."""


def reach(chirps: int) -> int:
    """Return over how many chirps a keyframe is extrapolated towards the next: both overlap in the middle half."""
    return -(-3 * chirps // 4)


@dataclass(frozen=True)
class Segment:
    """The chirps from one keyframe to the next, both included. `a` (2, antenna, chirp, sample): samples extrapolated
    from the first keyframe over three quarters of the chirps, for bodies that turn and for all others; `b`: the same
    from the last keyframe backwards."""

    start: Keyframe
    end: Keyframe
    a: Samples
    b: Samples

    @property
    def chirps(self) -> int:
        """Number of chirps."""
        return self.end.chirp - self.start.chirp + 1

    def error_power(self) -> float:
        """Return the power of the error per chirp, of bodies that turn."""
        return float((np.abs(self.error()[0]) ** 2).sum()) / self.chirps

    def blend(self) -> Samples:
        """Return the samples (2, antenna, chirp, sample), going from a to b over the chirps of both."""
        count = self.chirps
        known, out = self.a.shape[2], np.zeros((*self.a.shape[:2], count, self.a.shape[3]), complex)
        share = np.clip((np.arange(count) - (count - known)) / max(2 * known - count - 1, 1), 0.0, 1.0)[:, None]
        out[:, :, :known] = (1.0 - share[:known]) * self.a
        out[:, :, -known:] += share[-known:] * self.b
        return out

    def error(self) -> Samples:
        """Return the error of the blend: the difference of a and b where both are known, scaled to the whole segment.

        An echo that appears between two keyframes is wrong over at most 0.42 of the segment. The random part of each
        launch differs from tracing every chirp by 0.92 of the power of the difference of a and b (command of this
        measurement not recorded).
        """
        count = self.chirps
        known, out = self.a.shape[2], np.zeros((*self.a.shape[:2], count, self.a.shape[3]), complex)
        both = 2 * known - count
        out[:, :, count - known : known] = np.sqrt(count / both) * (self.a[:, :, count - known :] - self.b[:, :, :both])
        return out


def joined(parts: list[Samples]) -> Samples:
    """Return samples (2, antenna, chirp, sample) joined in chirps; neighbours share the chirp at which they meet."""
    return np.concatenate([x[:, :, min(i, 1) :] for i, x in enumerate(parts)], axis=2)


def echoes(length: Floats, amplitude: Complexes, delay_rate: Floats, place: Floats) -> Paths:
    """Return paths without interactions, whose delays grow by `delay_rate` [s/s]."""
    n = len(length)
    none, look = np.full((n, 1), -1, np.int16), np.zeros((n, 3))
    return Paths.of(
        length=length, amplitude=amplitude, length_rate=C0 * delay_rate, departure=look, arrival=look, body=none,
        part=none, kind=np.zeros((n, 1), np.int8), vertices=np.zeros((n, 1, 3), np.float32), body_names=(),
        part_names=(), tx=place, rx=place,
    )  # fmt: skip
