"""Echoes that the middle of a frame does not have, explained by another of the frame's tracings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from raychan.columns import take
from raychan.records import Paths
from raychan.run.explanation.directions import UNEXPLAINED
from raychan.run.explanation.folding import Shown, ambiguities, truth, waves_shown
from raychan.run.explanation.labels import Chains, chains, label_of, response_of
from raychan.run.explanation.side_lobes import SLACK
from raychan.run.explanation.turns import added
from raychan.run.result import Contribution, Explanation, Receiver
from raychan.units import C0

Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Seen:
    """What one tracing has of a cell: paths that reach it, as if they stood there throughout the frame."""

    paths: Paths
    known: Chains
    leading: int
    """The chain that brings most."""
    strongest: int
    """Its strongest path."""
    power: float
    """Power of that chain in the cell, or in its range alone, over that transmitted."""
    spread: bool
    """Whether it is the range alone that paths reach: the rate of what fills the cell is not known."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the bodies and parts that the chain meets."""
        return self.known.names[self.leading]

    def explains(self, why: Explanation, shown: Shown, receiver: Receiver) -> Explanation:
        """Return an explanation by the leading chain, with its range and rate at the time of the tracing."""
        rows = np.flatnonzero(self.known.part == self.leading)
        true = truth(self.paths, rows, self.strongest, response_of(receiver), shown)
        bodies, way = self.known.bodies[self.leading], self.paths.trajectories
        at = self.paths.trajectory[self.strongest]
        away, back = (tuple(x[at].tolist()) for x in (way.departure, way.arrival))
        rate, seen_at = (math.nan, why.rate) if self.spread else (true.rate, true.rate)
        part = Contribution(self.names, len(bodies), true.range, seen_at, 1.0, len(rows))
        label = label_of(self.paths, self.strongest, bodies, receiver)
        why = replace(why, label=label, contributions=(part,), folded=true.folded)
        why = replace(why, true_range=true.range, true_rate=rate)
        return replace(why, departure=away, arrival=back, drift=tuple(way.drift[at].ravel().tolist()))


def standing(paths: Paths, late: float, receiver: Receiver) -> Paths:
    """Return paths as if the middle of the frame were so long [s] after the instant to which their delays refer."""
    wave = receiver.waveform
    grown = paths.length_rate * (late - wave.centre)
    turn = np.exp(-2j * np.pi * wave.carrier / C0 * grown)
    return paths.replace(length=paths.length + grown, amplitude=paths.amplitude * turn)


def seen_best(tracings: Sequence[Paths], shown: Shown, power: float, receiver: Receiver) -> Seen | None:
    """Return what the tracing has of a cell in which it is strongest; None where none has enough.

    Args: tracings, paths of each as of `standing`; power [W] of the cell.
    """
    best = _best(tracings, shown, receiver, spread=False)
    return best if best and best.power * receiver.power >= UNEXPLAINED * power else None


def seen_in_range(tracings: Sequence[Paths], shown: Shown, receiver: Receiver) -> Seen | None:
    """Return what the tracing has at the range of a cell, whatever its rate, in which that is strongest; None where
    none has any: what begins or ends within a frame spreads over rates. Args: as of `seen_best`."""
    return _best(tracings, shown, receiver, spread=True)


def _best(tracings: Sequence[Paths], shown: Shown, receiver: Receiver, spread: bool) -> Seen | None:
    found = [x for x in (_seen(paths, shown, receiver, spread) for paths in tracings) if x is not None]
    return max(found, key=lambda x: x.power, default=None)


def _seen(paths: Paths, shown: Shown, receiver: Receiver, spread: bool) -> Seen | None:
    response, every = response_of(receiver), np.arange(len(paths.length))
    lobes = np.array(response.main_lobes) + SLACK
    reach = np.array([lobes[0], math.inf]) if spread else lobes
    images = (False, True) if response.mirrors else (False,)
    reached = np.array([ambiguities(paths, every, response, shown, m, reach)[1] for m in images])
    rows = np.flatnonzero(reached.any(axis=0))
    if not len(rows):
        return None
    near: Paths = take(paths, rows)
    known, wave = chains(near, receiver.background), np.zeros(len(rows), complex)
    for mirrored, these in zip(images, reached, strict=True):
        some = np.flatnonzero(these[rows])
        brought = waves_shown(near, some, near.amplitude[some], response, shown, mirrored)
        wave[some] += brought.conj() if mirrored else brought
    if spread:
        wave = near.amplitude
    power = np.abs(added(known.part, wave, len(known.names))) ** 2
    leading = int(np.argmax(power))
    mine = np.where(known.part == leading, np.abs(wave), -math.inf)
    return Seen(near, known, leading, int(np.argmax(mine)), float(power[leading]), spread)
