"""Sources of tubes: numbers by which a further launch finds the tubes of earlier routes again, to cut them finer."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from raychan.parallel import parallel_for
from raychan.records import TRANSMIT, Routes
from raychan.tracing.shooting import Wanted
from raychan.world.geometry import Geometry

Ints = NDArray[np.signedinteger]
Sources = NDArray[np.int64]
Bools = NDArray[np.bool_]

EXACT = -1
"""Source of routes that are not of tubes."""
_MANY = 20_000  # sources from which on a second thread pays; not measured
_LEG, _DEPTH, _FACET = 14, 4, 31  # bits of each of two legs, of the bounce, of the facet


def sources_of(routes: Routes, leg: int, mirrors: int, out: int, depth: int) -> Sources:
    """Return the source (n,) of each route of tubes: one number of the legs in and out, the bounce `depth` at which it
    scatters, from 1 on, and the facet on which its tube starts.

    Args: leg, out numbers of the legs; mirrors of the leg in.
    """
    surface = routes.kind != TRANSMIT
    first = np.argmax(surface & (np.cumsum(surface, axis=1) == mirrors + 1), axis=1)
    facet = routes.facet[np.arange(len(first)), first]
    return source_of(leg, out, depth, facet)


def source_of(leg: int | Ints, out: int | Ints, depth: int | Ints, facet: Ints) -> Sources:
    """Return the source (n,) of tubes that start on facets (n,) and scatter at the bounce `depth`; numbers of legs."""
    return np.asarray(((np.asarray(leg, np.int64) << _LEG | out) << _DEPTH | depth) << _FACET | facet.astype(np.int64))


def depth_of(source: Sources) -> Ints:
    """Return the bounce (n,) at which the tubes of each source scatter; 0 for exact routes."""
    return np.where(source == EXACT, 0, (source >> _FACET) & ((1 << _DEPTH) - 1))


def facet_of(source: Sources) -> Ints:
    """Return the facet (n,) on which the tubes of each source start; -1 for exact routes."""
    return np.where(source == EXACT, -1, source & ((1 << _FACET) - 1))


def legs_of(source: Sources) -> tuple[Ints, Ints]:
    """Return the numbers of the legs (n,) in and out."""
    return source >> (_LEG + _DEPTH + _FACET), (source >> (_DEPTH + _FACET)) & ((1 << _LEG) - 1)


def without_out(source: Sources) -> Sources:
    """Return sources (n,) without the leg out: one number for all that a launch traces together."""
    return source & ~np.int64(((1 << _LEG) - 1) << (_DEPTH + _FACET))


def by_launch(source: Sources) -> Iterator[tuple[tuple[int, int], Ints]]:
    """Give leg in and bounce of sources (n,), in order, and which (m,) have them."""
    launch = _launch_of(source)
    order = np.argsort(launch, kind="stable")
    ordered = launch[order]
    begin = np.flatnonzero(np.diff(ordered, prepend=ordered[:1] - 1)).tolist()
    for first, end in pairwise([*begin, len(order)]):
        one = int(ordered[first])
        yield (one >> _DEPTH, one & ((1 << _DEPTH) - 1)), order[first:end]


def _launch_of(source: Sources) -> Ints:
    """Return one number (n,) of the leg in and the bounce of each source."""
    return legs_of(source)[0] << _DEPTH | depth_of(source)


def held_in(held: Sources, source: Sources) -> Bools:
    """Tell which sources (n,) are among those held (m,), which are in order."""
    if not len(held):
        return np.zeros(len(source), bool)
    return np.asarray(held[np.minimum(np.searchsorted(held, source), len(held) - 1)] == source)


def launches(source: Sources, facets: int) -> Iterator[tuple[int, Wanted]]:
    """Give the launches that trace sources (n,) again: numbers of legs in, and what is wanted there, one depth each.

    From each facet of a launch all its outgoing legs are traced: see `covered`.
    """
    own = source[source != EXACT]
    for (leg, depth), rows in by_launch(own):
        wanted = np.zeros(facets, bool)
        wanted[facet_of(own[rows])] = True
        yield leg, Wanted(wanted, depth, frozenset(np.unique(legs_of(own[rows])[1]).tolist()))


class Rings:
    """Facets beside those that further launches start from: the rest of their planes, and those across their edges.

    A coarse launch may see nothing of a facet that meets or shows a surface with a small part of it only, or that
    spreads its rays widely. Each is traced once, beside what is known by then.
    """

    def __init__(self, geometry: Geometry) -> None:
        self._plane, self._across = geometry.plane, geometry.scene_topology.beside
        self._traced: dict[tuple[int, int], Bools] = {}

    def with_those_beside(self, source: Sources, alone: Sources) -> Iterator[tuple[int, Wanted]]:
        """Give the `launches` of sources (n,) that start also from the facets beside theirs that none before did, and
        from those of sources (m,) without any beside."""
        own = list(launches(source, len(self._plane)))
        beside = {(leg, wanted.depth): self._beside(wanted.facets) for leg, wanted in own}
        for leg, wanted in launches(np.union1d(source, alone), len(self._plane)) if len(alone) else own:
            none = np.zeros_like(wanted.facets)
            before = self._traced.get((leg, wanted.depth), none)
            started = wanted.facets | (beside.get((leg, wanted.depth), none) & ~before)
            self._traced[leg, wanted.depth] = before | started
            yield leg, replace(wanted, facets=started)

    def _beside(self, wanted: Bools) -> Bools:
        """Return the facets (f,) of the same planes, and across the edges, of some (f,)."""
        of_plane = np.zeros(int(self._plane.max(initial=-1)) + 1, bool)
        rows = np.flatnonzero(wanted)
        of_plane[self._plane[rows]] = True
        every = of_plane.take(self._plane)
        met = self._across[rows]
        every[met[met >= 0]] = True
        return every


def covered(source: Sources, by: list[tuple[int, Wanted]]) -> NDArray[np.bool_]:
    """Tell which sources (n,) some launches trace again."""
    found = np.empty(len(source), bool)

    def some(at: slice) -> None:
        found[at] = _covered(source[at], by)

    parallel_for(len(source), some, _MANY)
    return found


def _covered(source: Sources, by: list[tuple[int, Wanted]]) -> NDArray[np.bool_]:
    found, launch = np.zeros(len(source), bool), _launch_of(source)
    for i, wanted in by:
        rows = np.flatnonzero(launch == (i << _DEPTH | wanted.depth))
        outs = np.zeros(1 << _LEG, bool)
        outs[list(wanted.outs)] = True
        out = outs[legs_of(source[rows])[1]]
        found[rows] |= wanted.facets[facet_of(source[rows])] & out
    return found
