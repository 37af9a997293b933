"""Waves of the last order of bounces that meet a surface more, and those of one bounce less: only by these can further
bounces be told."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.records import NONE, POINT, REFLECT, SCATTER, TRANSMIT, Paths
from raychan.run.ledger.mirrored_rays import followed, of_each
from raychan.tracing.legs import legs_over
from raychan.world.geometry import Geometry

Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


def going_on(paths: Paths, geometry: Geometry, last: Bools, chains: tuple[Ints, Ints]) -> Bools:
    """Return which paths (n,), of those of the `last` order (n,), are of chains, as `alike` gives them, of which a
    wave, mirrored at its last surface, meets another.

    Rays of each chain tell it. Targets of given RCS send waves everywhere: these go on where there are mirrors. What
    only mirrors at both ends show is none of them: a wall over ground has two ways over it, but no third.
    """
    if not last.any():
        return last
    rows = np.flatnonzero(last)
    chain = chains[1][rows]
    some = of_each(chain)
    way = paths.trajectory[rows[some]].astype(np.int64)
    goes = np.zeros(int(chain.max()) + 1, bool)
    own = chain[some]
    given = (paths.trajectories.kind[way] == POINT).any(axis=1)
    if given.any() and len(legs_over(geometry, paths.tx, 1)) > 1:
        goes[own[given]] = True
    goes[own[_mirrored(paths, geometry, way)]] = True
    found = last.copy()
    found[rows] = goes[chain]
    return found


def shorter(paths: Paths, goes: Bools, chains: tuple[Ints, Ints]) -> Bools:
    """Return which paths (n,), of chains as `alike` gives them, meet the bodies of paths that go on (n,), all but the
    first or all but the last, where these meet them.

    The radar's foot point on a wall, of whatever level, tells nothing of what stands aside; mirrors alone never do.
    """
    first, chain = chains
    body, kind = paths.trajectories.body[first], paths.trajectories.kind[first]
    met = [
        tuple(b for b, k in zip(*row, strict=True) if k not in (NONE, TRANSMIT))
        for row in zip(body.tolist(), kind.tolist(), strict=True)
    ]
    parts = {part for c in np.unique(chain[goes]) for part in (met[c][1:], met[c][:-1])}
    own = np.array([m in parts for m in met], bool) & ((kind == SCATTER) | (kind == POINT)).any(axis=1)
    found = np.asarray(own[chain])
    found[found] = _among(paths, paths.trajectory[found], paths.trajectory[goes])
    return found


def _among(paths: Paths, ways: NDArray[np.int32], goal: NDArray[np.int32]) -> Bools:
    """Return which trajectories (n,) scatter within the box of the places where others, goal (m,), meet a body."""
    kind, body, at = (getattr(paths.trajectories, name) for name in ("kind", "body", "vertices"))
    low, high = (np.full((len(paths.body_names), 3), end) for end in (np.inf, -np.inf))
    others = _once(goal, len(kind))
    for slot in range(kind.shape[1]):
        others = others[kind[others, slot] != NONE]
        if not len(others):
            break
        # Neighbours are mostly on one body: each run of them first, for speed.
        on, place = body[others, slot], at[others, slot]
        first = np.flatnonzero(np.diff(on, prepend=on[:1] - 1))
        for box, end in ((low, np.minimum), (high, np.maximum)):
            end.at(box, on[first], end.reduceat(place, first))
    each, within = _once(ways, len(kind)), np.zeros(len(kind), bool)
    slot = np.argmax((kind[each] == SCATTER) | (kind[each] == POINT), axis=1)
    met, place = body[each, slot], at[each, slot]
    within[each] = ((place >= low[met]) & (place <= high[met])).all(axis=1)
    return within[ways]


def _once(ways: NDArray[np.int32], count: int) -> Ints:
    """Return the numbers of some of `count` trajectories, in order, each once."""
    taken = np.zeros(count, bool)
    taken[ways] = True
    return np.flatnonzero(taken)


def _mirrored(paths: Paths, geometry: Geometry, way: Ints) -> Ints:
    """Return the rows of trajectories (w,) whose rays, mirrored where they scatter, meet a surface more."""
    kind, rows = paths.trajectories.kind[way], np.arange(len(way))
    slot = np.argmax(kind == SCATTER, axis=1)
    bounced = np.cumsum(kind == REFLECT, axis=1)
    # Rays are followed from one end over all surfaces but mirrors of the other end, where the wave then scatters.
    back = bounced[:, -1] > 2 * bounced[rows, slot]
    known = paths.trajectories.vertices[way].astype(float)
    beside = np.where(back, slot + 1, slot - 1)
    before = known[rows, np.minimum(beside, kind.shape[1] - 1)]
    before[beside < 0] = paths.tx
    before[beside == kind.shape[1]] = paths.rx
    # What mirrors of the other end the path meets already is no surface more.
    own = np.where(back, bounced[rows, slot], bounced[:, -1] - bounced[rows, slot])
    on = []
    for count in np.unique(own):
        some = np.flatnonzero(own == count)
        more = int(count) + 1
        # On its way back a wave meets all layers that it passed: not as a mirror.
        on.append(some[followed(geometry, before[some], known[some, slot[some]], more + 1, split=more).row])
    return np.concatenate([np.zeros(0, np.int64), *on])
