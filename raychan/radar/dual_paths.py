"""Paths to receivers of both polarisations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.columns import column
from raychan.records import Paths


@dataclass(frozen=True)
class DualPaths(Paths):
    """Paths to receivers of both polarisations."""

    cross: NDArray[np.complex128] = column("n", np.complex128, doc="as amplitude, at the cross-polarised receiver")
