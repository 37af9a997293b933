"""Labels and provenance of map cells: the paths that contribute to a cell, by the chains of bodies they met."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.parallel import parallel_for
from raychan.radar.waveform import Waveform
from raychan.records import TRANSMIT, Detections, InteractionType, Paths, RangeDoppler
from raychan.run.convergence import figure
from raychan.run.explanation.cell_sums import cell_sums
from raychan.run.explanation.directions import Beams, unexplained, wave_in_beam
from raychan.run.explanation.folding import Shown, peaks_of, truth
from raychan.run.explanation.point_spread import PointSpread
from raychan.run.explanation.side_lobes import Cell, reaches
from raychan.run.explanation.turns import Turns, added, turns_of
from raychan.run.result import CLUTTER, DIRECT, MULTIPATH, SIDELOBE, Contribution, Explanation, Receiver

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

_LEAST_SHARE = 0.005  # of a cell's power: weaker chains are not listed (not measured)
_DIGITS = 9  # decimals to which shares are compared: a chain and its reverse differ by rounding
_DEPTH = 0.3  # m: an echo over the ground less than this behind its target, the depth of a person, is no ghost
_MANY = 20_000  # trajectories from which on a second thread pays; not measured


@dataclass(frozen=True)
class Chains:
    """The paths of a run grouped by their chains of parts, and these chains by the targets in them."""

    part: Ints
    """Chain of parts of each path (n,)."""
    names: tuple[tuple[str, ...], ...]
    bodies: tuple[tuple[str, ...], ...]
    """Bodies met, in order, without thin layers passed."""
    targets: Ints
    """Chain of targets of each chain of parts, without ground and radar carrier; a chain and its reverse are one."""
    turns: Turns
    """Which chains are the same but for where on the way the wave scatters."""


def chains(paths: Paths, background: tuple[str, ...]) -> Chains:
    """Return the paths grouped by chain; successive bounces on one body are one link of a chain of targets."""
    names: list[tuple[str, ...]] = []
    bodies: list[tuple[str, ...]] = []
    targets: list[int] = []
    known: dict[tuple[str, ...], int] = {}
    trajectories = paths.trajectories
    backdrop = set(map(whole, background))
    first, index = alike(paths)
    links = (x[first].tolist() for x in (trajectories.body, trajectories.part, trajectories.kind))
    for row in zip(*links, strict=True):
        met = [link for link in zip(*row, strict=True) if link[2]]
        names.append(tuple(_name(paths, b, p, k) for b, p, k in met))
        bodies.append(tuple(paths.body_names[b] for b, _, k in met if k != TRANSMIT))
        left = [b for b in map(whole, bodies[-1]) if b not in backdrop]
        link = tuple(b for i, b in enumerate(left) if i == 0 or b != left[i - 1])
        # A chain and its reverse have equal gains, by reciprocity.
        targets.append(known.setdefault(min(link, link[::-1]), len(known)))
    turns = turns_of(names, trajectories.kind[first], np.array_equal(paths.tx, paths.rx))
    return Chains(index, tuple(names), tuple(bodies), np.array(targets, np.int64), turns)


def explain_cell(
    paths: Paths,
    known: Chains,
    response: PointSpread,
    receiver: Receiver,
    range: float,
    rate: float | None,
    power: float,
    error: float = 0.0,
) -> Explanation:
    """Return the explanation of a cell by its paths.

    Args: known the paths' chains; range [m]; rate [m/s], or None for a cell of the power-delay profile; power [W] of
    the cell; error [W], the difference of two launches of tubes there.
    Each path contributes its amplitude times the response of both windows at its distance from the cell; paths of one
    chain add coherently, the shares of chains are their powers.
    """
    wave, at = waves_in(paths, response, range, rate)
    sums = cell_sums(known.part, len(known.names), wave, at, paths.range_rate)
    cell = Cell(Shown(range, rate, rate or 0.0), power, error, paths.amplitude)
    return _explained(paths, known, response, tuple(x[0] for x in sums), cell, receiver)


def _explained(
    paths: Paths, known: Chains, response: PointSpread, sums: Any, cell: Cell, receiver: Receiver
) -> Explanation:
    """Return the explanation of a cell from the sums over chains of `cell_sums`, at its reported place."""
    summed, sizes, strongest = sums
    whole = complex(summed.sum())
    predicted = abs(whole) ** 2 * receiver.power
    range, rate = cell.shown.range, cell.shown.at_rate
    place = range, rate, rate + receiver.ego_speed
    shares = np.abs(summed) ** 2
    if unexplained(whole, cell.power, receiver) or not shares.sum() > 0.0:
        error_db = figure(cell.power, cell.error)  # of noise: the launches' difference against the cell's power
        return Explanation(*place, cell.power, predicted, error_db, CLUTTER, ())
    shares /= shares.sum()
    # The ground beside a target adds to its return: the leading target is that of the largest sum over all its chains.
    leading = np.argmax(np.abs(added(known.targets, summed, int(known.targets.max()) + 1)))
    paths_in, size, ranges, rates = sizes
    # A chain and its reverse differ by rounding only; among these the order of chains decides.
    order = np.argsort(-shares.round(_DIGITS), kind="stable")
    first = order[known.targets[order] == leading][0]

    def reached(rows: Ints) -> bool:
        return reaches(paths, rows, response, cell, abs(whole) ** 2)

    def of(g: Any) -> Ints:
        return np.flatnonzero(known.part == g)

    # Most cells are explained by their leading chain; all paths take longer.
    lobe = not (mine := reached(of(first))) and not reached(np.arange(len(known.part)))
    if not mine and not lobe:
        # Side lobes of the leading chain lie on another echo.
        first = next((g for g in order[shares[order] >= _LEAST_SHARE] if reached(of(g))), first)
    order = np.append(first, order[order != first])
    parts = tuple(
        Contribution(
            known.names[g],
            len(known.bodies[g]),
            float(ranges[g] / size[g]),
            float(rates[g] / size[g]),
            float(shares[g]),
            int(paths_in[g]),
        )
        for g in order
        if (shares[g] >= _LEAST_SHARE or g == first) and size[g] > 0.0
    )
    leader = int(strongest[first])
    label = SIDELOBE if lobe else label_of(paths, leader, known.bodies[first], receiver)
    true = truth(paths, of(first), leader, response, cell.shown)
    if not math.isnan(true.range):
        parts = replace(parts[0], range=true.range, rate=true.rate), *parts[1:]
    error_db = figure(predicted, cell.error)
    way, at = paths.trajectories, paths.trajectory[leader]
    away, back = (tuple(x[at].tolist()) for x in (way.departure, way.arrival))
    known_of = true.folded, true.range, true.rate
    made = Explanation(*place, cell.power, predicted, error_db, label, parts, *known_of, known.turns.off_db(summed))
    return replace(made, departure=away, arrival=back, drift=tuple(way.drift[at].ravel().tolist()))


def waves_in(
    paths: Paths, response: PointSpread, range: float, rate: float | None
) -> tuple[NDArray[np.complexfloating[Any, Any]], Floats]:
    """Return the contribution of each path to a cell (n,), and its range (n,) [m].

    A path contributes its amplitude times the response of both windows at its distance from the cell.
    Args: range [m] and rate [m/s] of the cell; None for a cell of the power-delay profile.
    """
    if rate is not None:
        return response.in_cell(paths.amplitude, paths.delay, paths.range_rate, range, rate)
    weight, at = response.in_profile(paths.delay, range)
    return paths.amplitude * weight, at


def provenance(
    paths: Paths,
    rdmap: RangeDoppler,
    detections: Detections,
    receiver: Receiver,
    error: Floats,
    beam: Beams | None = None,
    known: Chains | None = None,
) -> tuple[Explanation, ...]:
    """Return one explanation for each detection: of the place of its peak, with the detection's range and rate.

    Args: beam, those of an array's detections, of whose paths each is explained; known the paths' chains, if they are
    known already.
    """
    known, response = known or chains(paths, receiver.background), response_of(receiver)
    at, powers = peaks_with_levels(detections, rdmap, receiver)
    # Between cells an error is larger than in its cell, as the echo is.
    errors = error[tuple(detections.cell.T)] * powers / rdmap.power[tuple(detections.cell.T)]
    sums = response.in_cells(known.part, len(known.names), paths.amplitude, paths.delay, paths.range_rate, at)
    places = detections.range, detections.rate, detections.speed, detections.power
    found = []
    for i in range(len(at)):
        shown = Shown(float(at[i, 0]), float(at[i, 1]), float(detections.rate[i]))
        spread = 0.0 if beam is None else float(beam.spread[i])
        cell, own = Cell(shown, float(powers[i]), float(errors[i]), paths.amplitude, spread), tuple(x[i] for x in sums)
        both = cell.power, float(detections.power[i])
        wave = None if beam is None else wave_in_beam(paths, response, at[i], both, beam, i, receiver)
        if wave is not None:
            one = response.in_cells(known.part, len(known.names), wave, paths.delay, paths.range_rate, at[i : i + 1])
            cell, own = replace(cell, power=both[1], amplitude=wave), tuple(x[0] for x in one)
        why = _explained(paths, known, response, own, cell, receiver)
        at_range, at_rate, speed, level = (float(x[i]) for x in places)
        found.append(replace(why, range=at_range, rate=at_rate, speed=speed, power=level))
    return tuple(found)


def peaks_with_levels(found: Detections, rdmap: RangeDoppler, receiver: Receiver) -> tuple[Floats, Floats]:
    """Return the range [m], rate [m/s] and amplitude of the peaks of detections (d, 3) in the map, and the power (d,)
    [W] of all that arrives there: of an array the mean over its antennas in the cell, where a beam has less of it."""
    amplitude = np.sqrt(found.power / receiver.power)
    at = np.column_stack([peaks_of(found, rdmap, response_of(receiver)), amplitude])
    return at, np.maximum(rdmap.power[tuple(found.cell.T)], found.power)


def response_of(receiver: Receiver) -> PointSpread:
    """Return the response of a receiver's processor."""
    return _spread(receiver.waveform, receiver.range_window, receiver.rate_window)


@lru_cache(maxsize=2)
def _spread(waveform: Waveform, range_window: str, rate_window: str) -> PointSpread:
    """Return a response, kept with its tables for the next frame of a sequence."""
    return PointSpread(waveform, range_window, rate_window)


def alike(paths: Paths) -> tuple[Ints, Ints]:
    """Return a trajectory of each chain, and the chain of each path (n,)."""
    trajectories = paths.trajectories
    code, most = np.zeros(len(trajectories.kind), np.int64), 1
    parts = len(paths.part_names) + 1
    width = (len(paths.body_names) + 1) * parts * len(InteractionType)
    number = np.int32 if width < np.iinfo(np.int32).max else np.int64
    # Slot by slot and in half the bytes, for speed.
    for body, part, kind in zip(trajectories.body.T, trajectories.part.T, trajectories.kind.T, strict=True):
        kind = np.ascontiguousarray(kind)
        if not kind.any():
            break
        if most > np.iinfo(np.int64).max // width:
            code = np.unique(code, return_inverse=True)[1].astype(np.int64)
            most = int(code.max(initial=0)) + 1
        links = partial(_add_links, code, width, number, parts, body, part, kind)
        parallel_for(len(code), links, _MANY)
        most *= width
    taken = np.zeros(len(code), bool)
    taken[paths.trajectory] = True
    rows = np.flatnonzero(taken)
    taken_codes, chain = code[rows], np.full(len(code), -1, np.int64)
    # Neighbours are mostly alike: one of each run is sorted.
    heads = np.flatnonzero(np.diff(taken_codes, prepend=-1))
    _, first, inverse = np.unique(taken_codes[heads], return_index=True, return_inverse=True)
    chain[rows] = np.repeat(inverse, np.diff(heads, append=len(rows)))
    return rows[heads[first]], chain[paths.trajectory]


def _add_links(
    code: Ints,
    width: int,
    number: Any,
    parts: int,
    body: NDArray[Any],
    part: NDArray[Any],
    kind: NDArray[Any],
    at: slice,
) -> None:
    """Add one slot (n,) of some chains to their codes (n,), of numbers of such a kind."""
    slot = (body[at].astype(number) + number(1)) * number(parts) + part[at]
    slot = (slot + number(1)) * number(len(InteractionType)) + kind[at]
    slot[kind[at] == 0] = 0
    code[at] *= width
    code[at] += slot


def _name(paths: Paths, body: int, part: int, kind: int) -> str:
    name = paths.body_names[body] if body >= 0 else "?"
    part_name = paths.part_names[part] if part >= 0 else ""
    if part_name:
        name = f"{name}.{part_name}"
    return f"({name})" if kind == TRANSMIT else name


def whole(name: str) -> str:
    """Return the name of the body that a limb, such as 'walker.foot_left', belongs to: limbs of one are one target."""
    return name.partition(".")[0]


def label_of(paths: Paths, row: int, bodies: tuple[str, ...], receiver: Receiver) -> str:
    """Return the label of a cell whose strongest path is `row`, over `bodies`."""
    met = set(map(whole, bodies))
    targets = met - set(map(whole, receiver.background))
    if not targets:
        return CLUTTER
    if len(met) == 1:
        return DIRECT
    if len(targets) > 1:
        return MULTIPATH
    # Over the ground and one target: an echo of the target, or a ghost behind it if the detour is long.
    trajectory = paths.trajectory[row]
    index = [whole(paths.body_names[b]) in targets for b in paths.trajectories.body[trajectory]]
    spots = paths.trajectories.vertices[trajectory][index]
    straight = sum(0.5 * np.linalg.norm(spots - end, axis=1) for end in (paths.tx, paths.rx)).min()
    detour = 0.5 * paths.length[row] - straight
    return DIRECT if detour < max(receiver.waveform.range_resolution, _DEPTH) else MULTIPATH
