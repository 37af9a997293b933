"""CFAR: the threshold that noise alone exceeds in a cell with a stated probability.

Training cells lie around the cell under test, beyond a guard, at every second resolution cell, where windowed noise is
nearly independent for any zero padding; the remaining correlation lowers the effective number of cells. Rates wrap.
Near an end of the range axis cells outside are replaced by ones farther out on the other side, so that their number is
the same everywhere. An even guard and the odd one above it (0 and 1, 2 and 3) leave the same training cells.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import betaincinv, gammaincc, gammaincinv

from raychan.radar.side_lobes import correlation
from raychan.records import RangeDoppler
from raychan.units import db

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

METHODS = ("ca", "os")
GUARD, TRAIN = (2, 2), (3, 3)
"""Default guard and training cells (rate, range)."""
RANK = 0.5
"""Rank of the ordered statistic as a share of the training cells: up to half of them may contain targets."""
_STRIDE = 2  # resolution cells between training cells
_GATHER = 1 << 22  # values gathered at a time: bounds memory
_TINY = 1e-300
# Training cells: of more, the share of a beta distribution is too near to 1 to tell what is left of it. The average
# that takes its place gives the same factor at 1e4 cells to 8e-6 of it, for 1 to 1e6 looks.
_MANY = 1e4
_FLAT = 8  # power of a substitution that concentrates integration knots where low probabilities arise


@dataclass(frozen=True)
class Grid:
    """Map cells and resolution cells of a map."""

    pad: tuple[int, int]
    """Map cells per resolution cell (rate, range)."""
    count: tuple[int, int]
    """Resolution cells (rate, range)."""

    @classmethod
    def of(cls, rdmap: RangeDoppler) -> Grid:
        """Return the grid of a map from its axes and resolutions."""
        axes = ((rdmap.rate, rdmap.rate_resolution), (rdmap.range, rdmap.range_resolution))
        pads = [max(1, round(res / (axis[1] - axis[0]))) if len(axis) > 1 else 1 for axis, res in axes]
        counts = [max(1, len(axis) // pad) for (axis, _), pad in zip(axes, pads, strict=True)]
        return cls((pads[0], pads[1]), (counts[0], counts[1]))


@dataclass(frozen=True)
class Training:
    """The training cells, and their effective number."""

    offsets: Ints
    """Map cells (t, 2) from the cell under test (rate, range)."""
    reach: int
    """Map cells by which an offset that falls outside the range axis is moved outwards on the other side."""
    worth: float
    """Effective number of independent cells."""

    def around(self, cells: Ints, shape: tuple[int, ...]) -> tuple[Ints, Ints]:
        """Return the rate and range indices (c, t) of the training cells around map cells (c, 2)."""
        rates, ranges = shape
        off = self.offsets[:, 1]
        r = cells[:, 1:] + off
        # Mirrored and moved outwards, beyond all cells that are used already.
        r = np.where((r >= 0) & (r < ranges), r, cells[:, 1:] - off - np.sign(off) * self.reach) % ranges
        return (cells[:, :1] + self.offsets[:, 0]) % rates, r


def _offsets(count: tuple[int, int], guard: tuple[int, int], train: tuple[int, int]) -> tuple[Ints, list[int]]:
    """Return the training cells (t, 2) in resolution cells, and their extent along each axis in strides."""
    steps = []
    for axis in (0, 1):
        # On half the axis at most, so that no cell is taken twice, neither wrapped nor moved to the other side.
        room = (count[axis] // (2 + 2 * axis) - 1) // _STRIDE
        steps.append(max(0, min(guard[axis] // _STRIDE + train[axis], room)))
    v, r = np.meshgrid(*(_STRIDE * np.arange(-n, n + 1) for n in steps), indexing="ij")
    outside = (np.abs(v) > guard[0]) | (np.abs(r) > guard[1])
    return np.stack([v[outside], r[outside]], axis=1), steps


def fitting_guard(
    count: tuple[int, int], guard: tuple[int, int] | None = None, train: tuple[int, int] | None = None
) -> tuple[int, int] | None:
    """Return the largest guard (rate, range), up to the wanted one, that leaves training cells on a map of `count`
    resolution cells; None if none does. Args: guard and train as for `training`, None for the defaults."""
    wanted, cells = guard or GUARD, train or TRAIN
    for less in range(max(wanted) + 1):
        some = max(0, wanted[0] - less), max(0, wanted[1] - less)
        if len(_offsets(count, some, cells)[0]):
            return some
    return None


def full_count(guard: tuple[int, int], train: tuple[int, int]) -> int:
    """Return the number of training cells on a map with room for all; args as for `training`."""
    inner = [guard[axis] // _STRIDE for axis in (0, 1)]
    return math.prod(2 * (inner[axis] + train[axis]) + 1 for axis in (0, 1)) - math.prod(2 * n + 1 for n in inner)


def training(
    grid: Grid, guard: tuple[int, int], train: tuple[int, int], windows: tuple[str, str] = ("hann", "hann")
) -> Training:
    """Return the training cells: guard in resolution cells, `train` cells on each side beyond it, both (rate, range).

    Args: windows (rate, range) of the map. On a small map there are fewer. Raises: ValueError if there is none.
    """
    if min(*guard, *train) < 0:
        raise ValueError(f"guard = {guard}, train = {train}: must not be negative")
    return _training(grid, tuple(guard), tuple(train), tuple(windows))


@lru_cache(maxsize=4)
def _training(grid: Grid, guard: tuple[int, int], train: tuple[int, int], windows: tuple[str, str]) -> Training:
    """Return the training cells, kept for the next frame of a sequence."""
    cells, steps = _offsets(grid.count, guard, train)
    if not len(cells):
        raise ValueError(
            f"guard = {guard}, train = {train}: no training cells on a map of {grid.count} resolution cells"
        )
    alike = np.ones((len(cells), len(cells)))
    for axis in (0, 1):
        apart = np.arange(2.0 * _STRIDE * steps[axis] + 1.0)
        known = correlation(windows[axis], grid.count[axis], apart)
        alike *= known[np.abs(cells[:, None, axis] - cells[None, :, axis])] ** 2
    return Training(cells * np.array(grid.pad), _STRIDE * steps[1] * grid.pad[1], float(len(cells) ** 2 / alike.sum()))


@lru_cache(maxsize=16)
def factor(pfa: float, count: float, method: str = "ca", looks: int = 1) -> float:
    """Return the threshold over the mean (ca) or the ordered statistic (os) of `count` independent training cells.

    Args: looks, antennas whose powers are averaged in a cell. For one look ca is count (pfa^(-1/count) - 1), and os
    solves pfa = prod_i (count - i) / (count - i + factor), i < RANK count.
    Raises: ValueError on an unknown method or a pfa not between 0 and 1. Source: Finn & Johnson 1968; Rohling 1983.
    """
    if not 0.0 < pfa < 1.0:
        raise ValueError(f"pfa = {pfa!r}: must lie between 0 and 1")
    if method not in METHODS:
        raise ValueError(f"method {method!r}: must be one of {', '.join(METHODS)}")
    if method == "ca" and count <= _MANY:
        # The quantile of an F distribution of 2 looks and 2 looks count degrees, by that of a beta distribution.
        share = float(betaincinv(looks * count, looks, pfa))
        return count * (1.0 - share) / share
    quantiles, weights = quantiles_of(count, method, looks)

    def excess(log_factor: float) -> float:
        return float(np.log(max(weights @ gammaincc(looks, np.exp(log_factor) * quantiles), _TINY) / pfa))

    return float(np.exp(brentq(excess, np.log(1e-6), np.log(1e12))))


def bias(count: float, method: str, looks: int = 1) -> float:
    """Return the expected value of the statistic relative to the mean noise power: 1 for ca."""
    quantiles, weights = _ordered(count, looks)
    return 1.0 if method == "ca" else float(weights @ quantiles) / looks


def least_snr_db(pfa: float, count: float, method: str, looks: int = 1) -> float:
    """Return the least SNR [dB] of an echo that exceeds the threshold, in the mean over the noise of `count`
    independent training cells; args and errors as for `factor`."""
    return float(db(factor(pfa, count, method, looks) * bias(count, method, looks)))


def quantiles_of(count: float, method: str, looks: int = 1) -> tuple[Floats, Floats]:
    """Return quantiles and weights for averages over the training statistic of `count` sums of `looks` exponentials:
    their mean (ca) or their ordered statistic (os)."""
    if method == "os":
        return _ordered(count, looks)
    x, weights = _knots()
    return np.asarray(gammaincinv(looks * count, x) / count), weights


def level(power: Floats, cells: Ints, ring: Training, method: str = "ca") -> Floats:
    """Return the mean or ordered statistic (c,) of the training cells around map cells (c, 2)."""
    out = np.empty(len(cells))
    for at in batches(len(cells), len(ring.offsets)):
        out[at] = statistic(power[ring.around(cells[at], power.shape)], method)
    return out


def batches(count: int, size: int) -> list[slice]:
    """Return slices of `count` rows of which each gathers `size` values, so many at a time as memory should hold."""
    step = max(1, _GATHER // size)
    return [slice(start, start + step) for start in range(0, count, step)]


def statistic(values: Floats, method: str) -> Floats:
    """Return the mean (ca) or the ordered statistic (os) of training cells (c, t)."""
    rank = max(1, round(RANK * values.shape[1])) - 1
    found: Floats = values.mean(axis=1) if method == "ca" else np.partition(values, rank, axis=1)[:, rank]
    return found


def _ordered(count: float, looks: int) -> tuple[Floats, Floats]:
    """Return quantiles and weights for averages over the ordered statistic of `count` sums of `looks` exponentials."""
    x, weights = _knots()
    rank = max(1.0, RANK * count)
    return np.asarray(gammaincinv(looks, betaincinv(rank, count - rank + 1.0, x))), weights


@cache
def _knots() -> tuple[Floats, Floats]:
    """Return probabilities and weights of a quadrature, dense where low probabilities arise; to find them takes longer
    than a small map's detection."""
    knots, weights = np.polynomial.legendre.leggauss(200)
    x = 0.5 * (knots + 1.0)
    return np.asarray(x**_FLAT), np.asarray(0.5 * weights * _FLAT * x ** (_FLAT - 1))
