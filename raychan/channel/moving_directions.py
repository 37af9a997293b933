"""Directions of departure and arrival as what waves meet moves on, and the gains of antennas there."""

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
class MovingDirections:
    """Where transmitter and receiver see each route's scatterer, over mirrors on the way, and how it moves there."""

    place: Floats
    """(n, 2, 3) [m] from transmitter and receiver at the time of tracing."""
    velocity: Floats
    """(n, 2, 3) [m/s] relative to these."""

    @staticmethod
    def of(routes: Routes, facets: Facets, radar: Any) -> MovingDirections:
        """Return those of routes at a radar."""
        n = len(routes.kind)
        ends = [np.broadcast_to(x, (n, 1, 3)) for x in (routes.tx, routes.rx)]
        away, look = departures(routes)
        waves = wavefronts(
            np.concatenate([ends[0], routes.vertices, ends[1]], axis=1), routes.scatter, away, look, routes.length
        )
        place = np.stack([away * waves.tx_radius[:, None], look * waves.radius[:, None]], axis=1)
        return MovingDirections(place, source_velocities(routes, facets, radar.velocity, radar.rx_motion))

    def __getitem__(self, rows: NDArray[Any]) -> MovingDirections:
        return MovingDirections(self.place[rows], self.velocity[rows])

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
