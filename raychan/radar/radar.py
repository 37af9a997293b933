"""A radar mounted in the world: antennas, waveform, power, noise, and what its receiver does."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from raychan.limits import KELVIN, NOISE_DB
from raychan.poses import rotation
from raychan.radar.antenna import Antenna, IsotropicAntenna, Repolarized
from raychan.radar.array import (
    Transmission,
    check_multiplexing,
    check_receiver_elsewhere,
    numbers,
    offsets,
    virtual_elements,
)
from raychan.radar.declared import check_declared
from raychan.radar.impairments import Impairments
from raychan.radar.pattern import gain_dbi
from raychan.radar.processing import Processing
from raychan.radar.spherical_vectors import turned, vectors
from raychan.radar.waveform import OwnWaveform, Waveform
from raychan.scalars import is_one_of, shown
from raychan.units import K_BOLTZMANN, T0, dbm, undb, watt

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_AHEAD, _POWER, _PROCESSING = IsotropicAntenna(front=True), float(watt(12.0)), Processing()
_IDEAL = Impairments()


@dataclass(frozen=True, eq=False, init=False)
class Radar:
    """A radar: transmitters of one pattern, receivers of one pattern. Defaults as in a scene file.

    Args: waveform; position (3,) [m] of the phase centre in the world; antenna of transmitter and receiver, or
    tx_antenna and rx_antenna of their own; power [W] into the antenna of each transmitter; noise_figure_db [dB];
    noise_temperature_k [K] of the antenna; noise: whether samples get noise; yaw_deg, pitch_deg, roll_deg [deg] of the
    boresight; velocity (3,) [m/s], world axes; elements (a, 3) and tx_elements (t, 3) [m], phase centres of receivers
    and transmitters in the antenna's frame; multiplexing of the transmitters: "tdm", chirp m is sent by transmitter m
    modulo t, or "ddm", transmitter i advances its phase by i / ddm_slots of a turn from chirp to chirp (default t + 1:
    the empty slot tells folds); rx_polarization V, H or "both" of the receivers; rx_position (3,) [m] of receivers
    elsewhere, with the radar's clock, their rx_velocity [m/s] and rx_yaw_deg [deg] (default the radar's); processing
    and impairments of the receiver.
    Raises: ValueError for values that cannot be, or are of another type.
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
    tx_elements: Floats
    multiplexing: str
    ddm_slots: int | None
    rx_polarization: str | None
    """V, H, or both: co-polarised receivers, then as many cross-polarised ones; None: that of the antenna."""
    rx_position: Floats | None
    """Receivers elsewhere than the transmitter; None: a monostatic radar."""
    rx_velocity: Floats | None
    rx_yaw_deg: float | None
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
        tx_elements: ArrayLike = ((0.0, 0.0, 0.0),),
        multiplexing: str = "none",
        ddm_slots: int | None = None,
        rx_polarization: str | None = None,
        rx_position: ArrayLike | None = None,
        rx_velocity: ArrayLike | None = None,
        rx_yaw_deg: float | None = None,
        processing: Processing = _PROCESSING,
        impairments: Impairments = _IDEAL,
    ) -> None:
        given = {name: value for name, value in locals().items() if name != "self"}
        check_declared(Radar, given)
        if power <= 0.0:
            raise ValueError(f"Radar.power = {power!r}: must be positive")
        NOISE_DB.check("Radar.noise_figure_db", noise_figure_db)
        KELVIN.check("Radar.noise_temperature_k", noise_temperature_k)
        if not (impairments.iq_balanced or waveform.complex_sampling):
            raise ValueError("Radar.impairments: I/Q imbalance needs I/Q sampling, and the waveform has real sampling")
        if impairments.chirp_error is not None and isinstance(waveform, OwnWaveform):
            raise ValueError("Radar.impairments: a chirp error needs linear ramps, and the waveform is one of its own")
        check_receiver_elsewhere(rx_position, rx_velocity, rx_yaw_deg, len(np.atleast_2d(tx_elements)))
        for name in ("position", "velocity", "rx_position", "rx_velocity"):
            if given[name] is not None or not name.startswith("rx_"):
                given[name] = numbers(f"Radar.{name}", given[name], "(3,)")
        for name in ("elements", "tx_elements"):
            given[name] = offsets(f"Radar.{name}", given[name])
        check_multiplexing(multiplexing, len(given["tx_elements"]), given["ddm_slots"])
        if not (rx_polarization is None or is_one_of(rx_polarization, ("V", "H", "both"))):
            raise ValueError(f"Radar.rx_polarization = {shown(rx_polarization)}: must be V, H or both")
        if waveform.stagger and len(given["tx_elements"]) > 1:
            raise ValueError("Radar.tx_elements: one transmitter wanted where the repetition is staggered")
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
        there = None if self.rx_position is None else self.rx_position + time * self.rx_motion
        moved = replace(self, position=self.position + time * self.velocity, rx_position=there)
        moved.__dict__["kept"] = self.kept
        return moved

    @property
    def rx_place(self) -> Floats:
        """Position (3,) [m] of the receivers' phase centre: the radar's, or that of receivers elsewhere."""
        return self.position if self.rx_position is None else self.rx_position

    @property
    def rx_motion(self) -> Floats:
        """Velocity (3,) [m/s] of the receivers, world axes."""
        return self.velocity if self.rx_velocity is None else self.rx_velocity

    @cached_property
    def rx_axes(self) -> Floats:
        """Matrix (3, 3) from the receiving antenna's frame to the world's."""
        if self.rx_yaw_deg is None:
            return self.axes
        return rotation(*map(float, np.radians([self.rx_yaw_deg, self.pitch_deg, self.roll_deg])))

    @property
    def boresight(self) -> Floats:
        """Unit vector (3,) of the boresight in the world."""
        return np.array(self.axes[:, 0])

    @property
    def elements_world(self) -> Floats:
        """Receiver offsets (a, 3) from the position, world axes [m]."""
        return np.array(self.elements @ self.rx_axes.T)

    @property
    def virtual_elements(self) -> Floats:
        """Elements (t * a, 3) [m] of the virtual array in the antenna's frame: row i * a + j is transmitter i with
        receiver j, at the sum of their positions."""
        return virtual_elements(self.tx_elements, self.elements)

    @property
    def receivers(self) -> int:
        """Number of receivers whose samples are recorded: the elements, twice where both polarisations are."""
        return len(self.elements) * (2 if self.rx_polarization == "both" else 1)

    @property
    def slots(self) -> int:
        """By what multiplexing or stagger divides the rates that do not fold: transmitters, slots, staggered times."""
        if self.waveform.stagger:
            return len(self.waveform.stagger)
        count = len(self.tx_elements)
        return self.ddm_slots or count + 1 if self.multiplexing == "ddm" else count

    @property
    def resolved_rate(self) -> float:
        """Range rates between plus and minus this are told apart [m/s], nominal: those of the waveform, or of one
        channel where a single receiver leaves the folds of several transmitters open. Of several transmitters a wrong
        fold may look like another direction: such detections are `ambiguous`."""
        apart = bool(self.waveform.stagger) or len(self.elements) > 1
        return self.waveform.resolved_rate / (1 if apart else self.slots)

    @property
    def transmissions(self) -> tuple[Transmission, ...]:
        """What each transmitter sends, as ramps at equal distances each."""
        places, slots = np.array(self.tx_elements @ self.axes.T), self.slots
        if self.waveform.stagger:
            return tuple(Transmission(places[0], first=k, step=slots) for k in range(slots))
        if self.multiplexing == "tdm":
            return tuple(Transmission(x, first=i, step=slots) for i, x in enumerate(places))
        return tuple(Transmission(x, turn=i / slots) for i, x in enumerate(places))

    @property
    def channel_waveform(self) -> Waveform:
        """The waveform of one virtual channel: fewer chirps, farther apart, over the same frame; of one transmitter the
        waveform itself. Raises: ValueError if the chirps are no multiple of the slots."""
        return self.waveform.every(self.slots)

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

    @property
    def gain_ends(self) -> Floats:
        """Normals (k, 3) of the planes through an antenna behind which its gain ends at once, world axes."""
        both = (self.tx, self.axes), (self.rx, self.rx_axes)
        ahead = [axes[:, 0] for one, axes in both if getattr(getattr(one, "element", one), "front", False)]
        return np.unique(np.reshape(ahead, (-1, 3)), axis=0)

    def tx_field(self, direction_world: Floats) -> Complexes:
        """Return sqrt(gain) times polarisation (n, 3), world axes, in unit directions (n, 3) away from the radar."""
        return self._vector(self.tx, direction_world, self.axes)

    def rx_field(self, direction_world: Floats) -> Complexes:
        """Return sqrt(gain) times polarisation (n, 3), world axes, looking in unit directions (n, 3)."""
        if self.rx_polarization in (None, "both"):
            return self._vector(self.rx, direction_world, self.rx_axes)
        return self._vector(Repolarized(self.rx, str(self.rx_polarization)), direction_world, self.rx_axes)

    def cross_field(self, direction_world: Floats) -> Complexes:
        """Return the same of the cross-polarised receivers: the same pattern with V and H exchanged."""
        return self._vector(Repolarized(self.rx, "cross"), direction_world, self.rx_axes)

    def link_budget(self, sensitivity_dbm: float | None = None) -> dict[str, float]:
        """Return the sums of the link at boresight, by name with unit.

        Args: sensitivity_dbm [dBm] of one channel (a receiver, or a pair of transmitter and receiver), by default the
        noise in its map after coherent processing without windows: of all chirps, by time division of those of one
        transmitter; with real sampling twice as much, for half of an echo's power lies at negative beat frequencies.
        A beam adds all channels in phase, and its sensitivity is lower by `array_gain_db`.
        """
        tx, rx = gain_dbi(self.tx), gain_dbi(self.rx)
        power = float(dbm(self.power))
        noise = float(dbm(self.noise_power))
        wave = self.channel_waveform if self.multiplexing == "tdm" else self.waveform
        added = wave.n_chirps * wave.n_samples / (1.0 if wave.complex_sampling else 2.0)
        coherent, array = 10.0 * float(np.log10(added)), 10.0 * float(np.log10(len(self.virtual_elements)))
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
            "array_gain_db": array,
            "beam_sensitivity_dbm": sensitivity - array,
            "max_path_loss_db": power + tx - sensitivity,
        }

    def _vector(self, antenna: Antenna, direction_world: Floats, axes: Floats) -> Complexes:
        local = turned(np.asarray(direction_world, float), axes)
        found: Complexes = vectors(antenna.field(local), local, axes)
        return found
