"""Arrays: where antenna elements stand, which chirps each transmitter sends, and how much longer a path is between two
elements than between the phase centres."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, TypedDict

import numpy as np
from numpy.typing import ArrayLike, NDArray

from raychan.radar.declared import check_type, finite, reals
from raychan.radar.wave_kernels import lengthen, quicken
from raychan.scalars import is_one_of, meant, plain, shown

Floats = NDArray[np.float64]

MULTIPLEXING = ("none", "tdm", "ddm")
"""How transmitters are told apart: there is one; by time division; by Doppler division."""


_MOST = 4096  # elements of a line: as many as a scene file takes
_WIDEST = 1.0  # m off the phase centre: a wider array is a slip of unit, or another receiver


def numbers(name: str, given: ArrayLike, wanted: str) -> Floats:
    """Return finite numbers of shape (3,) or (n, 3), read-only. Raises: ValueError that names the argument."""
    try:
        value = reals(name, given)
    except ValueError:
        raise ValueError(f"{name}: numbers of shape {wanted} wanted, {shown(given)} given") from None
    if value.ndim != (1 if wanted == "(3,)" else 2) or value.shape[-1] != 3 or not value.size:
        raise ValueError(f"{name}: numbers of shape {wanted} wanted, {value.tolist()} given")
    if not np.isfinite(value).all():
        raise ValueError(f"{name}: finite numbers wanted, {value.tolist()} given")
    value.flags.writeable = False
    return value


def offsets(name: str, given: ArrayLike) -> Floats:
    """Return elements (n, 3) [m] of an array. Raises: ValueError on none, or on one too far off to belong to it."""
    value = numbers(name, given, "(n, 3)")
    far = max(math.hypot(*place) for place in value.tolist())
    if far > _WIDEST:
        raise ValueError(
            f"{name}: an element is {far:g} m off the phase centre; at most {_WIDEST:g} m (positions are in metres)"
        )
    return value


def check_multiplexing(multiplexing: str, transmitters: int, slots: int | None) -> None:
    """Raise ValueError on an unknown way to tell transmitters apart, or one that does not fit their number."""
    if not is_one_of(multiplexing, MULTIPLEXING):
        allowed = f"must be one of {', '.join(MULTIPLEXING)}{meant(multiplexing, MULTIPLEXING)}"
        raise ValueError(f"Radar.multiplexing = {shown(multiplexing)}: {allowed}")
    if multiplexing == "none" and transmitters > 1:
        raise ValueError(f"Radar.multiplexing = 'none': {transmitters} transmitters need 'tdm' or 'ddm'")
    if slots is None:
        return
    if multiplexing != "ddm":
        raise ValueError(f"Radar.ddm_slots = {slots!r}: only for multiplexing = 'ddm'")
    if int(slots) != slots or not transmitters <= slots <= 64:
        raise ValueError(f"Radar.ddm_slots = {slots!r}: a whole number from {transmitters} to 64 is wanted")


def uniform_array(n: int, spacing: float, axis: str = "y") -> Floats:
    """Return a uniform line of elements (n, 3) [m] about the origin of the antenna's frame.

    Args: n elements; spacing [m]; axis y (to the left) or z (up). Raises: ValueError for values that cannot be.

    >>> uniform_array(3, 0.002)[:, 1].tolist()
    [-0.002, 0.0, 0.002]
    """
    count, step = _count("n", n), _spacing(spacing)
    if not is_one_of(axis, ("y", "z")):
        raise ValueError(f"axis = {shown(axis)}: must be y or z")
    out = np.zeros((count, 3))
    out[:, "xyz".index(axis)] = step * (np.arange(count) - 0.5 * (count - 1))
    return out


def _count(name: str, given: object) -> int:
    """Return a number of elements. Raises: ValueError that names the argument, where it cannot be."""
    check_type(name, given, int)
    if not 1 <= plain(given) <= _MOST:
        raise ValueError(f"{name} = {given!r}: must lie between 1 and {_MOST}")
    return int(plain(given))


def _spacing(given: object) -> float:
    """Return a spacing [m]. Raises: ValueError where it cannot be."""
    step = finite("spacing", given)
    if step <= 0.0:
        raise ValueError(f"spacing = {given!r}: must be positive and finite [m]")
    return step


def check_receiver_elsewhere(position: object, velocity: object, yaw_deg: object, transmitters: int) -> None:
    """Raise ValueError where what is said of receivers elsewhere does not fit."""
    if position is None and not (velocity is None and yaw_deg is None):
        raise ValueError("Radar.rx_velocity and rx_yaw_deg: only with rx_position")
    if position is not None and transmitters > 1:
        raise ValueError("Radar.tx_elements: one transmitter wanted where the receivers stand elsewhere (rx_position)")


class ArrayElements(TypedDict):
    """Elements of a MIMO radar, named as the arguments of `Radar`."""

    tx_elements: Floats
    elements: Floats


def mimo_array(n_tx: int, n_rx: int, spacing: float) -> ArrayElements:
    """Return the elements of a MIMO radar whose virtual array is a uniform line along y, as arguments of `Radar`.

    Args: n_tx transmitters, n_rx receivers; spacing [m] of the receivers and of the n_tx * n_rx virtual elements.
    Returns: tx_elements (n_tx, 3) and elements (n_rx, 3) [m].
    Source: Li, Stoica, IEEE Signal Process. Mag. 24(5), 2007.

    >>> array = mimo_array(3, 8, 0.002)
    >>> len(array["tx_elements"]), len(array["elements"])
    (3, 8)
    """
    sent, heard, step = _count("n_tx", n_tx), _count("n_rx", n_rx), _spacing(spacing)
    return {"tx_elements": uniform_array(sent, heard * step), "elements": uniform_array(heard, step)}


def virtual_elements(tx: ArrayLike, rx: ArrayLike) -> Floats:
    """Return the virtual elements (t * a, 3) [m] of transmitters (t, 3) and receivers (a, 3) [m]: each pair acts as one
    element at the sum of both positions, row i * a + j that of transmitter i and receiver j."""
    return np.asarray((np.asarray(tx, float)[:, None] + np.asarray(rx, float)[None]).reshape(-1, 3))


@dataclass(frozen=True, eq=False)
class Transmission:
    """What one transmitter sends: every `step`-th chirp from number `first` on, its phase advanced by `turn` [turns]
    from chirp to chirp of the frame."""

    offset: Floats
    """Position (3,) [m] from the phase centre, world axes."""
    first: int = 0
    step: int = 1
    turn: float = 0.0

    def since(self, chirp: int) -> Transmission:
        """Return the same with chirps counted from another number on, but for the phase."""
        return Transmission(self.offset, (self.first - chirp) % self.step, self.step, self.turn)

    def code(self, chirps: NDArray[Any]) -> NDArray[np.complex128]:
        """Return the phasors (n,) of chirps (n,) by their numbers."""
        return np.asarray(np.exp(2j * np.pi * (self.turn * chirps % 1.0)))


def reach(radar: Any) -> tuple[float, float]:
    """Return how far [m] the transmitters and the receivers of a radar stand off its phase centres, at most."""
    sent, heard = (float(np.linalg.norm(x, axis=1).max(initial=0.0)) for x in _offsets(radar))
    return sent, heard


def half_axes(radar: Any) -> Floats:
    """Return the half axes (2, 3, 3) [m] of boxes about the phase centres of transmitters and receivers in which all
    elements stand, along the principal axes of these."""
    boxes = np.zeros((2, 3, 3))
    for box, offsets in zip(boxes, _offsets(radar), strict=True):
        axes = np.linalg.svd(offsets, full_matrices=False)[2]
        box[: len(axes)] = axes * np.abs(offsets @ axes.T).max(axis=0, initial=0.0)[:, None]
    return boxes


def _offsets(radar: Any) -> tuple[Floats, Floats]:
    """Return where transmitters and receivers (n, 3) [m] stand off the phase centres."""
    tx = [one.offset for one in getattr(radar, "transmissions", ())]
    return np.reshape(tx, (-1, 3)), np.reshape(getattr(radar, "elements_world", ()), (-1, 3))


@dataclass(frozen=True, eq=False)
class Wavefronts:
    """The spherical waves of paths at both ends; a row a path.

    A wave arrives from its last scatterer's image over the mirrors behind it, `radius` away; likewise at the
    transmitter by reciprocity. A path without a scatterer has one wave, of the whole length, and `bare` set.
    """

    arrival: Floats
    """Unit directions (n, 3) to which the receiver looks, world axes."""
    radius: Floats
    """(n,) [m] from the receiver."""
    departure: Floats
    """Unit directions (n, 3) in which the transmitter radiates."""
    tx_radius: Floats
    """(n,) [m] from the transmitter."""
    bare: NDArray[np.bool_]
    drift: Floats | None = None
    """Velocities (n, 2, 3) [m/s] of the waves' sources relative to transmitter and receiver; None where they stand."""
    instant: Floats | float = 0.0
    """When the sources are there (n,) [s]."""

    def __getitem__(self, rows: Any) -> Wavefronts:
        drift, instant = (None, 0.0) if self.drift is None else (self.drift[rows], np.asarray(self.instant)[rows])
        ends = self.arrival[rows], self.radius[rows], self.departure[rows], self.tx_radius[rows]
        return Wavefronts(*ends, self.bare[rows], drift, instant)

    def moved(self, rows: NDArray[np.int64], aside: Floats) -> Wavefronts:
        """Return the waves of which those in rows (r,) come from elsewhere: by `aside` (r, 2, 3) [m], seen from the
        transmitter and from the receiver."""
        looks, radii = (self.departure.copy(), self.arrival.copy()), (self.tx_radius.copy(), self.radius.copy())
        for end, (look, radius) in enumerate(zip(looks, radii, strict=True)):
            source = look[rows] * radius[rows, None] + aside[:, end]
            radius[rows] = np.linalg.norm(source, axis=1)
            look[rows] = source / np.maximum(radius[rows], 1e-300)[:, None]
        return Wavefronts(looks[1], radii[1], looks[0], radii[0], self.bare, self.drift, self.instant)

    def between(self, tx: Floats, rx: Floats) -> tuple[Floats, Floats]:
        """Return how much longer (n,) [m] paths are between elements at tx and rx (3,) [m] off the phase centres, and
        by which factor (n,) their amplitude is larger, as the waves spread over less or more."""
        longer, factor = np.zeros(len(self.radius)), np.ones(len(self.radius))
        if rx.any():
            lengthen(self.radius, self.arrival, rx, longer, factor)
        if tx.any():
            lengthen(self.tx_radius, self.departure, tx, longer, factor)
            rows = np.flatnonzero(self.bare)
            if len(rows):
                longer[rows] = self[rows]._longer_bare(tx, rx)
                factor[rows] = _spread(self.radius[rows], longer[rows])
        return longer, factor

    def faster(self, tx: Floats, rx: Floats) -> Floats:
        """Return by how much faster (n,) [m/s] paths grow between elements at tx and rx (3,) [m] off the phase
        centres."""
        out = np.zeros(len(self.radius))
        if self.drift is not None:
            if rx.any():
                quicken(self.radius, self.arrival, np.ascontiguousarray(self.drift[:, 1]), rx, out)
            if tx.any():
                quicken(self.tx_radius, self.departure, np.ascontiguousarray(self.drift[:, 0]), tx, out)
        return out

    def fastest(self, tx: float, rx: float) -> float:
        """Return a bound on `faster` [m/s] between elements at most tx and rx [m] off the phase centres."""
        if self.drift is None or not len(self.radius):
            return 0.0
        most = np.zeros(len(self.radius))
        for off, look, radius, drift in (
            (tx, self.departure, self.tx_radius, self.drift[:, 0]),
            (rx, self.arrival, self.radius, self.drift[:, 1]),
        ):
            # Directions turn by at most asin(off / radius), by any angle nearer than that.
            sine = np.where(radius > off, off / np.maximum(radius, 1e-300), 1.0)
            back = np.where(radius > off, 1.0 - np.sqrt(1.0 - sine**2), 2.0)
            along = np.abs(np.einsum("ni,ni->n", drift, look))
            across = np.sqrt(np.maximum(np.einsum("ni,ni->n", drift, drift) - along**2, 0.0))
            most += across * sine + along * back
        return float(most.max())

    def _longer_bare(self, tx: Floats, rx: Floats) -> Floats:
        """Return the same of paths over one mirror or none: the transmitter's image moves as the mirror shows it."""
        normal = self.departure + self.arrival
        size = np.linalg.norm(normal, axis=1, keepdims=True)
        normal = np.divide(normal, size, out=np.zeros_like(normal), where=size > 1e-6)
        shown = tx - 2.0 * (normal @ tx)[:, None] * normal
        off = rx - shown
        along, square = (self.arrival * off).sum(axis=1), (off * off).sum(axis=1)
        far = np.sqrt(np.maximum(self.radius * (self.radius - 2.0 * along) + square, 0.0)) + self.radius
        return np.asarray((square - 2.0 * self.radius * along) / np.maximum(far, 1e-300))


def _spread(radius: Floats, more: Floats) -> Floats:
    """Return by which factor (n,) spherical waves are stronger `more` (n,) [m] farther off than a radius (n,) [m]."""
    far = radius + more
    return np.divide(radius, far, out=np.ones(len(far)), where=far > 0.0)


def wavefronts(
    stops: Floats, scatterer: NDArray[np.signedinteger[Any]], departure: Floats, arrival: Floats, length: Floats
) -> Wavefronts:
    """Return the waves of paths at both ends.

    Args: stops (n, d + 2, 3) [m] from transmitter to receiver, unused slots repeat the receiver; scatterer (n,) its
    slot among the inner stops, -1 where there is none; departure, arrival (n, 3) unit directions; length (n,) [m].
    """
    steps = np.linalg.norm(np.diff(np.asarray(stops, float), axis=1), axis=2)
    way_in = np.arange(steps.shape[1])[None] <= scatterer[:, None]
    bare = scatterer < 0
    radius = np.where(bare, length, np.where(way_in, 0.0, steps).sum(axis=1))
    tx_radius = np.where(bare, length, np.where(way_in, steps, 0.0).sum(axis=1))
    return Wavefronts(np.asarray(arrival), radius, np.asarray(departure, float), tx_radius, bare)
