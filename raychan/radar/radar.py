"""A radar mounted in the world: antennas, waveform, power, noise, and what its receiver does."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from raychan.poses import rotation
from raychan.radar.antenna import Antenna, IsotropicAntenna
from raychan.radar.impairments import Impairments
from raychan.radar.pattern import gain_dbi
from raychan.radar.processing import Processing
from raychan.radar.spherical_vectors import turned, vectors
from raychan.radar.waveform import Waveform
from raychan.units import K_BOLTZMANN, T0, dbm, undb, watt

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_AHEAD, _POWER, _PROCESSING = IsotropicAntenna(front=True), float(watt(12.0)), Processing()
_IDEAL = Impairments()
_NUMBERS = ("yaw_deg", "pitch_deg", "roll_deg", "noise_figure_db", "noise_temperature_k")
_VECTORS = {"position": "(3,)", "velocity": "(3,)", "elements": "(a, 3)"}


@dataclass(frozen=True, eq=False, init=False)
class Radar:
    """A monostatic radar: one transmitter, one or several receivers of one pattern. Defaults as in a scene file.

    Args: waveform; position (3,) [m] of the phase centre in the world; antenna of transmitter and receiver, or
    tx_antenna and rx_antenna of their own; power [W] into the antenna; noise_figure_db [dB]; noise_temperature_k [K] of
    the antenna; noise: whether samples get noise; yaw_deg, pitch_deg, roll_deg [deg] of the boresight; velocity (3,)
    [m/s], world axes; elements (a, 3) [m], the receivers' phase centres in the antenna's frame; processing and
    impairments of the receiver.
    Raises: ValueError for values that cannot be.
    """

    waveform: Waveform
    position: Floats
    antenna: Antenna
    tx_antenna: Antenna | None
    """None: `antenna`."""
    rx_antenna: Antenna | None
    """None: `antenna`."""
    power: float
    noise_figure_db: float
    noise_temperature_k: float
    noise: bool
    yaw_deg: float
    pitch_deg: float
    roll_deg: float
    velocity: Floats
    elements: Floats
    processing: Processing
    impairments: Impairments

    def __init__(
        self,
        waveform: Waveform,
        position: ArrayLike = (0.0, 0.0, 0.5),
        *,
        antenna: Antenna = _AHEAD,
        tx_antenna: Antenna | None = None,
        rx_antenna: Antenna | None = None,
        power: float = _POWER,
        noise_figure_db: float = 15.0,
        noise_temperature_k: float = T0,
        noise: bool = True,
        yaw_deg: float = 0.0,
        pitch_deg: float = 0.0,
        roll_deg: float = 0.0,
        velocity: ArrayLike = (0.0, 0.0, 0.0),
        elements: ArrayLike = ((0.0, 0.0, 0.0),),
        processing: Processing = _PROCESSING,
        impairments: Impairments = _IDEAL,
    ) -> None:
        given = {name: value for name, value in locals().items() if name != "self"}
        if not (power > 0.0 and np.isfinite(power)):
            raise ValueError(f"Radar.power = {power!r}: must be positive and finite")
        for name in _NUMBERS:
            if not np.isfinite(given[name]):
                raise ValueError(f"Radar.{name} = {given[name]!r}: must be finite")
        if noise_temperature_k < 0.0:
            raise ValueError(f"Radar.noise_temperature_k = {noise_temperature_k!r}: must be 0 or more")
        if not (impairments.iq_balanced or waveform.complex_sampling):
            raise ValueError("Radar.impairments: I/Q imbalance needs I/Q sampling, and the waveform has real sampling")
        for name, wanted in _VECTORS.items():
            value = np.array(given[name], np.float64)
            if value.ndim != (1 if wanted == "(3,)" else 2) or value.shape[-1] != 3 or not value.size:
                raise ValueError(f"Radar.{name}: numbers of shape {wanted} wanted, {value.tolist()} given")
            if not np.isfinite(value).all():
                raise ValueError(f"Radar.{name}: finite numbers wanted, {value.tolist()} given")
            value.flags.writeable = False
            given[name] = value
        for name, value in given.items():
            object.__setattr__(self, name, value)

    @property
    def tx(self) -> Antenna:
        """The transmitter's antenna."""
        return self.tx_antenna or self.antenna

    @property
    def rx(self) -> Antenna:
        """The receivers' antenna."""
        return self.rx_antenna or self.antenna

    @cached_property
    def axes(self) -> Floats:
        """Matrix (3, 3) from the antenna's frame to the world's."""
        return rotation(*map(float, np.radians([self.yaw_deg, self.pitch_deg, self.roll_deg])))

    @cached_property
    def kept(self) -> dict[Any, Any]:
        """Cache of what other modules derive from antennas and pose, by class; shared with this radar elsewhere."""
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
        """Thermal noise power per complex sample, k (T_a + T0 (F - 1)) f_s [W], whether or not noise is on."""
        rate = self.waveform.sample_rate
        own = K_BOLTZMANN * T0 * rate * undb(self.noise_figure_db)
        # Apart, so that an antenna at T0 gives k T0 F f_s to the last digit.
        return float(own + K_BOLTZMANN * (self.noise_temperature_k - T0) * rate)

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
