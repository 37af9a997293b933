"""READ FIRST: the records that flow between the floors.

    Scene -> Facets -> Routes -> Paths -> Profile
                                 Paths -> Cube -> RangeDoppler -> Detections

Every record is a frozen struct of arrays, one row a thing. Each array field declares its axes (letters shared
within a record must agree), unit and dtype; the constructor checks them, rejects NaN and infinity, and makes the array
read-only. Integer sentinel: -1 means "none". SI units and radians throughout.
"""

from __future__ import annotations

import dataclasses
from copy import copy
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.reprs import Drawn, Told

Floats = NDArray[np.float64]
Complexes = NDArray[np.complexfloating[Any, Any]]
Ints = NDArray[np.signedinteger[Any]]

# What happens at a vertex of a route.
NONE, REFLECT, TRANSMIT, SCATTER, POINT, DIFFRACT = 0, 1, 2, 3, 4, 5
KIND_LETTERS = ("", "R", "T", "S", "P", "D")
"""Reflect at a mirror, transmit a thin layer, scatter by physical optics, point target of given RCS, diffract."""
KIND_WORDS = ("", "reflect", "pass", "scatter", "point", "diffract")

# What a material is to a wave.
PEC, HALF_SPACE, LAYER = 0, 1, 2

# What a body does besides blocking: scatter and reflect; reflect only (infinite ground); block only.
SCATTERER, MIRROR, BLOCKER = 0, 1, 2


def column(axes: str, dtype: Any = np.float64, unit: str = "1", doc: str = "", finite: bool = True) -> Any:
    """Declare an array field: axes as space-separated letters or numbers ('n 3'), dtype, unit, meaning."""
    meta = {"axes": axes.split(), "dtype": np.dtype(dtype), "unit": unit, "doc": doc, "finite": finite}
    return field(metadata=meta)


class Record(Told):
    """Base of all records: checks and freezes every declared column when built."""

    def __post_init__(self) -> None:
        sizes: dict[str, int] = {}
        for f in dataclasses.fields(self):  # type: ignore[arg-type]
            if "axes" in f.metadata:
                object.__setattr__(self, f.name, self._checked(f, sizes))

    def _checked(self, f: dataclasses.Field[Any], sizes: dict[str, int]) -> NDArray[Any]:
        where = f"{type(self).__name__}.{f.name}"
        axes, dtype = f.metadata["axes"], f.metadata["dtype"]
        given = np.asarray(getattr(self, f.name))
        if not np.can_cast(given.dtype, dtype, "same_kind") and given.size:
            raise TypeError(f"{where}: dtype {given.dtype} given, {dtype} wanted")
        value = given.astype(dtype, copy=False).view()
        if value.ndim != len(axes):
            raise ValueError(f"{where}: shape {value.shape} given, axes ({', '.join(axes)}) wanted")
        for axis, size in zip(axes, value.shape, strict=True):
            want = int(axis) if axis.isdigit() else sizes.setdefault(axis, size)
            if size != want:
                raise ValueError(f"{where}: axis {axis} is {size} long, {want} wanted")
        if f.metadata["finite"] and dtype.kind in "fc" and not np.isfinite(value).all():
            raise ValueError(f"{where}: holds NaN or infinity")
        value.flags.writeable = False
        return value

    def rebuilt(self, **columns: NDArray[Any]) -> Any:
        """Return a copy with other columns of the same form, whose maker answers for them: frozen, but not checked
        again, which for a record of 1e6 rows of which few changed took longer than all else."""
        out = copy(self)
        for name, value in columns.items():
            frozen = value.view()
            frozen.flags.writeable = False
            object.__setattr__(out, name, frozen)
        return out

    def replace(self, **changes: Any) -> Any:
        """Return a copy with some fields changed (and all checked again)."""
        return dataclasses.replace(self, **changes)  # type: ignore[type-var]


def take(record: Any, index: Any) -> Any:
    """Return the rows `index` of a record whose row axis is 'n'."""
    changes = {
        f.name: getattr(record, f.name)[index]
        for f in dataclasses.fields(record)
        if f.metadata.get("axes", [""])[0] == "n"
    }
    return dataclasses.replace(record, **changes)


@dataclass(frozen=True)
class Materials(Record):
    """Materials at one frequency; a row a material."""

    kind: Ints = column("m", np.int8, doc="PEC, HALF_SPACE or LAYER")
    eps: Complexes = column("m", np.complex128, doc="relative permittivity eps_r - j sigma/(omega eps0); 1 for PEC")
    thickness: Floats = column("m", unit="m", doc="layer thickness; 0 unless LAYER")
    roughness: Floats = column("m", unit="m", doc="rms height")


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


@dataclass(frozen=True)
class Points(Record):
    """Targets given by their RCS; a row a target, standing on body `body`, which blocks other rays but not its own."""

    position: Floats = column("n 3", unit="m")
    velocity: Floats = column("n 3", unit="m/s")
    body: Ints = column("n", np.int32)
    azimuth: Floats = column(
        "t", unit="rad", doc="knots of the RCS table, increasing, relative to heading, from -pi to pi"
    )
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
    caustics: Ints = column("n", np.int8, doc="caustics passed on the way in; each advances the phase by pi/2")
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
class Ways(Record):
    """Where paths went; a row a way, d slots a chain."""

    departure: NDArray[np.float32] = column("w 3", np.float32, doc="unit direction of departure, world axes")
    arrival: Floats = column("w 3", doc="unit direction towards which the receiver looks, world axes")
    body: Ints = column("w d", np.int16)
    part: Ints = column("w d", np.int16)
    kind: Ints = column("w d", np.int8)
    vertices: NDArray[np.float32] = column("w d 3", np.float32, unit="m", doc="unused slots repeat the receiver")


@dataclass(frozen=True)
class Paths(Record):
    """What the routes carry; a row a path (or tube). Paths over the corners of one footprint share a way.

    `departure`, `arrival`, `body`, `part`, `kind` and `vertices` are columns of `ways`, put out a row a path when asked
    for.
    """

    delay: Floats = column("n", unit="s")
    amplitude: Complexes = column(
        "n", np.complex128, doc="received over transmitted voltage wave, antennas in, carrier phase in"
    )
    rate: Floats = column("n", unit="m/s", doc="range rate: half the rate of the length; positive = receding")
    way: Ints = column("n", np.int32, doc="row of `ways`")
    ways: Ways
    body_names: tuple[str, ...]
    part_names: tuple[str, ...]
    tx: Floats = column("3", unit="m")
    rx: Floats = column("3", unit="m")

    @classmethod
    def of(cls, **columns: Any) -> Paths:
        """Return paths of columns of which each has a row a path, those of `Ways` among them."""
        ways = Ways(**{f.name: columns.pop(f.name) for f in dataclasses.fields(Ways)})
        return cls(way=np.arange(len(columns["delay"]), dtype=np.int32), ways=ways, **columns)

    @property
    def departure(self) -> NDArray[np.float32]:
        """Unit directions of departure (n, 3), world axes."""
        return self.ways.departure[self.way]

    @property
    def arrival(self) -> Floats:
        """Unit directions (n, 3) towards which the receiver looks, world axes."""
        return self.ways.arrival[self.way]

    @property
    def body(self) -> Ints:
        """Bodies met (n, d), -1 in unused slots."""
        return self.ways.body[self.way]

    @property
    def part(self) -> Ints:
        """Parts met (n, d), -1 in unused slots."""
        return self.ways.part[self.way]

    @property
    def kind(self) -> Ints:
        """What happened at each vertex (n, d), NONE in unused slots."""
        return self.ways.kind[self.way]

    @property
    def vertices(self) -> NDArray[np.float32]:
        """Vertices (n, d, 3) [m]; unused slots repeat the receiver."""
        return self.ways.vertices[self.way]


@dataclass(frozen=True)
class Profile(Record, Drawn):
    """Power-delay profile as received in the waveform's bandwidth."""

    range: Floats = column("r", unit="m", doc="c tau / 2")
    power: Floats = column("r", unit="W")
    noise: float
    peaks: Ints = column("p", np.int32, doc="indices of local maxima above the noise, strongest first")


@dataclass(frozen=True)
class Cube(Record):
    """Dechirped samples; voltage waves in sqrt(W), so |x|^2 is received power before processing."""

    samples: Complexes = column("a c s", np.complex64, unit="sqrt(W)", doc="antenna, chirp, sample")
    noise_power: float
    """Thermal noise power per complex sample, kT0BF [W]; 0 when noise is off."""


@dataclass(frozen=True)
class RangeDoppler(Record, Drawn):
    """Range-Doppler map; scaled so that a lone path's peak reads its received power."""

    range: Floats = column("r", unit="m")
    rate: Floats = column("v", unit="m/s", doc="range rate, positive = receding, increasing")
    spectrum: Complexes = column("a v r", np.complex64, unit="sqrt(W)")
    power: Floats = column("v r", unit="W", doc="mean over antennas of |spectrum|^2")
    noise: float
    """Expected thermal noise power per cell [W]; 0 when unknown."""
    range_resolution: float
    rate_resolution: float
    unambiguous_range: float
    unambiguous_rate: float


@dataclass(frozen=True)
class MapError(Record):
    """How wrong a map may be: the power that a launch with another lattice, less fine, differs by in each cell."""

    power: Floats = column("v r", unit="W")


@dataclass(frozen=True)
class Detections(Record):
    """What the receiver reports; a row a detection, strongest first."""

    range: Floats = column("n", unit="m")
    rate: Floats = column("n", unit="m/s")
    speed: Floats = column("n", unit="m/s", doc="range rate with the scalar ego speed added")
    azimuth: Floats = column("n", unit="rad", doc="NaN where no array allows it", finite=False)
    snr: Floats = column("n", unit="dB")
    power: Floats = column("n", unit="W")
    cell: Ints = column("n 2", np.int32, doc="map indices (rate, range) of the peak")
