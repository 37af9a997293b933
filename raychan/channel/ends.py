"""What the channel asks of a radar: where it is, how it moves, and its antennas' fields."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from raychan.radar.dual_paths import DualPaths
from raychan.records import Facets, Paths
from raychan.units import C0

Floats = NDArray[np.float64]


class RadarEnds(Protocol):
    """What the solver asks of a radar (see radar.radar.Radar)."""

    @property
    def position(self) -> Floats: ...
    @property
    def velocity(self) -> Floats: ...
    def tx_field(self, direction_world: Floats) -> Any: ...
    def rx_field(self, direction_world: Floats) -> Any: ...


@dataclass(frozen=True)
class Ends:
    """Where transmitter and receiver are (3,) [m] and how they move (3,) [m/s]."""

    tx: Floats
    rx: Floats
    tx_velocity: Floats
    rx_velocity: Floats


def ends_of(radar: RadarEnds) -> Ends:
    """Return the ends of a radar; one without `rx_position` is monostatic."""
    here, moves = np.asarray(radar.position, float), np.asarray(radar.velocity, float)
    there = getattr(radar, "rx_position", None)
    if there is None:
        return Ends(here, here, moves, moves)
    given: Any = radar
    return Ends(here, np.asarray(there, float), moves, np.asarray(given.rx_motion, float))


def swept_by(radar: RadarEnds) -> float:
    """Return the frequency [Hz] that a radar sweeps from the carrier, to which phases refer, to the middle of its ramp,
    where gains are taken: of a wide band they are those of the mean frequency. 0 for ends without a waveform."""
    return float(getattr(getattr(radar, "waveform", None), "swept", 0.0))


def at_start(facets: Facets, radar: RadarEnds, columns: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Return columns of paths, among them length, length_rate and amplitudes, at the start of the radar's frame:
    carried back by their rates from the instant at which the facets stand, with the gains of that instant."""
    if facets.since == 0.0:
        return columns
    wave: Any = radar.waveform  # type: ignore[attr-defined]
    grown = facets.since * columns["length_rate"]
    back = np.exp(2j * np.pi * wave.carrier / C0 * grown)
    turned = {name: columns[name] * back for name in ("amplitude", "cross") if name in columns}
    return columns | turned | {"length": columns["length"] - grown}


def rx_fields(radar: RadarEnds) -> tuple[Any, ...]:
    """Return the receivers' fields: the co-polarised, and the cross-polarised where the radar has such receivers."""
    if getattr(radar, "rx_polarization", None) == "both":
        return radar.rx_field, radar.cross_field  # type: ignore[attr-defined]
    return (radar.rx_field,)


def paths_record(radar: RadarEnds) -> type[Paths]:
    """Return the class of a radar's paths: DualPaths where it has receivers of both polarisations."""
    return Paths if len(rx_fields(radar)) == 1 else DualPaths
