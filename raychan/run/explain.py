"""Which paths make a detection or a cell of the map: the one meant by range and speed, and every path that feeds it."""

from __future__ import annotations

from dataclasses import dataclass, fields
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.blas import on_one_blas_thread
from raychan.columns import Record, column
from raychan.poses import angles
from raychan.radar.declared import check_type
from raychan.records import NONE, TRANSMIT, Complexes, Floats, Ints, Paths, RangeDoppler
from raychan.run.explanation.directions import beam_to, wave_in_beam
from raychan.run.explanation.labels import Chains, chains, explain_cell, peaks_with_levels, response_of, waves_in
from raychan.run.explanation.no_echoes import named, no_echoes_of
from raychan.run.interferers import Sent, interference
from raychan.run.result import Contribution, Explanation, Result
from raychan.world.geometry import geometry_of
from raychan.world.scene import Scene

_VERBS = ("", "reflect", "pass", "scatter", "point", "diffract", "diffuse")  # by InteractionType
_SAME = 0.1  # resolution cells: a range and speed typed by hand do not tell closer places apart; not measured


@dataclass(frozen=True)
class CellPaths(Record):
    """The paths that feed a cell of the map, the one that brings most first; a row a path, all of them."""

    row: Ints = column("n", np.int32, doc="row of the result's `paths`")
    power: Floats = column("n", unit="W", doc="received power of the path alone")
    phase: Floats = column("n", unit="rad", doc="argument of the path's amplitude, at the frame's start")
    wave: Complexes = column(
        "n", np.complex128, unit="sqrt(W)", doc="what it brings to the cell, or to the beam if `beam`; they add up"
    )
    range: Floats = column("n", unit="m", doc="true range, mid frame")
    rate: Floats = column("n", unit="m/s", doc="true range rate, positive = receding")
    departure: Floats = column("n 2", unit="rad", doc="azimuth and elevation of departure, world axes")
    arrival: Floats = column("n 2", unit="rad", doc="azimuth and elevation towards which the receiver looks")
    interactions: Ints = column("n", np.int16, doc="over both legs, thin layers passed not counted")
    chain: Ints = column("n", np.int64, doc="row of `chains`")
    chains: tuple[tuple[str, ...], ...]
    """Names 'body.part' met by each chain, as Contribution.chain has them."""
    met: tuple[tuple[str, ...], ...]
    """What happened to each chain, as 'reflect truck.tail'."""
    beam: bool = False
    """Whether waves are those in the beam of an array that the detection is seen in; else at its middle."""

    def of(self, part: Contribution) -> NDArray[np.bool_]:
        """Return which paths (n,) are those of a contribution: of chains of one name, as the mirrored and the diffuse
        return of the ground, of the one that has its share."""
        waves = np.zeros(len(self.chains), np.complex128)
        np.add.at(waves, self.chain, self.wave)
        power = np.abs(waves) ** 2
        alike = [g for g, names in enumerate(self.chains) if names == part.chain]
        if not alike:
            return np.zeros(len(self.chain), bool)
        return self.chain == min(alike, key=lambda g: abs(power[g] - part.share * power.sum()))


@dataclass(frozen=True)
class CellExplanation(Explanation):
    """An explanation with its paths, and which detection it is of."""

    paths: CellPaths | None = None
    detection: int = 0
    """Number of the detection, from 1 as tables and detections.csv list them; 0 for a cell of the map itself."""
    others: tuple[int, ...] = ()
    """Numbers of other detections as near to the place asked for as a resolution cell."""
    beam: bool = False
    """Whether shares and levels are those in the beam of an array that the detection is seen in; else those at the
    middle of the array."""
    antennas: int = 1
    """How many the map has."""


@on_one_blas_thread
def explain(
    result: Result | str | Path,
    range: float | None = None,
    speed: float | None = None,
    *,
    detection: int | None = None,
    cell: bool = False,
) -> CellExplanation:
    """Return which paths over which bodies made a detection, or a cell of the map.

    Args: result a Result, or the directory or file of one; range [m] and speed [m/s] with the ego speed taken out, as
    the detections print it: the nearest detection within a resolution cell of them is taken, of equally near ones the
    strongest; detection its number instead, from 1; cell the very map cell at range and speed (without speed the
    strongest there), which is also taken where no detection is near.
    Raises: ValueError for another type, outside the map, on a number that no detection has, or if nothing or both are
    asked for.
    """
    check_type("result", result, Result, str, PathLike)
    if not isinstance(result, Result):
        from raychan.run.storage import load_result

        result = load_result(result)
    if (range is None) == (detection is None):
        raise ValueError("either a range or the number of a detection is wanted")
    if detection is not None and (speed is not None or cell):
        raise ValueError("the number of a detection stands alone, without a speed or the cell")
    check_type("range", range, float, or_none=True)
    check_type("speed", speed, float, or_none=True)
    check_type("cell", cell, bool)
    near: list[int] = []
    place = None
    if detection is not None:
        near = [_checked(result, detection)]
    elif range is not None:
        near = [] if cell else _nearest(result, range, speed)
        place = None if near else _place(result, range, speed)
    return _of_detection(result, near) if place is None else _of_cell(result, place)


def _of_detection(result: Result, near: list[int]) -> CellExplanation:
    row, found, receiver = near[0], result.detections, result.receiver
    at, powers = peaks_with_levels(found, result.rdmap, receiver)
    # A result whose scene cannot be read again does not know where its receivers stand.
    beam, wave = None if result.scene is None else beam_to(result.scene.radar, found, result.paths), None
    if beam is not None:
        both = float(powers[row]), float(found.power[row])
        wave = wave_in_beam(result.paths, response_of(receiver), at[row], both, beam, row, receiver)
    return CellExplanation(
        **_held(result.provenance[row]),
        paths=_paths_at(result, float(at[row, 0]), float(at[row, 1]), amplitude=wave),
        detection=row + 1,
        others=tuple(i + 1 for i in near[1:]),
        beam=wave is not None,
        antennas=len(result.rdmap.spectrum),
    )


def _of_cell(result: Result, place: tuple[int, int]) -> CellExplanation:
    row, column = place
    known = chains(result.paths, result.receiver.background)
    at = float(result.rdmap.range[column]), float(result.rdmap.rate[row])
    seen, error = float(result.rdmap.power[place]), float(result.error.power[place])
    response = response_of(result.receiver)
    why = explain_cell(result.paths, known, response, result.receiver, *at, seen, error)
    scene = result.scene
    if scene is not None:
        parts = result.cube, result.rdmap, result.error.power, scene.radar, scene.processing
        why = named(why, place, no_echoes_of(*parts, _interference(result, scene)))
    antennas = len(result.rdmap.spectrum)
    return CellExplanation(**_held(why), paths=_paths_at(result, *at, known), antennas=antennas)


def _interference(result: Result, scene: Scene) -> Sent:
    """Return what interferers send, which no result holds."""
    if not scene.interferers:
        return {}
    then = scene.at(result.traced_at)
    return interference(then, geometry_of(then, scene.model.tolerance_db, result.traced_at), result.seed)


def _held(why: Explanation) -> dict[str, Any]:
    return {f.name: getattr(why, f.name) for f in fields(Explanation)}


def _paths_at(
    result: Result, range: float, rate: float, known: Chains | None = None, amplitude: Complexes | None = None
) -> CellPaths:
    """Return the paths at a place in the map, range [m] and rate [m/s]; amplitude (n,) of each in a beam, else they are
    those at the middle of the array."""
    paths, receiver = result.paths, result.receiver
    known = known or chains(paths, receiver.background)
    seen = paths if amplitude is None else paths.replace(amplitude=amplitude)
    wave, at = waves_in(seen, response_of(receiver), range, rate)
    order = np.argsort(-np.abs(wave), kind="stable")
    alone, trajectory = paths.amplitude[order], paths.trajectory[order]
    kind = paths.trajectories.kind
    return CellPaths(
        row=order.astype(np.int32),
        power=np.abs(alone) ** 2 * receiver.power,
        phase=np.asarray(np.angle(alone), float),
        wave=wave[order] * np.sqrt(receiver.power),
        range=at[order],
        rate=paths.range_rate[order],
        departure=np.stack(angles(paths.trajectories.departure), axis=1)[trajectory],
        arrival=np.stack(angles(paths.trajectories.arrival), axis=1)[trajectory],
        interactions=((kind != NONE) & (kind != TRANSMIT)).sum(axis=1)[trajectory],
        chain=known.part[order],
        chains=known.names,
        met=_met(paths, known),
        beam=amplitude is not None,
    )


def _met(paths: Paths, known: Chains) -> tuple[tuple[str, ...], ...]:
    """Return what happened to the waves of each chain, in order."""
    first = np.zeros(len(known.names), np.int64)
    first[known.part[::-1]] = paths.trajectory[::-1]
    return tuple(
        tuple(f"{_VERBS[k]} {name.strip('()')}" for k, name in zip(paths.trajectories.kind[at], names, strict=False))
        for at, names in zip(first, known.names, strict=True)
    )


def _checked(result: Result, number: int) -> int:
    check_type("detection", number, int)
    count = len(result.detections.range)
    if not 1 <= number <= count:
        allowed = f"they are numbered from 1 to {count}" if count else "there is none"
        raise ValueError(f"no detection has the number {number}: {allowed}")
    return int(number) - 1


def _nearest(result: Result, range: float, speed: float | None) -> list[int]:
    """Return the detections within a resolution cell of a place: nearest first, of equally near ones the strongest."""
    d, m = result.detections, result.rdmap
    away = np.abs(d.range - range) / m.range_resolution
    off = np.zeros(len(away)) if speed is None else np.abs(d.speed - speed)
    # Speeds as they are printed, first: those that a receiver unfolded may lie a period of the map apart.
    for by in (off, np.abs(2.0 * m.unambiguous_rate - off)):
        far = np.maximum(away, by / m.rate_resolution)
        order = np.lexsort((-d.power, np.floor(far / _SAME)))
        if near := [int(i) for i in order if far[i] <= 1.0]:
            return near
    return []


def _place(result: Result, range: float, speed: float | None) -> tuple[int, int]:
    """Return the map cell (rate, range) at a place; without speed the strongest at that range."""
    rows, column = _cells(result.rdmap, range, None if speed is None else speed - result.receiver.ego_speed)
    return int(rows[np.argmax(result.rdmap.power[rows, column])]), column


def _cells(rdmap: RangeDoppler, range: float, rate: float | None) -> tuple[NDArray[np.int64], int]:
    if not rdmap.range[0] <= range <= rdmap.range[-1]:
        raise ValueError(f"range {range:g} m lies outside the map, {rdmap.range[0]:.1f} to {rdmap.range[-1]:.1f} m")
    column = int(np.argmin(np.abs(rdmap.range - range)))
    if rate is None:
        return np.arange(len(rdmap.rate)), column
    low, high = rdmap.rate[0] - rdmap.rate_resolution, rdmap.rate[-1] + rdmap.rate_resolution
    if not low <= rate <= high:
        raise ValueError(f"range rate {rate:g} m/s lies outside the map, {low:.1f} to {high:.1f} m/s")
    return np.array([np.argmin(np.abs(rdmap.rate - rate))]), column
