"""Where waves leave a radar and come back to it as what they meet moves on, and what its antennas give there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.channel.corner_rays import departures
from raychan.channel.drifts import source_velocities
from raychan.radar.array import wavefronts
from raychan.records import Facets, Routes

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


@dataclass(frozen=True)
class Aims:
    """The sources of routes' waves as both ends see them, over the mirrors on the way: of the transmitter's by
    reciprocity."""

    place: Floats
    """(n, 2, 3) [m] from transmitter and receiver at the time of tracing."""
    velocity: Floats
    """(n, 2, 3) [m/s] relative to these."""

    @staticmethod
    def of(routes: Routes, facets: Facets, radar: Any) -> Aims:
        """Return those of routes at a radar."""
        n = len(routes.kind)
        ends = [np.broadcast_to(x, (n, 1, 3)) for x in (routes.tx, routes.rx)]
        away, look = departures(routes)
        waves = wavefronts(
            np.concatenate([ends[0], routes.vertices, ends[1]], axis=1), routes.scatter, away, look, routes.length
        )
        place = np.stack([away * waves.tx_radius[:, None], look * waves.radius[:, None]], axis=1)
        return Aims(place, source_velocities(routes, facets, radar.velocity, radar.rx_motion))

    def __getitem__(self, rows: NDArray[Any]) -> Aims:
        return Aims(self.place[rows], self.velocity[rows])

    def gains(self, radar: Any, late: Floats) -> Complexes:
        """Return the factors (t, n) by which a radar's antennas change waves at instants (t,) [s] after the tracing."""
        out = np.ones((len(late), len(self.place)), np.complex128)
        for end, field in enumerate((radar.tx_field, radar.rx_field)):
            place, velocity = self.place[:, end], self.velocity[:, end]
            then = np.asarray(field(_unit(place)))
            power = (np.abs(then) ** 2).sum(axis=1)
            for factor, time in zip(out, late, strict=True):
                share = (np.asarray(field(_unit(place + time * velocity))) * then.conj()).sum(axis=1)
                factor *= np.divide(share, power, out=np.ones_like(share), where=power > 0.0)
        return out


def _unit(x: Floats) -> Floats:
    """Return the directions (n, 3) of vectors."""
    return x / np.maximum(np.linalg.norm(x, axis=1, keepdims=True), 1e-300)
