"""What the channel asks of a radar: where it is, how it moves, and its antennas' fields."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class RadarEnds(Protocol):
    """What the solver asks of a radar (see radar.radar.Radar)."""

    @property
    def position(self) -> Floats: ...
    @property
    def velocity(self) -> Floats: ...
    def tx_field(self, direction_world: Floats) -> Any: ...
    def rx_field(self, direction_world: Floats) -> Any: ...
