"""How far a cell's level would move if bodies stood a little aside: the routes of one launch, with bodies displaced.

A body that turns by small angles about its middle and shifts takes its footprints with it. The lengths through the
corners of each change by what these move along the rays, and its phase integral is taken anew: what slides over a
smooth surface keeps its level, as the parts of neighbours at the corners that they share still cancel. What is lit and
seen stays. `raychan study sensitivity` traces the displaced scenes instead.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.channel.paths import paths_of
from raychan.columns import take
from raychan.radar.radar import Radar
from raychan.records import MIRROR, REFLECT, SCATTER, TRANSMIT, DiffractedRoutes, Paths, Routes
from raychan.run.explanation.point_spread import PointSpread
from raychan.run.refinement.map_cells import MapCells
from raychan.run.refinement.sourced_paths import SourcedPaths
from raychan.tracing.routes import counting
from raychan.units import C0
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Batch = Routes | DiffractedRoutes

TURN, SHIFT = math.radians(0.05), 1e-3
"""Standard deviations of a body's turn [rad] about, and of its shift [m] along, each axis: makers' tolerances."""
_DRAWS = 20
_MOST = 4000  # strongest paths of a cell that are moved: the rest stay
_LEAST = 1e-3  # of the strongest: weaker paths stay
_GRAZING = 1e-6  # cosine below which a ray along a mirror is not followed to it


@dataclass(frozen=True)
class Slopes:
    """How the lengths (n, p) of routes through points change as the body (n,) in one slot shifts, (n, p, 3), and turns
    about its middle, (n, p, 3) [m]; 0 where it does not matter."""

    body: NDArray[np.intp]
    shift: Floats
    turn: Floats

    def longer(self, turn: Floats, shift: Floats) -> Floats:
        """Return by how much (n, p) [m] lengths grow as bodies (b, 3) turn [rad] and shift [m]."""
        by_shift = np.einsum("npi,ni->np", self.shift, shift[self.body])
        return np.asarray(by_shift + np.einsum("npi,ni->np", self.turn, turn[self.body]))


def loosened(
    cells: MapCells,
    held: SourcedPaths,
    launches: Sequence[list[Batch]],
    geometry: Geometry,
    radar: Radar,
    response: PointSpread,
    noise: float,
) -> list[tuple[float, float]]:
    """Let open levels be wrong by what displaced bodies move them; return the ranges and rates of these cells.

    Args: held the paths of launches, of which these are the routes.
    """
    rows = np.unique(np.flatnonzero(cells.open) % max(len(cells.place), 1))
    spread = np.zeros(len(cells.place))
    if len(rows):
        every = zip(launches, held.counts, strict=True)
        batches = [one for batch, kept in every for one in counting(batch, kept)]
        spread[rows] = spreads_db(held.now, batches, geometry, radar, response, cells.place[rows], noise)
    return cells.loosened(spread)


def spreads_db(
    paths: Paths,
    batches: Sequence[Batch],
    geometry: Geometry,
    radar: Radar,
    response: PointSpread,
    cells: Floats,
    noise: float = 0.0,
) -> Floats:
    """Return the standard deviation (c,) [dB] of the level of cells as bodies are displaced, over 20 draws.

    Args: paths of the routes of all batches, trajectories in their order; cells (c, 3), each range [m] and rate [m/s]
    first; noise as for `paths_of`.
    """
    rest, feeds = _feeding(paths, response, cells)
    used = np.flatnonzero(feeds.any(axis=0))
    feeds = feeds[:, used]
    level = np.empty((_DRAWS, len(cells)))
    for k, (moved, route) in enumerate(_displaced(list(_some(batches, used)), geometry, radar, noise)):
        for i, (at_range, rate, *_) in enumerate(cells):
            own = feeds[i, route]
            columns = moved[0][own], moved[1][own], moved[2][own]
            wave, _ = response.in_cell(*columns, float(at_range), float(rate))
            level[k, i] = abs(wave.sum() + rest[i])
    return np.asarray((20.0 * np.log10(np.maximum(level, 1e-300))).std(axis=0))


def _feeding(paths: Paths, response: PointSpread, cells: Floats) -> tuple[NDArray[np.complexfloating], Bools]:
    """Return which routes (c, w) bring most of each cell, and the sums (c,) of what the others bring."""
    rest, feeds = np.zeros(len(cells), complex), np.zeros((len(cells), len(paths.trajectories.kind)), bool)
    for i, (at_range, rate, *_) in enumerate(cells):
        wave, _ = response.in_cell(paths.amplitude, paths.delay, paths.range_rate, float(at_range), float(rate))
        order = np.argsort(-np.abs(wave), kind="stable")[:_MOST]
        rows = order[np.abs(wave[order]) > _LEAST * np.abs(wave[order[:1]]).max(initial=0.0)]
        feeds[i, paths.trajectory[rows]] = True
        rest[i] = wave[~feeds[i, paths.trajectory]].sum()
    return rest, feeds


def _some(batches: Sequence[Batch], used: NDArray[np.intp]) -> Iterator[Batch]:
    """Give the batches with some of their routes only, whose numbers (u,) go over all."""
    first = 0
    for batch in batches:
        rows = used[(used >= first) & (used < first + len(batch.kind))] - first
        first += len(batch.kind)
        yield take(batch, rows)


def _displaced(
    batches: Sequence[Batch], geometry: Geometry, radar: Radar, noise: float
) -> Iterator[tuple[tuple[NDArray[np.complexfloating], Floats, Floats], NDArray[np.intp]]]:
    """Give, draw by draw, amplitude, delay [s] and rate [m/s] of the paths (n,) of routes, and the route of each."""
    rng, bodies, carrier = np.random.default_rng(0), len(geometry.facets.role), radar.waveform.carrier
    moves = (geometry.facets.role != MIRROR)[:, None]
    turn = TURN * rng.standard_normal((_DRAWS, bodies, 3)) * moves
    shift = SHIFT * rng.standard_normal((_DRAWS, bodies, 3)) * moves
    slopes = [slopes_of(batch, geometry.extents.mean(axis=1)) for batch in batches]
    for k in range(_DRAWS):
        columns, first = [], 0
        for batch, by in zip(batches, slopes, strict=True):
            longer = sum((s.longer(turn[k], shift[k]) for s in by), np.zeros((len(batch.kind), 1)))
            back: NDArray[np.complexfloating] = np.ones(len(batch.kind), complex)
            if isinstance(batch, Routes):
                lengths = batch.lengths + longer[:, :-1]
                moved: Batch = batch.rebuilt(lengths=lengths, length=batch.length + longer[:, -1])
            else:
                moved, back = batch, np.exp(-2j * np.pi * carrier / C0 * longer[:, -1])
            paths = paths_of(moved, geometry.facets, radar, carrier, noise)
            amplitude = paths.amplitude * back[paths.trajectory]
            columns.append((amplitude, paths.delay, paths.range_rate, first + paths.trajectory))
            first += len(batch.kind)
        amplitude, delay, rate, route = (np.concatenate(x) for x in zip(*columns, strict=True))
        yield (amplitude, delay, rate), route


def slopes_of(batch: Batch, middle: Floats) -> list[Slopes]:
    """Return how lengths change with the body in each slot, of middles (b, 3) [m]: of routes those through the six
    points of the footprint and through the vertices; of diffracted ones the latter."""
    whole = isinstance(batch, Routes)
    tx, rx = (batch.tx, batch.rx) if isinstance(batch, Routes) else (batch.end, batch.end)
    n, slots = batch.kind.shape
    chain = np.concatenate([np.broadcast_to(tx, (n, 1, 3)), batch.vertices, np.broadcast_to(rx, (n, 1, 3))], axis=1)
    steps = np.diff(chain, axis=1)
    size = np.linalg.norm(steps, axis=2)
    way = np.divide(steps, size[..., None], out=np.zeros_like(steps), where=size[..., None] > 0.0)
    rays = _Rays(batch, way, size) if isinstance(batch, Routes) else None
    found = []
    for slot in range(slots):
        on = (batch.kind[:, slot] > 0) & (batch.kind[:, slot] != TRANSMIT)
        place = batch.vertices[:, slot, None] + np.zeros((n, 7 if whole else 1, 3))
        slope = (way[:, slot] - way[:, slot + 1])[:, None] + np.zeros_like(place)
        if rays:
            place, slope = rays.at(slot, place, slope)
        slope = slope * on[:, None, None]
        body = np.maximum(batch.body[:, slot], 0).astype(np.intp)
        found.append(Slopes(body, slope, np.cross(place - middle[body][:, None], slope)))
    return found


class _Rays:
    """The rays of routes to the points of their footprints, as over plane mirrors.

    Args: way (n, d + 1, 3) and size (n, d + 1) [m] of the stretches of routes.
    """

    def __init__(self, routes: Routes, way: Floats, size: Floats) -> None:
        n, slots = routes.kind.shape
        self.routes, self.way = routes, way
        self.scatter = np.where(routes.scatter >= 0, routes.scatter, slots).astype(np.intp)
        rows = np.arange(n)
        held = np.minimum(self.scatter, slots - 1)
        self.footprint = (self.scatter < slots) & (routes.kind[rows, held] == SCATTER)
        self.off = np.zeros((n, 7, 3))
        self.off[:, :6] = (routes.points - routes.vertices[rows, held][:, None]) * self.footprint[:, None, None]
        self.out = np.cumsum(size, axis=1)
        self.before = self.out[rows, held]
        self.after = self.out[:, -1] - self.before

    def at(self, slot: int, place: Floats, slope: Floats) -> tuple[Floats, Floats]:
        """Return where the rays (n, 7) meet the surface in a slot, places (n, 7, 3) [m], and the slopes of lengths
        there; as given for the ray of the centre."""
        here = (self.footprint & (self.scatter == slot))[:, None, None]
        into, onto = self.way[:, slot, None], self.way[:, slot + 1, None]
        from_end = self.off + into * self.before[:, None, None]
        to_end = onto * self.after[:, None, None] - self.off
        own = _unit(from_end) - _unit(to_end)
        mirrors = (self.footprint & (self.routes.kind[:, slot] == REFLECT))[:, None, None]
        beside, tilted = self._on_mirror(slot, mirrors)
        place = place + np.where(here, self.off, np.where(mirrors, beside, 0.0))
        return place, np.where(here, own, np.where(mirrors, tilted, slope))

    def _on_mirror(self, slot: int, mirrors: Bools) -> tuple[Floats, Floats]:
        """Return by how much (n, 7, 3) [m] the rays to the points meet a mirror beside the centre's, and the slopes
        there; of routes (n, 1, 1) that have one in this slot."""
        routes = self.routes
        inward = slot < self.scatter
        off = self.off * mirrors
        for other in range(routes.kind.shape[1]):
            between = np.where(inward, (other > slot) & (other < self.scatter), (other < slot) & (other > self.scatter))
            normal = routes.normals[:, other, None] * (between & (routes.kind[:, other] == REFLECT))[:, None, None]
            off = off - 2.0 * (off * normal).sum(axis=2, keepdims=True) * normal
        # From the image of the end that is beyond the mirror, over the mirror, to that of the point.
        gone = np.where(inward, self.out[:, slot], self.out[:, -1] - self.out[:, slot])[:, None, None]
        whole = np.where(inward, self.before, self.after)[:, None, None]
        ray = np.where(inward[:, None], self.way[:, slot + 1], -self.way[:, slot])[:, None]
        normal = routes.normals[:, slot, None]
        line, steep = ray * whole + off, (ray * normal).sum(axis=2, keepdims=True)
        across = (line * normal).sum(axis=2, keepdims=True)
        share = np.divide(gone * steep, across, out=np.zeros_like(across), where=np.abs(across) > _GRAZING * whole)
        ahead = _unit(line)
        return line * share - ray * gone, -2.0 * (ahead * normal).sum(axis=2, keepdims=True) * normal


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=2, keepdims=True), 1e-300))
