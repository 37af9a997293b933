"""One reflection: tubes leave their surface as rays of the law of reflection and are followed to the next surface.

The centre ray is cast first. Where a tube's contribution counts, its corner rays are cast too: a tube whose rays land
on several surfaces, or through which an edge runs, is subdivided (bisected, or clipped along that edge) and cast again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.geometry.embree_packet import own_packet
from raychan.parallel import parallel_for, threads
from raychan.records import REFLECT
from raychan.tracing.bounce_records import Flight, Landed, Rules, named, none_landed, nothing_met, surroundings
from raychan.tracing.bounce_stages import ALL, CENTRES, CORNERS, SETTLE, fly
from raychan.tracing.contributions import RAYS, Contributions
from raychan.tracing.launch import write_layers
from raychan.tracing.legs import Leg
from raychan.tracing.resolve_hits import contribution_bounds
from raychan.tracing.shared_work import all_of
from raychan.tracing.subdivide import bisect, edge_of_spread, patches_of
from raychan.tracing.tubes import CENTRE, Refinement, Tubes, clearance, slices
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]
Rows = NDArray[np.signedinteger]

_DEEPER = 2.0  # fans that a tube may spread its rays by after its first bounce; trades rays for bias, not measured
_PARALLEL_FROM = 2000  # tubes from which on a second thread pays; not measured
_PART = 16384  # tubes that one thread follows at once; not measured


@dataclass(frozen=True)
class _Bounce:
    """One reflection of one launch.

    Fields: leg in; out the leg by which contributions are bounded, without its antenna; first, last whether the tubes
    stand on their first surface, or land on their last; found the field found so far.
    """

    geometry: Geometry
    leg: Leg
    out: Leg
    first: bool
    last: bool
    found: Contributions

    @property
    def rule(self) -> Refinement:
        return self.found.rule


def bounce(
    geometry: Geometry, leg: Leg, out: Leg, tubes: Tubes, first: bool, last: bool, found: Contributions
) -> Tubes:
    """Return the tubes after one more reflection, on the surfaces where they land.

    Args: leg by which they came; out the leg by which their contributions are bounded, without its antenna; first, last
    whether `tubes` stand on their first surface, or land on their last; found the field found so far, by which tubes
    are subdivided or pruned.
    """
    has_room = tubes.slots < found.rule.slots - 2
    tubes = tubes if has_room.all() else tubes.take(has_room)
    parts = [tubes.only(rows) for rows in np.array_split(np.arange(len(tubes)), max(1, len(tubes) // _PART))]
    budgets = [found.forked(geometry, len(part) / max(len(tubes), 1)) for part in parts]
    steps = [_Bounce(geometry, leg, out, first, last, own) for own in budgets]
    flown = all_of(geometry, [partial(_flown, step, part) for step, part in zip(steps, parts, strict=True)])
    found.joined(budgets)
    landed = [some for part, _ in flown for some in part]
    if not landed:
        return tubes.take(np.zeros(len(tubes), bool))
    in_phase, bound, length = np.concatenate([some for _, weights in flown for some in weights], axis=1)
    return Tubes.join(landed, found.that_count(bound if last else in_phase, length))


def _flown(step: _Bounce, tubes: Tubes) -> tuple[list[Tubes], list[Floats]]:
    """Return the tubes where they land, and what they could contribute from there."""
    tubes = _narrowed(step, tubes)
    if not len(tubes):
        return [], []
    found, count = _followed(step, tubes)
    landed = Tubes(*slices(found.tubes, slice(count)), history=tubes.history)
    vertex, history = found.vertex[:count], tubes.history
    landed.last = history.append(landed.last, vertex, found.normal[:count], found.left[:count], REFLECT)
    write_layers(step.geometry, landed, vertex, landed.k[:, CENTRE], found.through[:count], step.rule)
    return [landed], [_contribution_bounds(step, landed)]


def _followed(step: _Bounce, tubes: Tubes) -> tuple[Landed, int]:
    """Return tubes where they land, and how many these are. Waves of many tubes are cast by all threads, the others one
    after the other in one go."""
    geometry, rule, budget, n = step.geometry, step.rule, step.found.budget, len(tubes)
    account, uncut = budget.account(geometry), np.zeros(len(geometry.facets.role), np.int64)
    fixed = surroundings(geometry), _rules(step), account, uncut
    most = _PARALLEL_FROM if threads() > 1 else np.iinfo(np.int64).max

    def staged(stage: int, state: Any, rows: slice) -> Any:
        return fly(stage, rows.start, rows.stop, most, *state, *fixed, own_packet())

    start = np.zeros((n, 4)) if step.first else clearance(geometry, tubes)
    none = np.zeros(n, np.int8)
    flight = Flight(tubes.columns, start, np.full((n, rule.layers), -1, np.int32), none, none)
    state: Any = flight, nothing_met(), none_landed(flight.tubes, rule.layers), 0
    state = named(*staged(ALL, state, slice(0, n))[:-1])
    while wave := len(state[0].tubes.facet):
        for stage in (CENTRES, CORNERS):
            account[RAYS] += _cast_by_all(wave, partial(staged, stage, state))
        state = named(*staged(SETTLE, state, slice(0, wave))[:-1])
    budget.settle(geometry, account, uncut)
    return state[2], state[3]


def _cast_by_all(n: int, cast: Callable[[slice], Any]) -> int:
    """Cast rays of n tubes by all threads; return how many."""
    casts: list[int] = []
    parallel_for(n, lambda rows: casts.append(cast(rows)[-1]), _PARALLEL_FROM)
    return sum(casts)


def _rules(step: _Bounce) -> Rules:
    """Return how tubes are reflected, for kernels."""
    rule, leg, out, found = step.rule, step.leg, step.out, step.found
    return Rules(
        patches=patches_of(step.geometry, leg),
        image=out.image,
        far=out.far,
        wavenumber=float(rule.wavenumber),
        first=step.first,
        last=step.last,
        layers=rule.layers,
        levels=rule.levels,
        jitter=float(rule.jitter),
        patch=float(rule.patch),
        by_landing=rule.by_landing,
        wide=not rule.fan < np.inf,
        thresholds=found.deep_thresholds,
        specular=found.specular_thresholds,
        cell=float(rule.cell),
        max_cuts=float(found.budget.rule.max_cuts),
        max_rays=float(found.budget.rule.max_rays),
    )


def _narrowed(step: _Bounce, tubes: Tubes) -> Tubes:
    """Return the tubes, those on curved surfaces bisected until each spreads its rays by `_DEEPER` fans at most, by one
    on first surfaces, where the launch does so already unless the rule is coarse; then only those that matter."""
    rule, done, coarse = step.rule, list[Tubes](), step.rule.coarse != 1.0
    fan = (1.0 if step.first else _DEEPER) * rule.fan
    if fan == np.inf or (step.first and not coarse):
        return tubes
    for _ in range(rule.levels):
        edge = edge_of_spread(tubes.k, tubes.normals, tubes.facet, step.geometry.curved, fan)
        wide = edge >= 0
        if coarse:
            in_phase, _, length = _contribution_bounds(step, tubes)
            wide &= in_phase > step.found.specular_threshold(length)
        if not wide.any():
            break
        done.append(tubes.take(~wide))
        tubes = bisect(step.geometry, step.leg, tubes, np.flatnonzero(wide), edge[wide], step.first, rule.jitter)
    return Tubes.join([tubes, *done])


def _contribution_bounds(step: _Bounce, tubes: Tubes) -> Floats:
    """Return what tubes could scatter over the leg out, all in phase or as their corners' phases run [1/m], and the
    length of the two-way path [m] (3, n)."""
    bounds = np.empty((3, len(tubes)))
    geometry, out = step.geometry, step.out
    columns = tubes.columns
    how = out.image, out.far, step.rule.wavenumber, geometry.lossy, *geometry.material_columns

    def some(rows: slice) -> None:
        contribution_bounds(slices(columns, rows), *how, *bounds[:, rows])

    parallel_for(len(tubes), some, _PARALLEL_FROM)
    return bounds
