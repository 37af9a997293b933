"""Where a cell of the map came from: the paths that feed it, by the bodies they met, and the cell's label."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.records import TRANSMIT, Detections, InteractionType, Paths, RangeDoppler
from raychan.run.cell_sums import cell_sums
from raychan.run.convergence import figure
from raychan.run.folding import Shown, truth
from raychan.run.point_spread import PointSpread
from raychan.run.result import CLUTTER, DIRECT, MULTIPATH, Contribution, Explanation, Receiver

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

_LEAST_SHARE = 0.005
_DIGITS = 9
_DEPTH = 0.3  # m: an echo over the ground no further behind its target than a road user is deep is no ghost
_UNEXPLAINED = 0.1  # a cell whose paths give less than this share of its power is noise


@dataclass(frozen=True)
class Chains:
    """The paths of a run sorted by the chain of parts that they met, and these by the targets among them."""

    part: Ints
    """Chain of parts of each path (n,)."""
    names: tuple[tuple[str, ...], ...]
    bodies: tuple[tuple[str, ...], ...]
    """Bodies met, in order, but for thin layers passed."""
    targets: Ints
    """Chain of targets, the ground and the radar's carrier left out, of each chain of parts; there and back are one."""


def chains(paths: Paths, background: tuple[str, ...]) -> Chains:
    """Return the paths sorted by chain; bounces of one body on itself count as one link of a chain of targets."""
    names: list[tuple[str, ...]] = []
    bodies: list[tuple[str, ...]] = []
    targets: list[int] = []
    known: dict[tuple[str, ...], int] = {}
    ways = paths.ways
    first, index = _alike(paths)
    for row in first:
        met = [link for link in zip(ways.body[row], ways.part[row], ways.kind[row], strict=True) if link[2]]
        names.append(tuple(_name(paths, b, p, k) for b, p, k in met))
        bodies.append(tuple(paths.body_names[b] for b, _, k in met if k != TRANSMIT))
        left = [b for b in bodies[-1] if b not in background]
        link = tuple(b for i, b in enumerate(left) if i == 0 or b != left[i - 1])
        # There and back again are one way: equal by reciprocity.
        targets.append(known.setdefault(min(link, link[::-1]), len(known)))
    return Chains(index, tuple(names), tuple(bodies), np.array(targets, np.int64))


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
    """Return which paths make a cell.

    Args: known the paths' chains; range [m]; rate [m/s], or None for a cell of the power-delay profile; power [W] that
    the receiver sees there; error [W] by which two launches of tubes differ there.
    Each path counts with its amplitude times the response of both windows at its distance from the cell; paths over
    the same chain add as waves, chains as powers.
    """
    wave, at = waves_in(paths, response, range, rate)
    sums = cell_sums(known.part, len(known.names), wave, at, paths.range_rate)
    cell = _Cell(Shown(range, rate, range, rate or 0.0), power, error)
    return _explained(paths, known, response, tuple(x[0] for x in sums), cell, receiver)


@dataclass(frozen=True)
class _Cell:
    """A cell to explain: the power that it shows and that by which two launches differ there, both [W]."""

    shown: Shown
    power: float
    error: float


def _explained(
    paths: Paths, known: Chains, response: PointSpread, sums: Any, cell: _Cell, receiver: Receiver
) -> Explanation:
    """Return the explanation of a cell by the sums over chains that it has of `Sums`, reported at its place."""
    summed, sizes, strongest = sums
    whole = complex(summed.sum())
    predicted = abs(whole) ** 2 * receiver.power
    range, rate = cell.shown.at_range, cell.shown.at_rate
    place = range, rate, rate + receiver.ego_speed
    shares = np.abs(summed) ** 2
    if predicted < _UNEXPLAINED * cell.power or not shares.sum() > 0.0:
        error_db = figure(cell.power, cell.error)  # of noise: what launches differ by against what is seen
        return Explanation(*place, cell.power, predicted, error_db, CLUTTER, ())
    shares /= shares.sum()
    # The ground beside a target adds to its return, so what leads is the target over all its ways.
    leading = np.argmax(np.abs(_sums(known.targets, summed, int(known.targets.max()) + 1)))
    paths_in, size, ranges, rates = sizes
    # There and back again are equal but for rounding: in the order of their chains, then.
    order = np.argsort(-shares.round(_DIGITS), kind="stable")
    first = order[known.targets[order] == leading][0]
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
    label = label_of(paths, leader, known.bodies[first], receiver)
    true = truth(paths, np.flatnonzero(known.part == first), leader, response, cell.shown)
    if not math.isnan(true.range):
        parts = replace(parts[0], range=true.range, rate=true.rate), *parts[1:]
    error_db = figure(predicted, cell.error)
    return Explanation(*place, cell.power, predicted, error_db, label, parts, true.folded, true.range, true.rate)


def waves_in(
    paths: Paths, response: PointSpread, range: float, rate: float | None
) -> tuple[NDArray[np.complexfloating[Any, Any]], Floats]:
    """Return what each path brings to a cell (n,), and the range at which it stands (n,) [m].

    A path brings its amplitude times the response of both windows at its distance from the cell.
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
    beam: Callable[[int], NDArray[np.complexfloating[Any, Any]]] | None = None,
) -> tuple[Explanation, ...]:
    """Return one explanation for each detection, of the cell where its peak stands, at the place that it reports.

    Args: beam, what the beam towards a detection (row) passes of each path (n,) as a factor of its wave: of detections
    that an array tells apart in one cell, each is explained by the paths in its own beam.
    """
    known, response = chains(paths, receiver.background), response_of(receiver)
    rows, columns = detections.cell.T
    powers, errors = rdmap.power[rows, columns], error[rows, columns]
    at = np.stack([rdmap.range[columns], rdmap.rate[rows], np.sqrt(powers / receiver.power)], axis=1)
    sums = response.in_cells(known.part, len(known.names), paths.amplitude, paths.delay, paths.range_rate, at)
    _, which, sharing = np.unique(detections.cell, axis=0, return_inverse=True, return_counts=True)
    found = []
    for i in range(len(at)):
        # What the receiver took off the range of a folded rate is put back: cells stand where the beat does.
        folds = np.rint((detections.rate[i] - at[i, 1]) / response.periods[1])
        stands = detections.range[i] + folds * response.periods[1] * response.drift
        shown = Shown(*map(float, (at[i, 0], at[i, 1], stands, detections.rate[i])))
        cell, own = _Cell(shown, float(powers[i]), float(errors[i])), tuple(x[i] for x in sums)
        if beam is not None and sharing[which.ravel()[i]] > 1:
            wave = paths.amplitude * beam(i)
            one = response.in_cells(known.part, len(known.names), wave, paths.delay, paths.range_rate, at[i : i + 1])
            cell, own = replace(cell, power=float(detections.power[i])), tuple(x[0] for x in one)
        why = _explained(paths, known, response, own, cell, receiver)
        found.append(replace(why, speed=float(detections.speed[i]), power=float(detections.power[i])))
    return tuple(found)


def response_of(receiver: Receiver) -> PointSpread:
    """Return the response of a receiver's processor."""
    return PointSpread(receiver.waveform, receiver.range_window, receiver.rate_window)


def _alike(paths: Paths) -> tuple[Ints, Ints]:
    """Return one way of each chain that a path took, and the chain of each path (n,); slot by slot, for speed."""
    ways = paths.ways
    code, most = np.zeros(len(ways.kind), np.int64), 1
    width = (len(paths.body_names) + 1) * (len(paths.part_names) + 1) * len(InteractionType)
    for body, part, kind in zip(ways.body.T, ways.part.T, ways.kind.T, strict=True):
        if not kind.any():
            break
        if most > np.iinfo(np.int64).max // width:
            code = np.unique(code, return_inverse=True)[1].astype(np.int64)
            most = int(code.max(initial=0)) + 1
        slot = (body + 1) * np.int64(len(paths.part_names) + 1) + part + 1
        code, most = code * width + np.where(kind > 0, slot * len(InteractionType) + kind, 0), most * width
    taken = np.zeros(len(code), bool)
    taken[paths.way] = True
    rows = np.flatnonzero(taken)
    _, first, inverse = np.unique(code[rows], return_index=True, return_inverse=True)
    chain = np.full(len(code), -1, np.int64)
    chain[rows] = inverse
    return rows[first], chain[paths.way]


def _sums(index: Ints, values: NDArray[np.complex128], count: int) -> NDArray[np.complex128]:
    return np.bincount(index, values.real, count) + 1j * np.bincount(index, values.imag, count)


def _name(paths: Paths, body: int, part: int, kind: int) -> str:
    name = paths.body_names[body] if body >= 0 else "?"
    part_name = paths.part_names[part] if part >= 0 else ""
    if part_name:
        name = f"{name}.{part_name}"
    return f"({name})" if kind == TRANSMIT else name


def label_of(paths: Paths, row: int, bodies: tuple[str, ...], receiver: Receiver) -> str:
    """Return the label of a cell whose strongest path is `row`, over `bodies`."""
    targets = set(bodies) - set(receiver.background)
    if not targets:
        return CLUTTER
    if len(set(bodies)) == 1:
        return DIRECT
    if len(targets) > 1:
        return MULTIPATH
    # Over the ground and one target: an echo of the target, or a ghost behind it if the way round is long.
    way = paths.way[row]
    index = [paths.body_names[b] in targets for b in paths.ways.body[way]]
    spots = paths.ways.vertices[way][index]
    straight = sum(0.5 * np.linalg.norm(spots - end, axis=1) for end in (paths.tx, paths.rx)).min()
    detour = 0.5 * paths.length[row] - straight
    return DIRECT if detour < max(receiver.waveform.range_resolution, _DEPTH) else MULTIPATH
