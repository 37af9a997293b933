"""How far a cell's level would move if bodies stood a little aside: from the paths of one launch, to first order.

A body that turns by small angles about its middle and shifts moves each vertex on it; a path's length changes by the
scalar product of that and the difference of the path's directions before and after the vertex. Amplitudes are kept.
`raychan study sensitivity` runs the displaced scenes instead.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from raychan.columns import take
from raychan.records import MIRROR, TRANSMIT, Paths
from raychan.run.point_spread import PointSpread
from raychan.units import C0
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Complexes = NDArray[np.complexfloating]

TURN, SHIFT = math.radians(0.05), 1e-3
"""Standard deviations of a body's turn [rad] about, and of its shift [m] along, each axis: makers' tolerances."""
_DRAWS = 20
_MOST = 4000  # strongest paths of a cell that are moved: the rest stay
_LEAST = 1e-3  # of the strongest: weaker paths stay


def spreads_db(paths: Paths, geometry: Geometry, response: PointSpread, cells: Floats, carrier: float) -> Floats:
    """Return the standard deviation (c,) [dB] of the level of cells as bodies are displaced, over 20 draws.

    Args: cells (c, 3), each range [m] and rate [m/s] first; carrier [Hz].
    """
    rng = np.random.default_rng(0)
    bodies = len(geometry.facets.role)
    moves = (geometry.facets.role != MIRROR)[:, None]
    turn = TURN * rng.standard_normal((_DRAWS, bodies, 3)) * moves
    shift = SHIFT * rng.standard_normal((_DRAWS, bodies, 3)) * moves
    middle = geometry.extents.mean(axis=1)
    found = []
    for at_range, rate, *_ in cells:
        wave, _ = response.in_cell(paths.amplitude, paths.delay, paths.range_rate, float(at_range), float(rate))
        order = np.argsort(-np.abs(wave), kind="stable")[:_MOST]
        rows = order[np.abs(wave[order]) > _LEAST * np.abs(wave[order[:1]]).max(initial=0.0)]
        rest = wave.sum() - wave[rows].sum()
        moved = _turned(wave[rows], take(paths, rows), turn, shift, middle, carrier)
        level = 20.0 * np.log10(np.maximum(np.abs(moved + rest), 1e-300))
        found.append(float(level.std()))
    return np.array(found)


def _turned(wave: Complexes, paths: Paths, turn: Floats, shift: Floats, middle: Floats, carrier: float) -> Complexes:
    """Return the sums (draws,) of waves (n,) whose paths' bodies are displaced."""
    points, body, kind = paths.vertices.astype(float), paths.body, paths.kind
    steps = np.diff(points, axis=1)
    size = np.linalg.norm(steps, axis=2, keepdims=True)
    way = np.divide(steps, size, out=np.zeros_like(steps), where=size > 0.0)
    sums = np.zeros(len(turn), complex)
    for k in range(len(turn)):
        longer = np.zeros(len(wave))
        for slot in range(body.shape[1]):
            on = (kind[:, slot] > 0) & (kind[:, slot] != TRANSMIT)
            b = np.maximum(body[:, slot], 0)
            aside = shift[k, b] + np.cross(turn[k, b], points[:, slot + 1] - middle[b])
            # The next point that is not this one: unused slots repeat the receiver.
            longer += np.where(on, np.einsum("ni,ni->n", aside, way[:, slot] - way[:, slot + 1]), 0.0)
        sums[k] = (wave * np.exp(-2j * np.pi * carrier / C0 * longer)).sum()
    return sums
