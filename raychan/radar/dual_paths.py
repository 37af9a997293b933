"""Paths to receivers of both polarisations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.columns import column
from raychan.parallel import parallel_for
from raychan.records import Paths

_MANY = 20_000  # products from which on a second thread pays; not measured


@dataclass(frozen=True)
class DualPaths(Paths):
    """Paths to receivers of both polarisations."""

    cross: NDArray[np.complex128] = column("n", np.complex128, doc="as amplitude, at the cross-polarised receiver")


def amplitudes_of(paths: Paths) -> tuple[str, ...]:
    """Return the names of the columns that hold amplitudes."""
    return ("amplitude", "cross") if isinstance(paths, DualPaths) else ("amplitude",)


def columns_of(paths: Paths) -> tuple[str, ...]:
    """Return the names of the columns of numbers that have a row a path."""
    return "length", "length_rate", "aside", *amplitudes_of(paths)


def scaled(paths: Paths, factor: NDArray[Any] | float) -> Paths:
    """Return paths with their amplitudes, of both polarisations, times a factor (n,), or one for all."""
    every = np.broadcast_to(factor, paths.length.shape)
    return paths.rebuilt(**{name: products(getattr(paths, name), every) for name in amplitudes_of(paths)})


def products(a: NDArray[np.complex128], b: NDArray[Any]) -> NDArray[np.complex128]:
    """Return a times b (n,), by all threads."""
    out = np.empty(len(a), np.complex128)

    def some(at: slice) -> None:
        np.multiply(a[at], b[at], out=out[at])

    parallel_for(len(out), some, _MANY)
    return out
