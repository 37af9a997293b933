"""Where paths went: what the paths over one footprint share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from raychan.columns import Record, column

Floats = NDArray[np.float64]
Vectors = NDArray[np.float32] | NDArray[np.float64]


@dataclass(frozen=True)
class Trajectories(Record):
    """Where paths went; a row a trajectory, d slots a chain. Float32 but for specular paths (`ExactTrajectories`)."""

    departure: Vectors = column("w 3", np.float32, doc="unit direction of departure, world axes")
    arrival: Floats = column("w 3", doc="unit direction towards which the receiver looks, world axes")
    body: NDArray[np.int16] = column("w d", np.int16)
    part: NDArray[np.int16] = column("w d", np.int16)
    kind: NDArray[np.int8] = column("w d", np.int8)
    vertices: Vectors = column("w d 3", np.float32, unit="m", doc="unused slots repeat the receiver")
    drift: Vectors = column("w e 3", np.float32, unit="m/s", doc="of the waves' sources, relative to tx and rx")
    instant: Floats = column("w", unit="s", doc="of vertices and directions, from the frame's start")

    @classmethod
    def of(cls, **columns: Any) -> Self:
        """Return trajectories of columns, at the frame's start and without drift where none is given."""
        count = len(columns["kind"])
        none: dict[str, Any] = {"drift": np.zeros((count, 0, 3), np.float32), "instant": np.zeros(count)}
        return cls(**(none | columns))


@dataclass(frozen=True)
class ExactTrajectories(Trajectories):
    """Trajectories in double precision."""

    departure: Floats = column("w 3", doc="unit direction of departure, world axes")
    vertices: Floats = column("w d 3", unit="m", doc="unused slots repeat the receiver")
