"""Footprints that become several paths: one for each corner, or one for each of the points of Filon's rule.

The phase integral's terms at corners carry a factor linear over the triangle without error. The phase that an element
of an array adds turns as exp(-j x): where x runs by 1 rad along an edge a linear factor is too weak by 1/12.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raychan.channel.corner_places import corner_places
from raychan.channel.ends import RadarEnds, ends_of
from raychan.channel.filon import filon, points_over
from raychan.channel.slow_time import APART, corner_rates
from raychan.channel.transfer import corner_gains
from raychan.columns import take
from raychan.radar.array import half_axes
from raychan.records import SCATTER, Facets, Routes
from raychan.units import C0

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Ints = NDArray[np.int64]
_SMALL = 1e-3
"""Of the noise in a map cell: by so much samples may be off for each footprint. Errors of footprints are unrelated: a
thousand in one cell add up to -30 dB of the noise."""
_TURN = 0.25
"""rad: footprints over which the phase at the outermost elements runs by more become a path for each corner, or for
each point of a rule: the corners leave a share x^2 / 12 of such a run x (other values not measured)."""
_FINEST = 1e-3
"""Of what a footprint scatters if all of it is in phase: nothing is known better, nor without noise. Echoes of a car
and a guard rail before 8 and 14 elements come out 22 and 26 dB under the noise from those of 1e-6; with 1e-4 28 and 27
dB for up to 1.4 times the paths; with 3e-3, for `_SMALL` too, 17 and 14 dB for 0.8 times."""


class Parts(NamedTuple):
    """Corners or points (p,) of footprints, each a path: its route, length [m], rate of length [m/s], gain (p, q) for
    q receivers, and place (p, e, 3) [m] (see `corner_places`)."""

    route: Ints
    length: Floats
    rate: Floats
    gain: Complexes
    place: NDArray[np.float32]


class _Corners(NamedTuple):
    """Footprints (r,) at whose corners something differs: routes (r,); gains (r, q, 3); twice their rates (r, 3) [m/s];
    places (r, 3, e, 3) [m]; and by how much the phase differs from corner a to b, b to c, c to a (r, 3) [rad]: at the
    outermost elements, and over the band and the frame."""

    route: Ints
    gain: Complexes
    rate: Floats
    place: NDArray[np.float32]
    run: Floats
    spread: Floats

    def some(self, rows: NDArray[Any]) -> _Corners:
        """Return some of the footprints."""
        return _Corners(*(column[rows] for column in self))


def several(
    routes: Routes, gains: Complexes, rate: Floats, facets: Facets, radar: RadarEnds, frequency: float, noise: float
) -> Parts:
    """Return the paths of the footprints that one path each would not do for, as `paths_of` takes its arguments.

    Args: gains (n, q, 3) of the corners of routes (n,); rate (n,) [m/s] of half the length.
    """
    scatters = (routes.scatter >= 0) & (routes.kind[np.arange(len(gains)), routes.scatter] == SCATTER)
    corner, rows = routes.lengths[:, :3], np.flatnonzero(scatters)
    places, turn, run = _at_elements(routes, rows, facets, radar, frequency)
    chosen = over_three(np.maximum, corner[rows]) - over_three(np.minimum, corner[rows]) > APART
    chosen |= over_three(np.maximum, turn) > _TURN
    rows, places, turn, run = rows[chosen], places[chosen], turn[chosen], run[chosen]
    corner, own = corner[rows], ends_of(radar)
    rates = 2.0 * corner_rates(routes, rows, facets, own.tx_velocity, own.rx_velocity)
    size = np.abs(gains[rows]).max(axis=1)
    apart = _spread(radar, np.abs(corner - routes.length[rows, None]), np.abs(rates - 2.0 * rate[rows, None]))
    tells = over_three(np.add, size * np.minimum(apart + turn, 2.0)) > _SMALL * noise
    after = [1, 2, 0]
    spread = _spread(radar, np.abs(corner - corner[:, after]), np.abs(rates - rates[:, after]))
    held = _Corners(rows, gains[rows], rates, places, run, spread)
    most = over_three(np.maximum, run)
    wide = np.flatnonzero(most > _TURN)
    strength = _strength(routes, rows[wide], facets, radar, frequency)
    level = over_three(np.add, np.abs(strength).max(axis=1))
    needs = level * share_lacking(most[wide]) > _SMALL * noise
    wide, strength, level = wide[needs], strength[needs], level[needs]
    tells[wide] = False
    part = np.clip(_SMALL * noise / np.maximum(level, 1e-300), _FINEST, 1.0)
    found = _corners(routes, held.some(tells)), _points(routes, held.some(wide), strength, part, frequency)
    both: Any = zip(*found, strict=True)
    return Parts(*(np.concatenate(x) for x in both))


def share_lacking(run: Floats) -> Floats:
    """Return the share (r,) by which the corners of footprints are wrong at elements where the phase runs by so much
    (r,) [rad] over each: at most all of it in place of its opposite."""
    return np.minimum(run**2 / 12.0, 2.0)


def over_three(how: np.ufunc, values: NDArray[Any]) -> NDArray[Any]:
    """Return what numbers (n, 3) come to, row by row; numpy's own way over an axis of three takes 15 to 60 times as
    long (5000 rows, load 5 of others, command not kept)."""
    found: NDArray[Any] = how(how(values[:, 0], values[:, 1]), values[:, 2])
    return found


def _at_elements(
    routes: Routes, rows: Ints, facets: Facets, radar: RadarEnds, frequency: float
) -> tuple[NDArray[np.float32], Floats, Floats]:
    """Return where the corners of footprints (r,) lie for elements, (r, 3, 2, 3) [m] as `corner_places` gives it, and
    by how much the phase at the outermost elements differs there from the centre's, and from corner to corner, (r, 3)
    [rad] each; where no element stands off the phase centres, (r, 3, 0, 3) and 0."""
    axes = 2.0 * np.pi * frequency / C0 * half_axes(radar)
    if not axes.any():
        none = np.zeros((len(rows), 3))
        return np.zeros((len(rows), 3, 0, 3), np.float32), none, none
    places, angles = corner_places(routes, rows, facets)
    seen = angles.reshape(len(rows), 3, 6) @ _blocks(axes)
    return places, np.abs(seen).sum(axis=2), np.abs(seen - seen[:, [1, 2, 0]]).sum(axis=2)


def _blocks(axes: Floats) -> Floats:
    """Return the matrix (6, 6) that takes the angles (6,) of both ends to phases along their axes (2, 3, 3)."""
    whole = np.zeros((6, 6))
    whole[:3, :3], whole[3:, 3:] = axes[0].T, axes[1].T
    return whole


def _spread(radar: Any, length: Floats, rate: Floats) -> Floats:
    """Return by how much the phase [rad] differs at the ends of the band and of the frame where lengths [m] and rates
    [m/s] do; 0 for ends without a waveform."""
    wave = getattr(radar, "waveform", None)
    if wave is None:
        return np.zeros(length.shape)
    return np.asarray(np.pi * (wave.bandwidth * length + wave.carrier * wave.frame_duration * rate) / C0)


def _strength(routes: Routes, rows: Ints, facets: Facets, radar: RadarEnds, frequency: float) -> Complexes:
    """Return what footprints (r,) scatter for q receivers if all of each is in phase, (r, q, 3) a third at each corner,
    without taper."""
    n = len(rows)
    bare: Any = take(routes, rows).replace(lengths=np.zeros((n, 6)), length=np.zeros(n), taper=np.ones((n, 3)))
    strength = corner_gains(bare, facets, radar, frequency)
    if facets.attenuation:
        strength *= np.exp(-facets.attenuation * routes.length[rows])[:, None, None]
    return strength


def _corners(routes: Routes, held: _Corners) -> Parts:
    """Return the corners of footprints, each a path."""
    n = 3 * len(held.route)
    return Parts(
        np.repeat(held.route, 3),
        routes.lengths[held.route, :3].ravel(),
        held.rate.ravel(),
        held.gain.swapaxes(1, 2).reshape(n, held.gain.shape[1]),
        held.place.reshape(n, *held.place.shape[2:]),
    )


def _points(routes: Routes, held: _Corners, strength: Complexes, part: Floats, frequency: float) -> Parts:
    """Return the points of footprints (r,) of such a strength (r, q, 3), of which a part (r,) may be wrong."""
    lengths, run = routes.lengths[held.route], held.run + held.spread
    count = points_over(run, part)
    bary, weight = filon(2.0 * np.pi * frequency / C0 * lengths, run, part, count)
    row = np.repeat(np.arange(len(count)), count)
    u, v, w = bary.T
    four = 4.0 * np.stack([u * v, v * w, w * u], axis=1)
    # Quadratic: that of the corners, less a half of the products of their neighbours, and the middles of edges.
    bend = lengths[:, 3:] - 0.5 * (lengths[:, :3] + lengths[:, [1, 2, 0]])
    length = (bary * lengths[row, :3]).sum(axis=1) + (four * bend[row]).sum(axis=1)
    weight *= (bary * routes.taper[held.route][row]).sum(axis=1)
    return Parts(
        held.route[row],
        length,
        np.einsum("pc,pc->p", bary, held.rate[row]),
        3.0 * np.einsum("pc,pqc->pq", bary, strength[row]) * weight[:, None],
        np.einsum("pc,pcex->pex", bary, held.place[row]).astype(np.float32),
    )
