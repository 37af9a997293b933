"""A second radar that transmits into the first one's receiver."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from raychan.radar.declared import check_declared, check_type
from raychan.radar.radar import Radar
from raychan.radar.waveform import OwnWaveform


@dataclass(frozen=True, eq=False)
class Interferer:
    """A second radar: what it sends, from where, and when.

    Args: radar, whose receiver and samples do not matter; start [s] of its first ramp after the victim's; locked:
    whether its ramps keep their phase to the victim's from ramp to ramp, else each begins at a phase of its own.
    Raises: ValueError for another type, a start that is not finite, a waveform of one's own, several transmitters or
    one beside the radar's position.
    """

    radar: Radar
    start: float = 0.0
    locked: bool = False
    name: str = ""
    table: object = None
    """The table of a scene file that it comes from, if any."""

    def __post_init__(self) -> None:
        check_declared(Interferer, vars(self))
        check_type("Interferer.name", self.name, str)
        if len(self.radar.tx_elements) > 1 or isinstance(self.radar.waveform, OwnWaveform):
            raise ValueError("Interferer.radar: one transmitter of linear ramps wanted")
        if self.radar.tx_elements.any():
            at = self.radar.tx_elements[0].tolist()
            raise ValueError(f"Interferer.radar.tx_elements = [{at}] m: [[0, 0, 0]] is wanted; it sends from position")

    def at(self, time: float) -> Interferer:
        """Return the interferer where its velocity has brought it at a time [s]; each frame meets the same timing."""
        return replace(self, radar=self.radar.at(time))

    def ramp_phases(self, rng: np.random.Generator) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        """Return the phases (ramps,) [turns] at which its ramps begin."""
        drawn = rng.random(self.radar.waveform.n_chirps)
        return np.zeros_like(drawn) if self.locked else drawn
