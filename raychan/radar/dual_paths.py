"""Paths to receivers of both polarisations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.columns import column
from raychan.records import Paths


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


def scaled(paths: Paths, factor: NDArray[Any]) -> Paths:
    """Return paths with their amplitudes, of both polarisations, times a factor (n,)."""
    return paths.rebuilt(**{name: getattr(paths, name) * factor for name in amplitudes_of(paths)})
