"""Pieces of a frame from one tracing to the next, told by both and blended from one to the other; the whole of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.records import Cube, DiffractedRoutes, Paths, Routes
from raychan.units import C0
from raychan.world.scene import Scene

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Samples = NDArray[np.complexfloating[Any, Any]]


@dataclass(frozen=True)
class Retraced:
    """Samples of a frame with turning bodies, without noise."""

    samples: Samples
    """(antenna, chirp, sample) [sqrt(W)]."""
    turning: Samples
    """The part of them that turning bodies brought."""
    turns: NDArray[np.bool_]
    """Which bodies (b,) those are."""
    error: Samples
    """How wrong they may be, as neighbouring tracings differ."""
    times: tuple[float, ...]
    """When the scene was traced [s]."""
    rays: int
    reached: bool
    """Whether the error came under the tolerance."""

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
    """What one tracing of a scene gives."""

    paths: Paths
    routes: tuple[Routes | DiffractedRoutes, ...]


@dataclass(frozen=True)
class Keyframe:
    """One tracing: the routes that meet turning bodies, and the paths that do not."""

    chirp: int
    scene: Scene
    routes: tuple[Routes, ...]
    strengths: tuple[Complexes, ...]
    others: Paths


def reach(chirps: int) -> int:
    """Return how far a tracing is carried towards the next: both overlap over the middle half."""
    return -(-3 * chirps // 4)


@dataclass(frozen=True)
class Segment:
    """The chirps from one tracing to the next, both included: `a` and `b` (2, antenna, chirp, sample) are what both
    tell of the first and the last three quarters: bodies that turn, all others."""

    start: Keyframe
    end: Keyframe
    a: Samples
    b: Samples

    @property
    def chirps(self) -> int:
        """How many there are."""
        return self.end.chirp - self.start.chirp + 1

    def off(self) -> float:
        """Return the power of the error of a chirp, of bodies that turn."""
        return float((np.abs(self.doubt()[0]) ** 2).sum()) / self.chirps

    def blend(self) -> Samples:
        """Return samples (2, antenna, chirp, sample) that go from a to b over the chirps that both tell of."""
        count = self.chirps
        told, out = self.a.shape[2], np.zeros((*self.a.shape[:2], count, self.a.shape[3]), complex)
        share = np.clip((np.arange(count) - (count - told)) / max(2 * told - count - 1, 1), 0.0, 1.0)[:, None]
        out[:, :, :told] = (1.0 - share[:told]) * self.a
        out[:, :, -told:] += share[-told:] * self.b
        return out

    def doubt(self) -> Samples:
        """Return how wrong that may be: by as much as both differ, told of the chirps where both are known, for the
        power of the whole piece.

        What comes into sight at an instant between two tracings is wrong for 0.42 of the piece at most; what is chance
        in each launch differs from a tracing of every chirp by 0.92 of the power by which a and b differ.
        """
        count = self.chirps
        told, out = self.a.shape[2], np.zeros((*self.a.shape[:2], count, self.a.shape[3]), complex)
        both = 2 * told - count
        out[:, :, count - told : told] = np.sqrt(count / both) * (self.a[:, :, count - told :] - self.b[:, :, :both])
        return out


def joined(parts: list[Samples]) -> Samples:
    """Return one stretch of samples (2, antenna, chirp, sample) of stretches that share the chirps they meet at."""
    return np.concatenate([x[:, :, min(i, 1) :] for i, x in enumerate(parts)], axis=2)


def echoes(length: Floats, amplitude: Complexes, growth: Floats, place: Floats) -> Paths:
    """Return paths without a history, whose delays grow by `growth` [s/s]."""
    n = len(length)
    none, look = np.full((n, 1), -1, np.int16), np.zeros((n, 3))
    return Paths.of(
        length=length, amplitude=amplitude, length_rate=C0 * growth, departure=look, arrival=look, body=none, part=none,
        kind=np.zeros((n, 1), np.int8), vertices=np.zeros((n, 1, 3), np.float32), body_names=(), part_names=(),
        tx=place, rx=place,
    )  # fmt: skip
