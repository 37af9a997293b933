"""Sensor: a radar mounted in the world: antennas, waveform, power and noise."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.poses import rotation
from raychan.radar.antenna import Antenna
from raychan.radar.pattern import gain_dbi
from raychan.radar.spherical_vectors import turned, vectors
from raychan.radar.waveform import Waveform
from raychan.units import K_BOLTZMANN, T0, dbm, undb

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Radar:
    """A monostatic radar: one transmitter, one or several receivers of the same pattern."""

    position: Floats
    """Phase centre (3,) in the world [m]."""
    tx: Antenna
    rx: Antenna
    waveform: Waveform
    power: float
    """Transmitted power into the antenna [W]."""
    noise_figure_db: float
    yaw: float = 0.0
    pitch: float = 0.0
    roll: float = 0.0
    velocity: Floats = field(default_factory=lambda: np.zeros(3))
    """World axes (3,) [m/s]."""
    elements: Floats = field(default_factory=lambda: np.zeros((1, 3)))
    """Receiver phase centres (a, 3) in the antenna's frame [m]."""
    noise: bool = True

    def __post_init__(self) -> None:
        if not (self.power > 0.0 and np.isfinite(self.power)):
            raise ValueError(f"Sensor.power = {self.power!r}: must be positive and finite")
        for name in ("yaw", "pitch", "roll", "noise_figure_db"):
            if not np.isfinite(getattr(self, name)):
                raise ValueError(f"Sensor.{name} = {getattr(self, name)!r}: must be finite")
        for name, dimensions in (("position", 1), ("velocity", 1), ("elements", 2)):
            value = np.array(getattr(self, name), np.float64)
            if value.ndim != dimensions or value.shape[-1] != 3 or not value.size or not np.isfinite(value).all():
                wanted = ("(3,)", "(a, 3)")[dimensions - 1]
                raise ValueError(f"Sensor.{name}: finite numbers of shape {wanted} wanted, {value.tolist()} given")
            value.flags.writeable = False
            object.__setattr__(self, name, value)

    @cached_property
    def axes(self) -> Floats:
        """Matrix (3, 3) from the antenna's frame to the world's."""
        return rotation(self.yaw, self.pitch, self.roll)

    @cached_property
    def kept(self) -> dict[Any, Any]:
        """What others make of the antennas and how they stand, by its class; shared with the same radar elsewhere."""
        return {}

    def at(self, time: float) -> Radar:
        """Return the radar where its velocity has brought it at a time [s]."""
        moved = replace(self, position=self.position + time * self.velocity)
        moved.__dict__["kept"] = self.kept
        return moved

    @property
    def boresight(self) -> Floats:
        """Unit vector (3,) of the boresight in the world."""
        return np.array(self.axes[:, 0])

    @property
    def elements_world(self) -> Floats:
        """Receiver offsets (a, 3) from the position, world axes [m]."""
        return np.array(self.elements @ self.axes.T)

    @property
    def ego_speed(self) -> float:
        """Own speed, positive along the boresight [m/s]: what is added to a range rate to give a speed."""
        size = float(np.linalg.norm(self.velocity))
        return float(np.copysign(size, self.boresight @ self.velocity)) if size else 0.0

    @property
    def noise_power(self) -> float:
        """Thermal noise power per complex sample, k T0 F f_s [W], whether or not noise is on."""
        return float(K_BOLTZMANN * T0 * self.waveform.sample_rate * undb(self.noise_figure_db))

    def tx_field(self, direction_world: Floats) -> Complexes:
        """Return sqrt(gain) times polarisation (n, 3), world axes, in unit directions (n, 3) away from the radar."""
        return self._vector(self.tx, direction_world)

    def rx_field(self, direction_world: Floats) -> Complexes:
        """Return sqrt(gain) times polarisation (n, 3), world axes, looking in unit directions (n, 3)."""
        return self._vector(self.rx, direction_world)

    def link_budget(self, sensitivity_dbm: float | None = None) -> dict[str, float]:
        """Return the sums of the link at boresight, by name with unit.

        Args: sensitivity_dbm [dBm], by default the noise of a frame after coherent processing without windows.
        """
        tx, rx = gain_dbi(self.tx), gain_dbi(self.rx)
        power = float(dbm(self.power))
        noise = float(dbm(self.noise_power))
        coherent = 10.0 * float(np.log10(self.waveform.n_chirps * self.waveform.n_samples))
        sensitivity = noise - coherent if sensitivity_dbm is None else sensitivity_dbm
        return {
            "power_dbm": power,
            "tx_gain_dbi": tx,
            "rx_gain_dbi": rx,
            "eirp_dbm": power + tx,
            "wavelength_m": self.waveform.wavelength,
            "noise_figure_db": self.noise_figure_db,
            "noise_dbm": noise,
            "coherent_gain_db": coherent,
            "sensitivity_dbm": sensitivity,
            "max_path_loss_db": power + tx - sensitivity,
        }

    def _vector(self, antenna: Antenna, direction_world: Floats) -> Complexes:
        local = turned(np.asarray(direction_world, float), self.axes)
        found: Complexes = vectors(antenna.field(local), local, self.axes)
        return found
