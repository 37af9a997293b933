"""Where a cell of the map came from: the paths that feed it, by the bodies they met, and the cell's label."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.channel.rcs import stated_error
from raychan.kernels.cell import cell_sums
from raychan.run.response import Response, Sums
from raychan.run.result import CLUTTER, DIRECT, MULTIPATH, Contribution, Explanation, Receiver, Result
from raychan.tables import KIND_LETTERS, TRANSMIT, Detections, Paths, RangeDoppler
from raychan.units import C0

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
    """Chain of targets, the ground and the radar's carrier left out, of each chain of parts."""


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
        targets.append(known.setdefault(link, len(known)))
    return Chains(index, tuple(names), tuple(bodies), np.array(targets, np.int64))


def explain_cell(
    paths: Paths,
    known: Chains,
    response: Response,
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
    sums = cell_sums(known.part, len(known.names), wave, at, paths.rate)
    return _explained(paths, known, sums, 0, receiver, (range, rate, power, error))


def _explained(
    paths: Paths,
    known: Chains,
    sums: Sums,
    cell: int,
    receiver: Receiver,
    about: tuple[float, float | None, float, float],
) -> Explanation:
    summed, sizes, strongest = (x[cell] for x in sums)
    range, rate, power, error = about
    whole = complex(summed.sum())
    predicted = abs(whole) ** 2 * receiver.power
    speed = (rate or 0.0) + receiver.ego_speed
    error_db = stated_error(whole, float(np.sqrt(error / receiver.power)))
    shares = np.abs(summed) ** 2
    if predicted < _UNEXPLAINED * power or not shares.sum() > 0.0:
        return Explanation(range, rate or 0.0, speed, power, predicted, error_db, CLUTTER, ())
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
    label = label_of(paths, int(strongest[first]), known.bodies[first], receiver)
    return Explanation(range, rate or 0.0, speed, power, predicted, error_db, label, parts)


def waves_in(
    paths: Paths, response: Response, range: float, rate: float | None
) -> tuple[NDArray[np.complexfloating[Any, Any]], Floats]:
    """Return what each path (n,) brings to a cell, its amplitude times the response of both windows there, and the
    range (n,) [m] at which it stands.

    Args: range [m] and rate [m/s] of the cell; None for a cell of the power-delay profile.
    """
    if rate is not None:
        return response.in_cell(paths.amplitude, paths.delay, paths.rate, range, rate)
    weight, at = response.in_profile(paths.delay, range)
    return paths.amplitude * weight, at


def provenance(
    paths: Paths, rdmap: RangeDoppler, detections: Detections, receiver: Receiver, error: Floats
) -> tuple[Explanation, ...]:
    """Return one explanation for each detection, of the cell where its peak stands, at the place that it reports."""
    known, response = chains(paths, receiver.background), response_of(receiver)
    rows, columns = detections.cell.T
    powers, errors = rdmap.power[rows, columns], error[rows, columns]
    at = np.stack([rdmap.range[columns], rdmap.rate[rows], np.sqrt(powers / receiver.power)], axis=1)
    sums = response.in_cells(known.part, len(known.names), paths.amplitude, paths.delay, paths.rate, at)
    found = []
    for i in range(len(at)):
        about = (float(at[i, 0]), float(at[i, 1]), float(powers[i]), float(errors[i]))
        why = _explained(paths, known, sums, i, receiver, about)
        found.append(
            replace(
                why,
                range=float(detections.range[i]),
                rate=float(detections.rate[i]),
                speed=float(detections.speed[i]),
                power=float(detections.power[i]),
            )
        )
    return tuple(found)


def explain(result: Result | str | Path, range: float, speed: float | None = None) -> Explanation:
    """Return which paths over which bodies made the cell of a map.

    Args: result a Result, or the directory or file of one; range [m]; speed [m/s] with the ego speed taken out, as
    the detections print it; None takes the strongest speed at that range.
    Raises: ValueError outside the map.
    """
    if not isinstance(result, Result):
        from raychan.run.store import load_result

        result = load_result(result)
    rows, column = _cells(result.rdmap, range, None if speed is None else speed - result.receiver.ego_speed)
    row = int(rows[np.argmax(result.rdmap.power[rows, column])])
    cell = (row, column)
    return explain_cell(
        result.paths,
        chains(result.paths, result.receiver.background),
        response_of(result.receiver),
        result.receiver,
        float(result.rdmap.range[column]),
        float(result.rdmap.rate[row]),
        float(result.rdmap.power[cell]),
        float(result.error.power[cell]),
    )


def response_of(receiver: Receiver) -> Response:
    """Return the response of a receiver's processor."""
    return Response(receiver.waveform, receiver.range_window, receiver.rate_window)


def _cells(rdmap: RangeDoppler, range: float, rate: float | None) -> tuple[Ints, int]:
    if not rdmap.range[0] <= range <= rdmap.range[-1]:
        raise ValueError(f"range {range:g} m lies outside the map, {rdmap.range[0]:.1f} to {rdmap.range[-1]:.1f} m")
    column = int(np.argmin(np.abs(rdmap.range - range)))
    if rate is None:
        return np.arange(len(rdmap.rate)), column
    low, high = rdmap.rate[0] - rdmap.rate_resolution, rdmap.rate[-1] + rdmap.rate_resolution
    if not low <= rate <= high:
        raise ValueError(f"range rate {rate:g} m/s lies outside the map, {low:.1f} to {high:.1f} m/s")
    return np.array([np.argmin(np.abs(rdmap.rate - rate))]), column


def _alike(paths: Paths) -> tuple[Ints, Ints]:
    """Return one way of each chain that a path took, and the chain of each path (n,); slot by slot, for speed."""
    ways = paths.ways
    code, most = np.zeros(len(ways.kind), np.int64), 1
    width = (len(paths.body_names) + 1) * (len(paths.part_names) + 1) * len(KIND_LETTERS)
    for body, part, kind in zip(ways.body.T, ways.part.T, ways.kind.T, strict=True):
        if not kind.any():
            break
        if most > np.iinfo(np.int64).max // width:
            code = np.unique(code, return_inverse=True)[1].astype(np.int64)
            most = int(code.max(initial=0)) + 1
        slot = (body + 1) * np.int64(len(paths.part_names) + 1) + part + 1
        code, most = code * width + np.where(kind > 0, slot * len(KIND_LETTERS) + kind, 0), most * width
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
    straight = np.linalg.norm(paths.ways.vertices[way][index] - 0.5 * (paths.tx + paths.rx), axis=1).min()
    detour = 0.5 * C0 * paths.delay[row] - straight
    return DIRECT if detour < max(receiver.waveform.range_resolution, _DEPTH) else MULTIPATH
