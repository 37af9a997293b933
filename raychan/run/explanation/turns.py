"""Waves over several surfaces, by the surface on which they are taken to scatter: by reciprocity all bring alike.

On all but one surface a wave is mirrored, on one currents radiate. Which one is a matter of how rays are followed, and
is of no account where rays come back; off that direction only edges return, and it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.records import NONE, SCATTER, TRANSMIT
from raychan.units import db

Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Turns:
    """Chains of parts by the surface on which the wave scatters: `turn` (g,) numbers chains that are the same in that
    too, the way round aside; `way` (t,) numbers turns that are the same but for it, `count` (w,) of each way."""

    turn: Ints
    way: Ints
    count: Ints

    def off_db(self, summed: NDArray[np.complex128]) -> float:
        """Return by how much [dB] a cell's level changes as its waves are taken to scatter on one surface or another.

        Args: summed (g,) what each chain brings to the cell.
        """
        several = self.count[self.way] > 1
        whole = abs(summed.sum())
        if not several.any() or not whole > 0.0:
            return 0.0
        wave = added(self.turn, summed, len(self.way))
        mean = (added(self.way, wave, len(self.count)) / self.count)[self.way]
        # All by one turn are `count` times what it brings, in place of the sum over turns; ways are not related.
        off = self.count[self.way] * np.abs(wave - mean) ** 2
        return float(2.0 * db(1.0 + np.sqrt(off[several].sum()) / whole))


def turns_of(names: Sequence[tuple[str, ...]], kinds: NDArray[np.int8], one_end: bool) -> Turns:
    """Return the turns of chains of parts with interactions (g, d); one_end: a chain and its reverse are one."""
    ways: dict[tuple[tuple[str, ...], bool], int] = {}
    turns: dict[tuple[int, int], int] = {}
    found = []
    for name, kind in zip(names, kinds, strict=True):
        met = kind[kind != NONE]
        plain = tuple(n for n, k in zip(name, met, strict=True) if k != TRANSMIT)
        at = np.flatnonzero(met[met != TRANSMIT] == SCATTER)
        place = int(at[0]) if len(at) == 1 else -1
        if one_end and place >= 0:
            plain, place = min((plain, place), (plain[::-1], len(plain) - 1 - place))
        # What scatters diffusely, at points or wedges, is another wave, not another turn of this one.
        way = ways.setdefault((plain, place >= 0), len(ways))
        found.append(turns.setdefault((way, place), len(turns)))
    way_of = np.array([way for way, _ in turns], np.int64)
    return Turns(np.array(found, np.int64), way_of, np.bincount(way_of, minlength=len(ways)))


def added(index: Ints, values: NDArray[np.complex128], count: int) -> NDArray[np.complex128]:
    """Return the sums (count,) of values (n,) by their numbers (n,)."""
    return np.bincount(index, values.real, count) + 1j * np.bincount(index, values.imag, count)
