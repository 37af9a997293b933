"""Gather: the paths of a launch as they come. What is too much to keep goes into samples at once, and the strongest
paths stay for those who ask where a return came from."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.channel.paths import join, strongest
from raychan.radar.radar import Radar
from raychan.records import Cube, Paths
from raychan.signal.baseband import synthesize
from raychan.signal.delay_profile import response

_MOST = 1 << 19  # ways held at once, some 300 bytes each
_KEPT = 1 << 18  # of those that were too many


@dataclass(frozen=True)
class Launched:
    """What a launch brought: its `paths`, or the strongest of them where they were too many, of `count` in all."""

    paths: Paths
    count: int
    radar: Radar
    window: str
    """Along range, for the profile."""
    told: tuple[Any, Any] | None = None
    """Samples and response of all paths, where they are known already: always if `paths` are not all."""

    @cached_property
    def quiet(self) -> Cube:
        """The samples of all receivers and chirps, without noise."""
        if self.told is None:
            return synthesize(self.paths, self.radar)
        return Cube(samples=self.told[0].astype(np.complex64), noise_power=0.0)

    @cached_property
    def response(self) -> NDArray[np.complex128]:
        """The channel's response to one ramp (see channel.profile)."""
        return _response(self.paths, self.radar, self.window) if self.told is None else self.told[1]

    @property
    def whole(self) -> bool:
        """Whether `paths` are all."""
        return len(self.paths.delay) == self.count

    def notes(self) -> list[str]:
        """Return what to tell of a launch that had more paths than a result can hold."""
        if self.whole:
            return []
        kept = len(self.paths.delay)
        return [f"{self.count:,} paths: all are in the samples, the {kept:,} strongest are kept to explain them"]

    def moved(self, shift: NDArray[np.float64]) -> Launched:
        """Return the same for a scene that has moved on as one, by a shift (3,) [m]."""
        paths = self.paths
        ways = paths.ways.replace(vertices=(paths.ways.vertices + shift).astype(np.float32))
        there = paths.replace(ways=ways, tx=paths.tx + shift, rx=paths.rx + shift)
        return replace(self, paths=there, told=(self.quiet.samples, self.response))


class PathStream:
    """Paths of a launch for a sensor, whose profile has a window along range: `add` each batch, then `done`."""

    def __init__(self, radar: Radar, window: str) -> None:
        self._sensor, self._window = replace(radar, noise=False), window
        self._held: list[Paths] = []
        self._kept: list[Paths] = []
        self._told: tuple[Any, Any] | None = None
        self._ways = self._count = 0

    def add(self, paths: Paths) -> None:
        """Add a batch."""
        self._held.append(paths)
        self._count += len(paths.delay)
        self._ways += len(paths.ways.kind)
        if self._ways > _MOST:
            self._tell()

    def _tell(self) -> None:
        """Put what is held into samples and response, and keep the strongest."""
        every = join(self._held)
        brought = synthesize(every, self._sensor).samples, _response(every, self._sensor, self._window)
        before = self._told or (np.zeros(brought[0].shape, np.complex128), 0.0)
        self._told = before[0] + brought[0], before[1] + brought[1]
        self._kept = [strongest(join([*self._kept, every]), _KEPT)]
        self._held, self._ways = [], 0

    def done(self) -> Launched:
        """Return what all batches, of which there must be one, bring."""
        if self._told is not None and self._held:
            self._tell()
        paths = join(self._kept or self._held)
        return Launched(paths, self._count, self._sensor, self._window, self._told)


def _response(paths: Paths, radar: Radar, window: str) -> NDArray[np.complex128]:
    return response(paths, radar.waveform, radar.power, window)
