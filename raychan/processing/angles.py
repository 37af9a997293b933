"""The echoes within one cell of a map: how many, from which directions, how strong, and each one's own peak.

Directions are sought for one echo, then for one more as long as the strongest beam of what is left exceeds the
detector's threshold. Each echo then has a beam of its own, with nulls towards the others of the cell. By several
transmitters echoes may be folded differently: each is a wave in what the slots hold under its own fold.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.processing.cell_echoes import CellEchoes
from raychan.processing.doa import amplitudes, estimate
from raychan.processing.rivals import Judge, nearest
from raychan.processing.scan import Scan
from raychan.processing.slots import LONE, Slots

Floats = NDArray[np.float64]
Complexes = NDArray[np.complexfloating[Any, Any]]

_MOST = 8  # echoes in a cell
_TOLD_BY_LINES, _TOLD_BY_PLANES = 1.0, 0.75
"""Beam widths: echoes farther apart are told apart by Bartlett's beams. Of 120 pairs 0.3 to 1.5 of them apart before
rectangles 11 are lost so without a word, of 1.0 28, and no run has more echoes than there are."""
_APART = 0.05  # beam widths: nearer echoes share their power at the noise's whim (not measured)
_ROUNDS = 20  # of seeking the echoes of different folds by turns (not measured)
_STILL = 1e-4  # beam widths: echoes of different folds that move less have arrived (not measured)


def echoes_in(
    snapshot: Complexes, scan: Scan, least: float, distance: float, slots: Slots = LONE, noise: float = 0.0
) -> CellEchoes:
    """Return the echoes of a cell's snapshot (s * a,), of what its slots hold: of waves of that form, spherical or
    plane, of which fewest explain it, or that leave least.

    Args: least, power [W] below which a beam is noise; distance [m] of the cell; slots of transmitters; noise [W] of a
    receiver. Two echoes are told apart where both exceed `least` in their beams and what of both is no plane wave; by
    Bartlett's beams those of one fold only a beam width apart, or three quarters of it where both angles are measured.
    """
    data, most = snapshot[None, :].astype(np.complex128), min(_MOST, len(scan.aperture.elements) // 2)
    mean = float((np.abs(data) ** 2).sum()) / len(scan.aperture.elements)
    fronts = scan.fronts(distance, least / max(mean, 1e-300))
    first, *others = (_Cell(data, front, slots, least, distance, noise) for front in fronts)
    best = first.echoes(most)
    for cell in others:
        # Where several explain all, fewer must; of lone ones the stronger.
        fewer = max(len(best.power) - 1, 1) if best.explained else most
        found = cell.echoes(fewer, best.explained)
        if found.order < (*best.order[:2], best.order[2] - noise * best.explained):
            best = found
    return best


@dataclass(frozen=True, eq=False)
class _Cell:
    """A cell in which echoes are sought."""

    data: Complexes
    """(1, s * a)"""
    scan: Scan
    slots: Slots
    least: float
    """[W]"""
    distance: float
    """[m]"""
    noise: float
    """[W] of a receiver."""

    def echoes(self, most: int, whole: bool = False) -> CellEchoes:
        """Return at most so many echoes; with `whole`, of which it is asked whether they explain the cell."""
        found = self.grown(self.slots.folds[:1], most)
        # Of several folds fewer echoes must explain what is explained.
        fewer = len(found.power) - 1 if found.explained else most
        if fewer > 1 and len(self.slots.folds) > 1:
            found = self.better(found, self.grown(self.slots.folds, fewer))
        found = found if whole and not found.explained else self.judged(found, most)
        return replace(found, left=self._energy(found.by_fold())) if self.scan.known else found

    def sought(self, data: Complexes, h: int, method: str, count: int) -> Floats:
        """Return the cosines (k, 2) of at most `count` echoes folded h times in data (1, s * a)."""
        return estimate(self._channels(data, h), self.scan.aperture, method, count)

    def _channels(self, data: Complexes, h: int) -> Complexes:
        """Return what the transmitters' channels (1, t * a) hold of data (1, s * a) if echoes are folded h times."""
        return self.slots.read_under(data[0], h)[None, : len(self.scan.aperture.elements)]

    def told(self, directions: dict[int, Floats]) -> CellEchoes:
        """Return the echoes from directions (k, 2) by their folds, by least squares."""
        towards = np.concatenate(list(directions.values()))
        fold = np.repeat(list(directions), [len(x) for x in directions.values()])
        weights = np.linalg.pinv(self._waves(directions)).T
        power = np.abs(weights @ self.data[0]) ** 2
        order = np.argsort(-power, kind="stable")
        misfit = self.scan.misfit(towards, np.full(len(towards), self.distance))
        least = max(self.least, float(misfit @ power))
        found = towards[order], power[order], weights[order], fold[order]
        return CellEchoes(*found, self.scan.aperture.steering(towards[order]), misfit[order], least=least)

    def beams_left(self, found: CellEchoes) -> Floats:
        """Return the power (h,) of the strongest beam of what echoes leave, by folds."""
        rest = self._left(found.by_fold())
        beams = [self._channels(rest, h) for h in self.slots.folds]
        own = self.scan.aperture
        return np.array([np.abs(amplitudes(x, own, estimate(x, own, "bartlett", 1))[0, 0]) ** 2 for x in beams])

    def grown(self, folds: range, most: int) -> CellEchoes:
        """Return at most so many echoes of some folds: the strongest, and one more as long as they leave more than
        noise, or than what of them is no plane wave, and all are told apart."""
        found, most = self.told({0: self.sought(self.data, 0, "bartlett", 1)}), max(most, 1)
        while True:
            left = self.beams_left(found)
            found = replace(found, rest=float(left.max()))
            if found.explained or len(found.power) >= most:
                return found
            more = self._more(found, int(left[: len(folds)].argmax()), most)
            if more is None or not self._clear_of_noise(more, found):
                return found
            found = more

    def judged(self, found: CellEchoes, most: int) -> CellEchoes:
        """Return echoes, at most so many, of which what is left is explained, and which of their directions are open,
        where sets of waves are sought together."""
        own, folds = self.scan.aperture, found.by_fold()
        if self.scan.method != "bartlett" or len(folds) > 1:
            return found
        ((h, at),) = folds.items()
        misfit = self.scan.misfit(at, np.full(len(at), self.distance)) * len(own.elements)
        judge = Judge(
            self._channels(self.data, h), own, self.noise, float(misfit @ found.power), self._told_apart("bartlett")
        )
        if (towards := judge.better(at, most)) is not at:
            found = self.told({h: towards})
            found = replace(found, rest=float(self.beams_left(found).max()))
        found = replace(found, open=judge.open(found.direction, bool(found.unsure(own).any())))
        # Of waves that others need to be right those are given that are echoes.
        clear = found.power > self._clear(found) * found.noise_gain
        return found if towards is at or not clear.any() else found.take(clear)

    def _more(self, found: CellEchoes, other: int, most: int) -> CellEchoes | None:
        """Return one echo more than found, or two if all is explained by them: the best two waves of three echoes may
        lie nearer to each other than any of these."""
        more = self._added(found, other)
        if more is not None or len(found.power) + 2 > most:
            return more
        more = self._added(found, other, 2)
        return more if more is not None and float(self.beams_left(more).max()) <= more.least else None

    def _clear_of_noise(self, more: CellEchoes, found: CellEchoes) -> bool:
        """Return whether each of more echoes than found exceeds in its beam what those found count as noise."""
        return bool((more.power > self._clear(found) * more.noise_gain).all())

    def better(self, found: CellEchoes, mixed: CellEchoes) -> CellEchoes:
        """Return echoes of one fold, or those of several, `mixed`, if as many beams of one, told apart or not, leave
        clearly more."""
        if found.explained and not mixed.explained:
            return found
        count = len(mixed.power) if mixed.explained else max(len(found.power), len(mixed.power))
        one = self._by_turns({0: count}, self.scan.method)
        return (
            found if one is None or self._energy(one) <= self._energy(mixed.by_fold()) + self._clear(found) else mixed
        )

    def _added(self, found: CellEchoes, other: int, many: int = 1) -> CellEchoes | None:
        """Return echoes, so many more than found: of a fold that found ones have, or of another if it explains clearly
        more; None where they are not told apart."""
        known = found.by_fold()
        counts = {h: len(x) for h, x in known.items()}
        tried = [counts | {h: counts.get(h, 0) + many} for h in dict.fromkeys([*known, other])]
        # Weak echoes of one snapshot raise no maximum of other methods' spectra, or one beside them: beams find them.
        sets = [self._best_of(tried, method, found) for method in dict.fromkeys([self.scan.method, "bartlett"])]
        told = [way for way in sets if way is not None]
        if not told:
            return None
        return self.told(self._first(told, self.least * len(self.scan.aperture.elements)))

    def _best_of(self, tried: list[dict[int, int]], method: str, found: CellEchoes) -> dict[int, Floats] | None:
        """Return the directions, by folds, of as many echoes as are tried; None where a method tells them not apart."""
        ways = [way for more in tried if (way := self._by_turns(more, method))]
        if not ways:
            return None
        way = self._first(ways, self._clear(found))
        near = any(nearest(x, self.scan.aperture) < self._told_apart(method) for x in way.values())
        return None if near else way

    def _first(self, ways: list[dict[int, Floats]], clear: float) -> dict[int, Floats]:
        """Return the first of sets of directions that leaves no more than any other by a power in all channels."""
        left = [self._energy(way) for way in ways]
        return next(way for way, rest in zip(ways, left, strict=True) if rest <= min(left) + clear)

    def _told_apart(self, method: str) -> float:
        """Return how far apart [beam widths] a method tells echoes."""
        told = _TOLD_BY_PLANES if all(self.scan.aperture.scans) else _TOLD_BY_LINES
        return told if method == "bartlett" else _APART

    def _energy(self, directions: dict[int, Floats]) -> float:
        """Return the power in all channels of what echoes leave."""
        return float((np.abs(self._left(directions)) ** 2).sum())

    def _clear(self, found: CellEchoes) -> float:
        """Return the power in all channels of an echo that a beam tells from noise."""
        return found.least * len(self.scan.aperture.elements)

    def _by_turns(self, counts: dict[int, int], method: str) -> dict[int, Floats] | None:
        """Return the cosines (k, 2) of as many echoes of each fold as are counted, those of each fold sought by turns
        in what the others leave; None where a method finds fewer."""
        found: dict[int, Floats] = {}
        for _ in range(_ROUNDS if len(counts) > 1 else 1):
            before = dict(found)
            for h, count in counts.items():
                rest = self._left(found, h) if found else self.data
                found[h] = self.sought(rest, h, method, count)
                if len(found[h]) < count:
                    return None
            width = self.scan.aperture
            if before and all(width.apart(found[h], before[h]).max() < _STILL for h in counts):
                break
        return found

    def _left(self, directions: dict[int, Floats], but: int | None = None) -> Complexes:
        """Return what echoes leave of the data (1, s * a), fitted by least squares; those of one fold are left too."""
        waves = self._waves(directions)
        parts = self.data @ np.linalg.pinv(waves)
        fold = np.repeat(list(directions), [len(x) for x in directions.values()])
        return np.asarray(self.data - np.where(fold == but, 0.0, parts) @ waves)

    def _waves(self, directions: dict[int, Floats]) -> Complexes:
        """Return what the slots hold (k, s * a) of waves from directions by their folds."""
        held = [self.slots.waves(self.scan.aperture.steering(x), [h] * len(x)) for h, x in directions.items()]
        return np.concatenate(held)
