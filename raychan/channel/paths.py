"""Paths of routes: the gain, delay and rate of each for a radar. Footprints long in range or wide before an array give
several (see `footprint_paths`)."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from functools import partial
from itertools import accumulate
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from raychan.channel.corner_rays import departures
from raychan.channel.drifts import drifts
from raychan.channel.edge_diffraction import diffracted_paths
from raychan.channel.ends import RadarEnds, at_start, ends_of, paths_record, rx_fields, swept_by
from raychan.channel.footprint_paths import over_three, several
from raychan.channel.rates import rates
from raychan.channel.transfer import corner_gains
from raychan.parallel import parallel_for
from raychan.radar.dual_paths import columns_of
from raychan.records import DiffractedRoutes, Facets, Paths, Routes
from raychan.trajectories import Trajectories
from raychan.units import C0

Floats = NDArray[np.float64]
_Kind = TypeVar("_Kind", bound=np.generic)
_MANY = 20_000  # trajectories from which on a second thread pays; not measured


def paths_of(
    routes: Routes | DiffractedRoutes, facets: Facets, radar: RadarEnds, frequency: float, noise: float = 0.0
) -> Paths:
    """Return what routes carry for a radar; a footprint long in range or wide before an array becomes several.

    Args: frequency [Hz] of the amplitudes' phases, that of the carrier; gains are those of the middle of the ramp, if
    the radar has a waveform; noise amplitude of a path as strong as the noise in a map cell: footprints stay one path
    where it hides the difference; then the radar has a waveform.
    """
    if isinstance(routes, DiffractedRoutes):
        return diffracted_paths(routes, facets, radar, frequency)
    carrier, frequency = frequency, frequency + swept_by(radar)
    gains = corner_gains(routes, facets, radar, frequency)
    own = ends_of(radar)
    rate = rates(routes, facets, own.tx_velocity, own.rx_velocity)
    parts = several(routes, gains, rate, facets, radar, frequency, noise)
    one = np.ones(len(gains), bool)
    one[parts.route] = False
    whole = np.flatnonzero(one)
    length = np.concatenate([routes.length[whole], parts.length])
    back = np.exp(2j * np.pi * (frequency - carrier) / C0 * length)
    received = {
        name: np.concatenate([over_three(np.add, gains[whole, i]), parts.gain[:, i]]) * back
        for i, name in enumerate(("amplitude", "cross")[: gains.shape[1]])
    }
    return over_routes(
        routes,
        facets,
        radar,
        length=length,
        **received,
        length_rate=np.concatenate([2.0 * rate[whole], parts.rate]),
        drift=drifts(routes, facets, radar, own.tx_velocity, own.rx_velocity),
        trajectory=np.concatenate([whole, parts.route]).astype(np.int32),
        aside=np.concatenate([np.zeros((len(whole), *parts.place.shape[1:]), np.float32), parts.place]),
    )


def over_routes(routes: Routes, facets: Facets, radar: RadarEnds, drift: Floats, **columns: NDArray[Any]) -> Paths:
    """Return the record of paths over routes for a radar that receives.

    Args: drift (w, 2, 3) of each route (`channel.drifts`); columns of the paths: length, amplitude, cross where the
    radar has cross-polarised receivers, length_rate, trajectory, the number of each path's route, and aside, where some
    are of parts of footprints.
    """
    columns.setdefault("aside", np.zeros((len(columns["length"]), 0, 3), np.float32))
    away, look = departures(routes)
    part = facets.part[np.maximum(routes.facet, 0)] if len(facets.part) else np.zeros_like(routes.facet)
    return paths_record(radar)(
        **at_start(facets, radar, columns),
        trajectories=Trajectories(
            departure=away.astype(np.float32),
            arrival=look,
            body=routes.body,
            part=np.where(routes.facet >= 0, part, -1).astype(np.int16),
            kind=routes.kind,
            vertices=routes.vertices.astype(np.float32),
            drift=drift.astype(np.float32),
            instant=np.full(len(routes.kind), facets.since),
        ),
        body_names=facets.body_names,
        part_names=facets.part_names,
        tx=routes.tx,
        rx=routes.rx,
    )


def nothing(facets: Facets, radar: RadarEnds) -> Paths:
    """Return the empty record of a scene of which nothing is in view."""
    ends, none = ends_of(radar), np.zeros((0, 1), np.int8)
    names = ("amplitude", "cross")[: len(rx_fields(radar))]
    return paths_record(radar).of(
        length=np.zeros(0),
        **{name: np.zeros(0, complex) for name in names},
        length_rate=np.zeros(0),
        departure=np.zeros((0, 3)),
        arrival=np.zeros((0, 3)),
        body=none,
        part=none,
        kind=none,
        vertices=np.zeros((0, 1, 3)),
        body_names=facets.body_names,
        part_names=facets.part_names,
        tx=ends.tx,
        rx=ends.rx,
    )


def join(parts: Sequence[Paths], keep: Sequence[NDArray[np.bool_]] | None = None) -> Paths:
    """Return all paths of several sets as one record, chains as long as the longest; with `keep`, masks (w,) of each
    set's trajectories, only the paths of those."""
    if keep is None:
        if len(parts) == 1:
            return parts[0]
        rows = [np.arange(len(p.trajectories.kind)) for p in parts]
    else:
        rows = [np.flatnonzero(k) for k in keep]
    some = [np.arange(len(p.trajectory)) for p in parts]
    if keep is not None:
        some = [np.flatnonzero(_at(k, p.trajectory)) for p, k in zip(parts, keep, strict=True)]
    begin, number = _begins(rows), list[NDArray[np.int32]]()
    for i, p in enumerate(parts):
        new = p.trajectory
        if keep is not None:
            new = _at(np.cumsum(keep[i], dtype=np.int32) - 1, _at(new, some[i]))
        number.append(new + np.int32(begin[i]))
    copies, first = list[Callable[[], None]](), _begins(some)
    columns = {
        name: _column([getattr(p, name) for p in parts], some, first, copies)
        for name in columns_of(parts[0])
        if name != "aside"
    }
    # Paths without it lie where their centres do.
    ends = max(p.aside.shape[1] for p in parts)
    columns["aside"] = _column([p.aside for p in parts], some, first, copies, ends, 0.0)
    way = _joined([p.trajectories for p in parts], rows, begin, parts[0].rx, copies)

    def done(at: slice) -> None:
        for copy in copies[at]:
            copy()

    parallel_for(len(copies), done, 2 if begin[-1] > _MANY else len(copies) + 1)
    return parts[0].rebuilt(
        **columns, trajectory=np.concatenate(number), trajectories=parts[0].trajectories.rebuilt(**way)
    )


def _begins(rows: list[NDArray[np.intp]]) -> list[int]:
    """Return where each of several sets of rows begins, and where the last one ends."""
    return list(accumulate(map(len, rows), initial=0))


def _at(values: NDArray[_Kind], rows: NDArray[np.integer[Any]]) -> NDArray[_Kind]:
    """Return some rows of values (n,), by all threads."""
    out = np.empty(len(rows), values.dtype)

    def some(at: slice) -> None:
        # With mode "clip" numpy writes straight to `out`; all numbers are in range.
        values.take(rows[at], out=out[at], mode="clip")

    parallel_for(len(rows), some, _MANY)
    return out


def _joined(
    parts: list[Trajectories],
    rows: list[NDArray[np.intp]],
    begin: list[int],
    rx: Floats,
    copies: list[Callable[[], None]],
) -> dict[str, NDArray[Any]]:
    """Return the columns of some rows of several sets of trajectories as one set, as `_column` does; unused slots
    repeat the receiver rx (3,) [m]."""
    slots = max(p.kind.shape[1] for p in parts)
    empty: dict[str, Any] = {"body": -1, "part": -1, "kind": 0, "vertices": rx, "drift": 0.0}
    wide = dict.fromkeys(empty, slots) | {"drift": max(p.drift.shape[1] for p in parts)}
    return {
        f.name: _column(
            [getattr(p, f.name) for p in parts], rows, begin, copies, wide.get(f.name, 0), empty.get(f.name)
        )
        for f in dataclasses.fields(Trajectories)
    }


def _column(
    held: list[NDArray[Any]],
    rows: list[NDArray[np.intp]],
    begin: list[int],
    copies: list[Callable[[], None]],
    slots: int = 0,
    empty: Any = None,
) -> NDArray[Any]:
    """Return a column for some rows of several, each set from its `begin` on, of so many slots, to be filled by
    `copies`, to which are added."""
    wide = (slots,) if slots else ()
    out = np.empty((begin[-1], *wide, *held[0].shape[1 + len(wide) :]), held[0].dtype)
    for i, one in enumerate(held):
        copies.append(partial(_copy, one, rows[i], out[begin[i] : begin[i + 1]], empty))
    return out


def _copy(one: NDArray[Any], rows: NDArray[np.intp], place: NDArray[Any], empty: Any) -> None:
    """Copy some rows of a column to their place, whose slots beyond those of the column become empty ones."""
    if not place.size:
        return
    if one.shape[1:] != place.shape[1:]:
        place[:, : one.shape[1]] = one if len(one) == len(place) else one.take(rows, axis=0)
        place[:, one.shape[1] :] = empty
    elif len(one) == len(place):
        place[:] = one
    else:
        # With mode "clip" numpy writes straight to `out`; all numbers are in range.
        one.take(rows, axis=0, out=place, mode="clip")


def of_trajectories(paths: Paths, keep: NDArray[np.bool_]) -> Paths:
    """Return the paths of the trajectories (w,) to keep, in their order."""
    return paths if keep.all() else join([paths], [keep])


def strongest(paths: Paths, most: int) -> Paths:
    """Return the paths of the trajectories, `most` at most, that carry most power; in their order."""
    power = np.bincount(paths.trajectory, np.abs(paths.amplitude) ** 2, len(paths.trajectories.kind))
    if len(power) <= most:
        return paths
    keep = np.zeros(len(power), bool)
    keep[np.argsort(-power, kind="stable")[:most]] = True
    return of_trajectories(paths, keep)
