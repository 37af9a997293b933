"""The result of a run: paths, profile, cube, map, detections, and where each detection comes from."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from raychan.columns import column
from raychan.radar.waveform import Waveform
from raychan.records import Cube, Detections, Floats, MapError, Paths, Profile, RangeDoppler
from raychan.reprs import Described, PlottedTwice
from raychan.run.ledger_entry import Entry

if TYPE_CHECKING:
    from raychan.world.scene import Scene

LABELS = DIRECT, MULTIPATH, CLUTTER, SIDELOBE, DC, IMAGE, INTERFERENCE = (
    "direct", "multipath", "clutter", "sidelobe", "dc", "image", "interference",
)  # fmt: skip
"""Of detections: what their leading chain of bodies is; of DC, the receiver's offset, of IMAGE, its I/Q image of an
echo, and of INTERFERENCE, what another radar sends, there is none."""
LINE_OF_SIGHT = "line of sight"
"""Names the way straight from a transmitter to a receiver elsewhere, which meets no body."""


@dataclass(frozen=True)
class Receiver:
    """The receiver's settings that an explanation of its map needs."""

    waveform: Waveform
    range_window: str
    rate_window: str
    power: float
    """Transmitted power [W]."""
    ego_speed: float
    """Scalar own speed [m/s] that was added to the range rate."""
    background: tuple[str, ...] = ()
    """Names of bodies that are not targets: the ground and the radar's own vehicle."""


@dataclass(frozen=True)
class Contribution:
    """What one chain of bodies brings to a cell."""

    chain: tuple[str, ...]
    """Names 'body.part' from transmitter to receiver; a layer passed on the way is written '(body.part)'."""
    interactions: int
    range: float
    rate: float
    share: float
    """Power of the chain over the sum of the powers of all chains."""
    paths: int

    def text(self) -> str:
        """Return 'radar > truck.tail > pedestrian > truck.tail > radar, 3 interactions, 14.20 m, 81 %'."""
        way = " > ".join(["radar", *self.chain, "radar"]) if self.chain else LINE_OF_SIGHT
        plural = "" if self.interactions == 1 else "s"
        return f"{way}, {self.interactions} interaction{plural}, {self.range:.2f} m, {100.0 * self.share:.0f} %"


@dataclass(frozen=True)
class Explanation:
    """Which paths made a cell of the map: powers in W, the leading chain first, then the strongest."""

    range: float
    rate: float
    speed: float
    power: float
    """What the map shows: of a detection at its peak between cells, of an array in the detection's beam."""
    predicted: float
    """What the paths alone give there: they lack noise, and what a beam of plane waves errs near an array. At the
    middle of an array whose beam the paths do not explain; by the samples without noise for echoes of turning bodies,
    or of those that move where `model.retrace` is above 1."""
    error_db: float
    """How far the power may be off, as two launches of tubes differ [dB]; NaN where they differ by so much that it is
    no figure."""
    label: str
    contributions: tuple[Contribution, ...]
    folded: bool = False
    """Whether the leading chain is ambiguities away from where the map shows it, or mirrored by real sampling."""
    true_range: float = math.nan
    """Range of the leading chain [m], the mean over its paths by their power, mid frame; NaN where unknown."""
    true_rate: float = math.nan
    """Its range rate [m/s]; NaN where unknown."""
    reciprocity_db: float = 0.0
    """By how much the level changes as waves over several surfaces are taken to scatter on one of these or another,
    which reciprocity makes alike [dB]: what paths differ by that are there either way, in no stated error."""
    departure: tuple[float, ...] = (0.0, 0.0, 0.0)
    """Unit direction in which the strongest path of the leading chain leaves, world axes; zeros where unknown."""
    arrival: tuple[float, ...] = (0.0, 0.0, 0.0)
    """Unit direction that it returns from."""
    drift: tuple[float, ...] = ()
    """Velocities [m/s] of its last scatterer's images relative to transmitter and receiver, three numbers each; none
    where no element stands off the phase centres, or nothing moves."""
    source: str = "noise"
    """What made a cell that no path explains: 'noise', 'dc offset', 'I/Q image' or an interferer's name."""

    @property
    def converged(self) -> bool:
        """Whether the error is a figure."""
        return not math.isnan(self.error_db)

    @property
    def bodies(self) -> str:
        """Chain of the leading contribution, 'line of sight' if it meets none; `source` if no path explains the
        cell."""
        if not self.contributions:
            return self.source
        return " > ".join(self.contributions[0].chain) or LINE_OF_SIGHT


@dataclass(frozen=True)
class ExplainedDetections(Detections):
    """What the receiver reports, and beside it what only a simulator knows; a row a detection, strongest first."""

    error_db: Floats = column("n", unit="dB", doc="stated error of the power; NaN where not converged", finite=False)
    converged: NDArray[np.bool_] = column("n", np.bool_, doc="whether the error is a figure")
    folded: NDArray[np.bool_] = column("n", np.bool_, doc="whether the echo is not where the map shows it")
    true_range: Floats = column(
        "n", unit="m", doc="mean range of the leading chain by power; NaN where unknown", finite=False
    )
    true_rate: Floats = column("n", unit="m/s", doc="range rate of the leading chain; NaN where unknown", finite=False)

    @classmethod
    def of(cls, found: Detections, reasons: Sequence[Explanation]) -> ExplainedDetections:
        """Return a receiver's detections with what is known of each."""
        known = {f.name: getattr(found, f.name) for f in fields(Detections)}
        return cls(
            **known,
            error_db=np.array([why.error_db for why in reasons], float),
            converged=np.array([why.converged for why in reasons], bool),
            folded=np.array([why.folded for why in reasons], bool),
            true_range=np.array([why.true_range for why in reasons], float),
            true_rate=np.array([why.true_rate for why in reasons], float),
        )


@dataclass(frozen=True, eq=False)
class Result(Described, PlottedTwice):
    """Everything from the paths to the detections, and where each detection came from.

    A result equals only itself, for timings differ from run to run; its records compare by their numbers.
    """

    paths: Paths
    profile: Profile
    cube: Cube
    rdmap: RangeDoppler
    detections: ExplainedDetections
    provenance: tuple[Explanation, ...]
    receiver: Receiver
    error: MapError
    seed: int
    timings: dict[str, float] = field(default_factory=dict)
    ledger: Mapping[str, Entry] = field(default_factory=dict)
    """What was left out, by mechanism: entries with `level_db` over the weakest detection (see run.ledger)."""
    stats: dict[str, float] = field(default_factory=dict)
    """Counts: rays, tubes, tracings; tolerance asked for and reached [dB]."""
    warnings: tuple[str, ...] = ()
    scene: Scene | None = None
    """None where a result was read from disk and its scene could not be."""
    text: str = ""
    """Source of the scene file."""
    path: str = ""
    """Where the scene file was, so that its mesh files can be found again."""

    @property
    def traced_at(self) -> float:
        """Time [s] from the frame's start to the instant whose levels, rates and directions the paths have."""
        return self.stats.get("traced_at_s", 0.0)

    def require_scene(self) -> Scene:
        """Return the scene. Raises: ValueError where it could not be read again."""
        if self.scene is None:
            raise ValueError("the scene of this result cannot be read again")
        return self.scene
