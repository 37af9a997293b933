"""What changes within a frame that constant rates and the levels of one instant do not hold: an entry of the ledger."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.radar.radar import Radar
from raychan.records import DIFFRACT, MIRROR, NONE, REFLECT, TRANSMIT, Facets, Paths
from raychan.run.explanation.rate_spread import meets
from raychan.run.ledger_entry import NOTHING, Entry
from raychan.run.mechanisms import slots_used
from raychan.tracing.tubes import unit
from raychan.units import C0, db

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_NEAR = 0.5  # m: nothing counts as nearer; not measured
_ARM = 2.5  # m: lever arm of turning bodies, of a vehicle (not measured)
_PASSED = NONE, REFLECT, TRANSMIT  # what a line of sight meets
_STRONG = 1e-3  # of the strongest echo's amplitude (not measured)


def intra_frame(paths: Paths, facets: Facets, radar: Radar, carried: NDArray[np.bool_] | None = None) -> Entry:
    """Return the entry of changes within a frame: for crossing and turning bodies the phase deviates by at most
    k a T^2 / 4, a being the radial acceleration, of a radar with receivers elsewhere the mean of both ends', of a line
    of sight half the acceleration of its length; amplitudes fall as the length L of a path grows: those of its middle
    differ from their mean by (L' T / L)^2 / 4, those of its start by L' T / L. Phases of what meets bodies (b,) that
    are carried on are modelled."""
    frame = radar.waveform.frame_duration
    size = np.abs(paths.amplitude)
    # What the antenna does not hear at all (the ground right below a patch) is no path.
    if not size.any():
        return Entry(NOTHING, "exact", "no path")
    # A line of sight may be far stronger than all echoes.
    echo = np.asarray((~np.isin(paths.trajectories.kind, _PASSED)).any(axis=1))[paths.trajectory]
    strong = np.flatnonzero(size > _STRONG * (size[echo] if echo.any() else size).max())
    nearest = np.full(len(paths.trajectories.kind), np.inf)
    bent = strong if carried is None else strong[~_followed(paths, carried)[strong]]
    np.minimum.at(nearest, paths.trajectory[bent], 0.5 * paths.length[bent])
    bend = _bend(paths, np.flatnonzero(np.isfinite(nearest)), nearest, facets, radar)
    phase = 2.0 * np.pi * radar.waveform.middle / C0 * bend * frame**2 / 4.0
    grown = float((np.abs(paths.length_rate[strong]) * frame / paths.length[strong]).max())
    when, off = ("middle", 0.25 * grown**2) if facets.since else ("start", grown)
    how = (
        f"at most {phase:.2g} rad of unmodelled phase over the frame, amplitudes of its {when} within {off:.2%} of "
        "their mean over it; level relative to the echo that has it"
    )
    return Entry(float(db(max(phase, off, 1e-15) ** 2)), "bound", how)


def _followed(paths: Paths, carried: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which paths (n,) are carried on: those that meet such bodies (b,), but not over an edge."""
    over_edges = np.asarray((paths.trajectories.kind == DIFFRACT).any(axis=1))[paths.trajectory]
    return meets(paths, carried) & ~over_edges


def _bend(paths: Paths, taken: Ints, nearest: Floats, facets: Facets, radar: Radar) -> float:
    """Return the largest radial acceleration [m/s^2] of what some trajectories meet, and of lines of sight; nearest
    (w,) [m] of each path."""
    way = paths.trajectories
    deep = slots_used(paths)
    body, kind = way.body[taken, :deep], way.kind[taken, :deep]
    # The last row is of unused slots.
    role, velocity = np.append(facets.role, MIRROR), np.append(facets.velocity, np.zeros((1, 3)), axis=0)
    used = (role[body] != MIRROR) & (kind != TRANSMIT)
    if radar.rx_position is None:
        ends = [(radar.velocity, way.departure, np.broadcast_to(nearest[taken, None], body.shape))]
    else:
        sides = (radar.velocity, way.departure, paths.tx), (radar.rx_motion, way.arrival, paths.rx)
        ends = [(own, look, np.linalg.norm(way.vertices[taken, :deep] - end, axis=2)) for own, look, end in sides]
    bend = np.zeros(body.shape)
    for own, look, far in ends:
        relative = velocity - np.asarray(own)
        along = np.einsum("ndi,ni->nd", relative[body], look[taken].astype(float))
        across = np.einsum("bi,bi->b", relative, relative)[body] - along**2
        bend += across / np.maximum(far, _NEAR) / len(ends)
    turning = np.append(np.linalg.norm(facets.spin, axis=1), 0.0)[body]
    met = np.where(used, bend + turning**2 * _ARM, 0.0).max(initial=0.0)
    sight = taken[(~used & np.isin(kind, _PASSED)).all(axis=1)]
    passing = _across(paths, sight, velocity, radar) ** 2 / np.maximum(2.0 * nearest[sight], _NEAR)
    return float(max(met, 0.5 * passing.max(initial=0.0)))


def _across(paths: Paths, sight: Ints, velocity: Floats, radar: Radar) -> Floats:
    """Return how fast [m/s] the receiver moves across lines of sight, or lines to images of the transmitter in mirrors;
    velocity (b, 3) [m/s] of bodies."""
    way = paths.trajectories
    ends = [np.broadcast_to(end, (len(sight), 1, 3)) for end in (paths.tx, paths.rx)]
    stops = np.concatenate([ends[0], way.vertices[sight], ends[1]], axis=1)
    image = np.tile(np.asarray(radar.velocity, float), (len(sight), 1))
    for slot, kind in enumerate(way.kind[sight].T):
        at = np.flatnonzero(kind == REFLECT)
        before, here, after = stops[at, slot : slot + 3].swapaxes(0, 1)
        normal = unit(unit(after - here) - unit(here - before))
        closing = np.einsum("ni,ni->n", velocity[way.body[sight[at], slot]] - image[at], normal)
        image[at] += 2.0 * closing[:, None] * normal
    relative = radar.rx_motion - image
    along = np.einsum("ni,ni->n", relative, way.arrival[sight])
    return np.asarray(np.linalg.norm(relative - along[:, None] * way.arrival[sight], axis=1))
