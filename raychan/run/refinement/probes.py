"""Elements of an array at which levels are followed while a launch is refined.

A tube's corners, or its centre, reach all elements each from one place. Where a tube is large and near, the phase
across the array is known less well than the level at the phase centre.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.radar.radar import Radar
from raychan.records import Paths
from raychan.signal.baseband import stand_apart
from raychan.signal.fronts import fronts_of
from raychan.units import C0

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Probe:
    """A transmitter and a receiver: offsets (3,) [m] from the phase centres, world axes; carrier [Hz]."""

    tx: Floats
    rx: Floats
    carrier: float

    def seen(self, paths: Paths) -> Paths:
        """Return paths as these elements see them: with the phase of what is longer than between the phase centres, and
        spread as far."""
        longer, factor = fronts_of(paths).between(self.tx, self.rx)
        turn = factor * np.exp(-2j * np.pi * self.carrier / C0 * longer)
        return paths.rebuilt(amplitude=paths.amplitude * turn)


def probes_of(radar: Radar) -> tuple[Probe, ...]:
    """Return the two pairs of elements farthest apart along the virtual array; none of a radar of one element."""
    if not stand_apart(radar):
        return ()
    tx = np.array([one.offset for one in radar.transmissions])
    every = (tx[:, None] + radar.elements_world).reshape(-1, 3)
    off = every - every.mean(axis=0)
    along = off @ np.linalg.svd(off, full_matrices=False)[2][0]
    ends = (divmod(int(i), len(radar.elements_world)) for i in (along.argmin(), along.argmax()))
    return tuple(Probe(tx[i], radar.elements_world[j], radar.waveform.carrier) for i, j in ends)
