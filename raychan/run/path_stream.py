"""The paths of a launch as they come, batch by batch. Where they are too many to keep, they are added to the samples at
once, and the strongest stay to explain detections."""

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

MOST = 1 << 19  # routes held at once, some 300 bytes each: less memory against more sums
KEPT = 1 << 18  # strongest routes that stay where there are more than that


@dataclass(frozen=True)
class Launched:
    """What a launch brought: its `paths`, or the strongest of them where they were too many, of `count` in all."""

    paths: Paths
    count: int
    radar: Radar
    window: str
    """Along range, for the profile."""
    sums: tuple[Any, Any] | None = None
    """Samples and profile response of all paths, where they are known already: always if `paths` are not all."""

    known: Cube | None = None
    """Samples of all paths, where only these are known already."""

    said: tuple[str, ...] = ()
    """What else a user should know of them."""

    @cached_property
    def quiet(self) -> Cube:
        """The samples of all receivers and chirps, without noise."""
        if self.known is not None:
            return self.known
        if self.sums is None:
            return synthesize(self.paths, self.radar)
        return Cube(samples=self.sums[0].astype(np.complex64), noise_power=0.0)

    @cached_property
    def response(self) -> NDArray[np.complex128]:
        """The channel's response to one ramp (see signal.delay_profile)."""
        return _response(self.paths, self.radar, self.window) if self.sums is None else self.sums[1]

    @property
    def whole(self) -> bool:
        """Whether `paths` are all."""
        return len(self.paths.delay) == self.count

    def notes(self) -> list[str]:
        """Return what to tell of a launch, such as that it had more paths than a result can hold."""
        kept = len(self.paths.delay)
        if self.whole:
            return list(self.said)
        many = f"{self.count:,} paths: all are in the samples, the {kept:,} strongest are kept to explain them"
        return [*self.said, f"{many}, whose sums and shares lack what the others bring"]

    def moved(self, shift: NDArray[np.float64]) -> Launched:
        """Return the same for a scene that has moved on as one, by a shift (3,) [m]."""
        paths = self.paths
        trajectories = paths.trajectories.replace(vertices=(paths.trajectories.vertices + shift).astype(np.float32))
        there = paths.replace(trajectories=trajectories, tx=paths.tx + shift, rx=paths.rx + shift)
        return replace(self, paths=there, sums=(self.quiet.samples, self.response), known=None)


class PathStream:
    """Paths of a launch for a radar, whose profile has a window along range: `add` each batch, then `done`.

    Where there are more than `most` routes, the `kept` strongest stay.
    """

    def __init__(self, radar: Radar, window: str, most: int = MOST, kept: int = KEPT) -> None:
        self._most, self._most_kept = most, kept
        self._sensor, self._window = replace(radar, noise=False), window
        self._held: list[Paths] = []
        self._kept: list[Paths] = []
        self._sums: tuple[Any, Any] | None = None
        self._trajectories = self._count = 0

    def add(self, paths: Paths) -> None:
        """Add a batch."""
        self._held.append(paths)
        self._count += len(paths.delay)
        self._trajectories += len(paths.trajectories.kind)
        if self._trajectories > self._most:
            self._flush()

    def _flush(self) -> None:
        """Add the paths held to the sums of samples and response, and keep the strongest."""
        every = join(self._held)
        brought = synthesize(every, self._sensor).samples, _response(every, self._sensor, self._window)
        before = self._sums or (np.zeros(brought[0].shape, np.complex128), 0.0)
        self._sums = before[0] + brought[0], before[1] + brought[1]
        self._kept = [strongest(join([*self._kept, every]), self._most_kept)]
        self._held, self._trajectories = [], 0

    def done(self) -> Launched:
        """Return the paths of all batches; there must be at least one."""
        if self._sums is not None and self._held:
            self._flush()
        paths = join(self._kept or self._held)
        return Launched(paths, self._count, self._sensor, self._window, self._sums)


def _response(paths: Paths, radar: Radar, window: str) -> NDArray[np.complex128]:
    return response(paths, radar.waveform, radar.power, window)
