"""Cells of a map whose error a run leaves above the tolerance, and the lines that say so."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.records import Facets
from raychan.run.refinement.map_cells import MapCells
from raychan.tracing.sources import depth_of, facet_of

Floats = NDArray[np.float64]

_NAMED = 3  # detections or cells that a line names
_MOST = 0.8  # of what may change of a cell by a bounce, as a power: the bodies that are named bring so much
_BODIES = 2  # named at most


@dataclass(frozen=True)
class Unreached:
    """A cell that a budget left above the tolerance: range [m], rate [m/s], the `bounce` at which those tubes scatter
    that may change it most, 1 on first surfaces, and the `bodies` on which these start, `others` more not named. Not
    `beyond`: within the tolerance, but not as far within as refinement aims at."""

    range: float
    rate: float
    bounce: int
    bodies: tuple[str, ...]
    others: int = 0
    beyond: bool = True

    @property
    def cause(self) -> str:
        """What changes there."""
        more = f" and {self.others} more" if self.others else ""
        names = " and ".join(self.bodies) if not more else ", ".join(self.bodies) + more
        return f"first surface: {names}" if self.bounce == 1 else f"bounce {self.bounce} of tubes off {names}"

    @property
    def text(self) -> str:
        """Where the cell lies, and what changes there."""
        return f"{_place(self.range, self.rate)} ({self.cause})"


@dataclass(frozen=True)
class Remains:
    """How a refinement ended: the cells `unreached` after so many `steps`, and what `ended` it, '' where none is left;
    cells of `speckled` ranges and rates were refined to their speckle only, those of `settled` to the tolerance."""

    unreached: tuple[Unreached, ...]
    steps: int
    ended: str
    tolerance_db: float
    speckled: tuple[tuple[float, float], ...] = ()
    settled: tuple[tuple[float, float], ...] = ()
    exceeded: tuple[str, ...] = ()
    """Lines on budgets that were exceeded."""

    def notes(
        self, found: tuple[Floats, Floats], size: tuple[float, float], error_db: Floats, also: Sequence[str] = ()
    ) -> list[str]:
        """Return the lines on budgets, one on the cells that are speckle, one on the detections whose levels are not
        within the tolerance, one on cells that may still become detections, with what ended the refinement, and one on
        detections whose own cell is refined while their error exceeds the tolerance. Detections go by their numbers and
        places in the table.

        Args: found ranges and rates (n,) of the detections; size of a cell [m], [m/s]; error_db (n,) stated of them;
        also what errors hold besides, in words.
        """
        said, tolerance, over = list(self.exceeded), f"{self.tolerance_db:g} dB", error_db > self.tolerance_db
        if self.speckled:
            rows = [_detection(place, found, size) for place in self.speckled]
            numbers = sorted({i + 1 for i in rows if i is not None})
            which = f", {_number(len(numbers))} {', '.join(map(str, numbers))} among them" if numbers else ""
            is_one = len(self.speckled) == 1
            cells, them, they = ("cell", "it", "it is") if is_one else ("cells", "them", "they are")
            said.append(
                f"{len(self.speckled)} {cells} of the map {'is' if is_one else 'are'} speckle (model.speckle){which}: "
                f"displacing bodies by 0.05 deg and 1 mm moves {them} by more than {tolerance}, and {they} refined to "
                "that only"
            )
        causes: dict[int, list[str]] = {}
        weak = []
        for cell in self.unreached:
            row = _detection((cell.range, cell.rate), found, size)
            if row is None and cell.beyond:
                weak.append(cell.text)
            elif row is not None and (cell.beyond or over[row]):
                causes.setdefault(row, []).append(cell.cause)
        how = f"refined {'once' if self.steps == 1 else f'{self.steps} times'}, ended by {self.ended}"
        if causes:
            some = [_numbered(i, found, causes[i]) for i in sorted(causes)]
            at = f"{_number(len(some))} {_first(some, ', ')}"
            said.append(f"{how}: the level still changes by more than {tolerance} at {at}")
        if weak:
            what = "where nothing is detected yet, what may still change makes a detection at"
            said.append(f"{how}: {what} {_first(weak, '; ')}")
        told = {_detection(at, found, size) for at in self.speckled}.union(causes)
        settled = {_detection(at, found, size) for at in self.settled} - told
        if rest := [_numbered(int(i), found, []) for i in np.flatnonzero(over) if i in settled]:
            others = ", ".join((*also, "what may still change in cells beside and tubes below the noise"))
            said.append(
                f"refined to {tolerance} in its own cell: {_number(len(rest))} {_first(rest, ', ')}; "
                f"what is stated above that is of {others}"
            )
        return said


def _detection(place: tuple[float, float], found: tuple[Floats, Floats], size: tuple[float, float]) -> int | None:
    """Return the row of the detection nearest to a range and rate, within a cell, None where there is none; args as of
    `Remains.notes`."""
    away, off = (np.abs(x - at) / cell for x, at, cell in zip(found, place, size, strict=True))
    near = np.flatnonzero((away <= 1.0) & (off <= 1.0))
    return int(near[np.argmin(np.hypot(away, off)[near])]) if len(near) else None


def _number(count: int) -> str:
    return "number" if count == 1 else "numbers"


def _place(range: float, rate: float) -> str:
    return f"{range:.2f} m, {rate:+.2f} m/s"


def _numbered(row: int, found: tuple[Floats, Floats], causes: list[str]) -> str:
    """Return a detection by its number, counted from 1 as the table does, its place there, and what changes in it."""
    return f"{row + 1} ({'; '.join([_place(*(float(x[row]) for x in found)), *dict.fromkeys(causes)])})"


def _first(some: list[str], between: str) -> str:
    more = f" and {len(some) - _NAMED} more" if len(some) > _NAMED else ""
    return between.join(some[:_NAMED]) + more


def unreached_of(cells: MapCells, facets: Facets) -> Iterator[Unreached]:
    """Give the cells that are still to be refined: first those that may be wrong by more than is allowed, then those
    that may not, as refinement aims at less."""
    beyond = cells.doubt > np.abs(cells.level) * cells.allowed
    last = np.concatenate([np.flatnonzero(cells.open & beyond), np.flatnonzero(cells.open & ~beyond)])
    for i in last[np.sort(np.unique(last % max(len(cells.place), 1), return_index=True)[1])]:
        place = cells.cell_of(i)
        yield Unreached(float(place[0]), float(place[1]), *_cause(cells, i, facets), beyond=bool(beyond[i]))


def _cause(cells: MapCells, i: int, facets: Facets) -> tuple[int, tuple[str, ...], int]:
    """Return the bounce at which the tubes scatter that may change level i most, and the bodies on which most of these
    start: names, those that bring most first, and how many more."""
    source, doubt = cells.doubt_by_source(i)
    bounce, power = depth_of(source), doubt**2
    worst = int(np.argmax(np.bincount(bounce, power)))
    rows = np.flatnonzero(bounce == worst)
    start = facet_of(source[rows])
    pair, at = np.unique(np.stack([facets.body[start], facets.part[start]]), axis=1, return_inverse=True)
    brings = np.bincount(at.ravel(), power[rows])
    order = np.argsort(-brings, kind="stable")
    count = int(np.searchsorted(np.cumsum(brings[order]), _MOST * brings.sum())) + 1
    named = order[: min(count, _BODIES)]
    names = tuple(_name(facets, *map(int, pair[:, k])) for k in named)
    return worst, names, count - len(named)


def _name(facets: Facets, body: int, part: int) -> str:
    """Return the name of a body, and of its part if it has several."""
    name = facets.body_names[body]
    several = (facets.part[facets.body == body] != part).any()
    return f"{name}.{facets.part_names[part]}" if several else name
