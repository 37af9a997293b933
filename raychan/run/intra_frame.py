"""What changes within a frame that constant rates and the levels of one instant do not hold: an entry of the ledger."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.radar.radar import Radar
from raychan.records import MIRROR, Facets, Paths
from raychan.run.ledger import NOTHING, Entry
from raychan.units import C0, db

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_NEAR = 0.5  # m: nothing counts as nearer; not measured
_ARM = 2.5  # m: lever arm of turning bodies, of a vehicle (not measured)
_STRONG = 1e-3  # of the strongest path's amplitude


def intra_frame(paths: Paths, facets: Facets, radar: Radar) -> Entry:
    """Return the entry of changes within a frame: for crossing and turning bodies the phase deviates by at most
    k a T^2 / 4, a being the radial acceleration, of a radar with receivers elsewhere the mean of both ends'; amplitudes
    fall as the length L of a path grows: those of its middle differ from their mean by (L' T / L)^2 / 4, those of its
    start by L' T / L."""
    frame = radar.waveform.frame_duration
    if not len(paths.delay):
        return Entry(NOTHING, "exact", "no path")
    size = np.abs(paths.amplitude)
    strong = np.flatnonzero(size > _STRONG * size.max())
    nearest = np.full(len(paths.trajectories.kind), np.inf)
    np.minimum.at(nearest, paths.trajectory[strong], 0.5 * paths.length[strong])
    bend = _bend(paths, np.flatnonzero(np.isfinite(nearest)), nearest, facets, radar)
    phase = 2.0 * np.pi * radar.waveform.middle / C0 * bend * frame**2 / 4.0
    grown = float((np.abs(paths.length_rate[strong]) * frame / paths.length[strong]).max())
    when, off = ("middle", 0.25 * grown**2) if facets.since else ("start", grown)
    how = (
        f"at most {phase:.2g} rad of unmodelled phase over the frame, amplitudes of its {when} within {off:.2%} of "
        "their mean over it; level relative to the echo that has it"
    )
    return Entry(float(db(max(phase, off, 1e-15) ** 2)), "bound", how)


def _bend(paths: Paths, taken: Ints, nearest: Floats, facets: Facets, radar: Radar) -> float:
    """Return the largest radial acceleration [m/s^2] of what some trajectories meet; nearest (w,) [m] of each path."""
    way = paths.trajectories
    body = way.body[taken]
    used = (body >= 0) & (facets.role[np.maximum(body, 0)] != MIRROR)
    body = np.maximum(body, 0)
    if radar.rx_position is None:
        ends = [(radar.velocity, way.departure, np.broadcast_to(nearest[taken, None], body.shape))]
    else:
        sides = (radar.velocity, way.departure, paths.tx), (radar.rx_motion, way.arrival, paths.rx)
        ends = [(own, look, np.linalg.norm(way.vertices[taken] - end, axis=2)) for own, look, end in sides]
    bend = np.zeros(body.shape)
    for own, look, far in ends:
        relative = facets.velocity - np.asarray(own)
        along = np.einsum("ndi,ni->nd", relative[body], look[taken].astype(float))
        across = np.einsum("bi,bi->b", relative, relative)[body] - along**2
        bend += across / np.maximum(far, _NEAR) / len(ends)
    turning = np.linalg.norm(facets.spin, axis=1)[body]
    return float(np.where(used, bend + turning**2 * _ARM, 0.0).max(initial=0.0))
