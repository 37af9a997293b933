"""READ FIRST: the records that flow between the floors.

    Scene -> Facets -> Routes -> Paths -> Profile
                                 Paths -> Cube -> RangeDoppler -> Detections

Every record is a frozen struct of arrays, one row a thing, checked when built (`raychan.columns`).
Integer sentinel: -1 means "none". SI units and radians throughout.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.columns import Record, column
from raychan.kinds import *  # noqa: F403
from raychan.reprs import Plotted
from raychan.trajectories import Trajectories
from raychan.units import C0

Floats = NDArray[np.float64]
Vectors = NDArray[np.float32] | NDArray[np.float64]
Complexes = NDArray[np.complexfloating[Any, Any]]
Ints = NDArray[np.signedinteger[Any]]


@dataclass(frozen=True)
class Materials(Record):
    """Materials at one frequency; a row a material."""

    kind: Ints = column("m", np.int8, doc="PEC, HALF_SPACE or LAYER")
    eps: Complexes = column("m", np.complex128, doc="relative permittivity eps_r - j sigma/(omega eps0); 1 for PEC")
    thickness: Floats = column("m", unit="m", doc="layer thickness; 0 unless LAYER")
    roughness: Floats = column("m", unit="m", doc="rms height")
    diffuse: tuple[object, ...] = ()  # how each scatters diffusely (em.diffuse.Diffuse or None); empty: none does


@dataclass(frozen=True)
class Facets(Record):
    """All triangles of a scene at one instant, in the world frame; n facets, b bodies, m materials."""

    vertices: Floats = column("n 3 3", unit="m", doc="corners, counter-clockwise seen from outside")
    normals: Floats = column("n 3 3", doc="unit outward normals of the true surface at the corners")
    body: Ints = column("n", np.int32)
    part: Ints = column("n", np.int32)
    material: Ints = column("n", np.int32)
    role: Ints = column("b", np.int8, doc="SCATTERER, MIRROR or BLOCKER")
    origin: Floats = column("b 3", unit="m", doc="body origins")
    velocity: Floats = column("b 3", unit="m/s")
    spin: Floats = column("b 3", unit="rad/s", doc="turn rate vector about the body origin")
    materials: Materials
    body_names: tuple[str, ...]
    part_names: tuple[str, ...]
    attenuation: float = 0.0
    """Of the air between them: a field falls by exp(-attenuation L) over a length L [1/m]."""
    since: float = 0.0  # s from the start of the radar's frame to this instant: paths are carried back to the start


@dataclass(frozen=True)
class Points(Record):
    """Targets given by their RCS; a row a target, standing on body `body`, which blocks other rays but not its own."""

    position: Floats = column("n 3", unit="m")
    velocity: Floats = column("n 3", unit="m/s")
    body: Ints = column("n", np.int32)
    azimuth: Floats = column("t", unit="rad", doc="knots of the RCS table relative to heading, from -pi to pi")
    sigma: Floats = column("n t", unit="m2", doc="RCS seen from each azimuth")
    heading: Floats = column("n", unit="rad")


@dataclass(frozen=True)
class Routes(Record):
    """Where waves went: chains of vertices from transmitter to receiver, no field yet; n routes, d slots a chain.

    Exactly one vertex of a tube scatters by physical optics over a triangular footprint (slot `scatter`); all
    others are mirrors or layers. A route without footprint (`scatter` = -1) is an exact specular path.
    """

    tx: Floats = column("3", unit="m", doc="or the unit direction of a far transmitter")
    rx: Floats = column("3", unit="m", doc="or the unit direction of a far receiver")
    far: bool
    vertices: Floats = column("n d 3", unit="m", doc="vertices in order; unused slots repeat rx")
    normals: Floats = column("n d 3", doc="unit normals on the lit side; 0 in unused slots")
    facet: Ints = column("n d", np.int32)
    body: Ints = column("n d", np.int16)
    kind: Ints = column("n d", np.int8)
    scatter: Ints = column("n", np.int8)
    points: Floats = column("n 6 3", unit="m", doc="footprint: corners, then middles of its edges; 0 without footprint")
    lengths: Floats = column("n 6", unit="m", doc="total lengths through the footprint's corners and edge middles")
    length: Floats = column("n", unit="m", doc="total length through the vertices")
    taper: Floats = column("n 3", doc="how strongly each corner is lit and seen, relative to the centre")
    area: Floats = column("n", unit="m2", doc="footprint area seen; 0 without footprint")
    spread_in: Floats = column("n", unit="1/m", doc="field spreading tx to scatterer (1/L in free space)")
    spread_out: Floats = column("n", unit="1/m", doc="field spreading rx to scatterer")
    caustics: Ints = column("n", np.int8, doc="caustics passed on the leg in; each advances the phase by pi/2")
    sigma: Floats = column("n", unit="m2", doc="RCS of a POINT vertex; 0 else")


@dataclass(frozen=True)
class DiffractedRoutes(Record):
    """Where waves went to point targets over the edges of wedges, no field yet; n routes of two legs each, d slots.

    A leg (axis 2: in, then out) is straight, or runs over one wedge.
    """

    end: Floats = column("3", unit="m", doc="the radar")
    vertices: Floats = column("n d 3", unit="m", doc="vertices in order; unused slots repeat the radar")
    body: Ints = column("n d", np.int16)
    part: Ints = column("n d", np.int16)
    kind: Ints = column("n d", np.int8)
    target: Floats = column("n 3", unit="m", doc="the point target")
    target_velocity: Floats = column("n 3", unit="m/s")
    sigma: Floats = column("n", unit="m2", doc="its RCS from the one leg to the other")
    leaves: Floats = column("n 2 3", doc="unit direction of the leg at the radar, outward")
    arrives: Floats = column("n 2 3", doc="unit direction of the leg at the target, inward")
    near: Floats = column("n 2", unit="m", doc="from the radar to the edge; all of a straight leg")
    far: Floats = column("n 2", unit="m", doc="from the edge to the target; 0 for a straight leg")
    faces: Ints = column("n 2 2", np.int32, doc="facets of face 0 and face n of the wedge, -1 for a straight leg")
    edge: Floats = column("n 2 3", doc="unit vector along the edge")
    normals: Floats = column("n 2 2 3", doc="unit normals of face 0 and face n")
    wedge_n: Floats = column("n 2", doc="open angle of the wedge over pi")


@dataclass(frozen=True)
class PropagationPaths(Record):
    """What all paths have, simulated or specular; a row a path, d the most interactions.

    `length` and `length_rate` are of the whole path; half of them, `range` and `range_rate`, is what a monostatic radar
    reads. Paths over corners of a footprint share a row of `trajectories`, whose vertices are over its centre.
    """

    length: Floats = column("n", unit="m", doc="from transmitter to receiver, the whole path")
    length_rate: Floats = column("n", unit="m/s", doc="rate of the length; positive = growing")
    trajectory: NDArray[np.int32] = column("n", np.int32, doc="row of `trajectories`")
    trajectories: Trajectories
    body_names: tuple[str, ...]
    part_names: tuple[str, ...]
    tx: Floats = column("3", unit="m")
    rx: Floats = column("3", unit="m")

    @property
    def delay(self) -> Floats:
        """Delays (n,) [s]: length over c."""
        return self.length / C0

    @property
    def range(self) -> Floats:
        """Ranges (n,) [m] that a monostatic radar reads: half the length."""
        return 0.5 * self.length

    @property
    def range_rate(self) -> Floats:
        """Range rates (n,) [m/s] that a monostatic radar reads, positive = receding: half the length's rate."""
        return 0.5 * self.length_rate

    @property
    def departure(self) -> Vectors:
        """Unit directions of departure (n, 3), world axes."""
        return self.trajectories.departure[self.trajectory]

    @property
    def arrival(self) -> Floats:
        """Unit directions (n, 3) towards which the receiver looks, world axes."""
        return self.trajectories.arrival[self.trajectory]

    @property
    def body(self) -> NDArray[np.int16]:
        """Bodies met (n, d) as rows of `body_names`, -1 in unused slots."""
        return self.trajectories.body[self.trajectory]

    @property
    def bodies(self) -> NDArray[np.str_]:
        """Names of the bodies met (n, d), '' in unused slots."""
        return np.array([*self.body_names, ""])[self.body]

    @property
    def part(self) -> NDArray[np.int16]:
        """Parts met (n, d) as rows of `part_names`, -1 in unused slots."""
        return self.trajectories.part[self.trajectory]

    @property
    def kind(self) -> NDArray[np.int8]:
        """What happened at each vertex (n, d): values of InteractionType, NONE in unused slots."""
        return self.trajectories.kind[self.trajectory]

    @property
    def drift(self) -> Vectors:
        """Velocities (n, 2, 3) [m/s] of the waves' sources relative to transmitter and receiver; no ends (n, 0, 3)
        where no element stands off the phase centres."""
        return self.trajectories.drift[self.trajectory]

    @property
    def instant(self) -> Floats:
        """Instants (n,) [s] of vertices and directions, from the frame's start."""
        return self.trajectories.instant[self.trajectory]

    @property
    def vertices(self) -> Vectors:
        """Vertices (n, d + 2, 3) [m], tx to rx, over the centre of footprints, not corners; unused slots repeat rx."""
        inner = self.trajectories.vertices[self.trajectory]
        first, last = (np.broadcast_to(x.astype(inner.dtype), (len(inner), 1, 3)) for x in (self.tx, self.rx))
        return np.concatenate([first, inner, last], axis=1)


@dataclass(frozen=True)
class Paths(PropagationPaths):
    """What the routes of a scene carry from the radar and back to it; a row a path (or corner of a tube)."""

    amplitude: NDArray[np.complex128] = column(
        "n", np.complex128, doc="received over transmitted voltage wave, antennas in, carrier phase in"
    )
    aside: NDArray[np.float32] = column("n e 3", np.float32, unit="m", doc="part of footprint off centre, to tx and rx")

    @classmethod
    def of(cls, **columns: object) -> Paths:
        """Return paths of columns of which each has a row a path, those of `Trajectories` among them."""
        names = [f.name for f in fields(Trajectories) if f.name in columns]
        held: dict[str, Any] = {name: columns.pop(name) for name in names}
        rows: dict[str, Any] = {"aside": np.zeros((np.asarray(columns["length"]).size, 0, 3), np.float32)} | columns
        each = np.arange(len(rows["length"]), dtype=np.int32)
        return cls(trajectory=each, trajectories=Trajectories.of(**held), **rows)


@dataclass(frozen=True)
class SpecularPaths(PropagationPaths):
    """Exact paths between two points with isotropic ends, shortest first; each has a trajectory of its own."""

    gain: NDArray[np.complex128] = column(
        "n 2 2", np.complex128, doc="rows the receiver's V, H, columns the transmitter's; lambda/4 pi L and phase in"
    )

    @property
    def rate(self) -> Floats:
        """The same as `length_rate` (n,) [m/s]: of the whole length, not of the range."""
        return self.length_rate


@dataclass(frozen=True)
class Profile(Record, Plotted):
    """Power-delay profile as received in the waveform's bandwidth."""

    range: Floats = column("r", unit="m", doc="c tau / 2")
    power: Floats = column("r", unit="W")
    noise: float
    peaks: Ints = column("p", np.int32, doc="indices of local maxima above the noise, strongest first")


@dataclass(frozen=True)
class Cube(Record):
    """Dechirped samples, voltage waves in sqrt(W): |x|^2 is received power, with real sampling its mean half of it."""

    samples: NDArray[np.complex64] = column("a c s", np.complex64, unit="sqrt(W)", doc="antenna, chirp, sample")
    noise_power: float  # thermal, per complex sample, kT0BF [W]; 0 when noise is off


@dataclass(frozen=True)
class RangeDoppler(Record, Plotted):
    """Range-Doppler map; scaled so that a lone path's peak reads its received power."""

    range: Floats = column("r", unit="m")
    rate: Floats = column("v", unit="m/s", doc="range rate, positive = receding, increasing")
    spectrum: NDArray[np.complex64] = column("a v r", np.complex64, unit="sqrt(W)")
    power: Floats = column("v r", unit="W", doc="mean over antennas of |spectrum|^2")
    noise: float  # expected, thermal, per cell [W]; 0 when unknown
    range_resolution: float
    rate_resolution: float
    unambiguous_range: float
    unambiguous_rate: float


@dataclass(frozen=True)
class MapError(Record):
    """How wrong a map may be: by what power a launch on another, coarser lattice differs in each cell."""

    power: Floats = column("v r", unit="W")


@dataclass(frozen=True)
class Detections(Record):
    """What the receiver reports; a row a detection, strongest first."""

    range: Floats = column("n", unit="m")
    rate: Floats = column("n", unit="m/s")
    speed: Floats = column("n", unit="m/s", doc="range rate with the scalar ego speed added")
    azimuth: Floats = column("n", unit="rad", doc="NaN where no array allows it", finite=False)
    elevation: Floats = column("n", unit="rad", doc="NaN where no array allows it", finite=False)
    ambiguous: NDArray[np.bool_] = column("n", np.bool_, doc="whether another direction, or rate, may be the true one")
    snr: Floats = column("n", unit="dB")
    power: Floats = column("n", unit="W")
    cell: NDArray[np.int32] = column("n 2", np.int32, doc="map indices (rate, range) of the peak")
    beam: Complexes = column("n a", np.complex128, doc="weights of antennas, or slots, in its beam; none without")
