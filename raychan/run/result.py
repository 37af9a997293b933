"""Result: all that one run of a scene gives."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from raychan.radar.waveform import Waveform
from raychan.tables import Cube, Detections, MapError, Paths, Profile, RangeDoppler
from raychan.telling import Drawn, Told

DIRECT, MULTIPATH, CLUTTER = "direct", "multipath", "clutter"


@dataclass(frozen=True)
class Receiver:
    """What the receiver did, as far as an explanation of its map needs it."""

    waveform: Waveform
    range_window: str
    rate_window: str
    power: float
    """Transmitted power [W]."""
    ego_speed: float
    """Scalar own speed [m/s] that was added to the range rate."""
    background: tuple[str, ...] = ()
    """Names of bodies that are not targets: the ground and the radar's own carrier."""


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
        way = " > ".join(["radar", *self.chain, "radar"])
        plural = "" if self.interactions == 1 else "s"
        return f"{way}, {self.interactions} interaction{plural}, {self.range:.2f} m, {100.0 * self.share:.0f} %"


@dataclass(frozen=True)
class Explanation:
    """Which paths made a cell of the map: powers in W, strongest chain first."""

    range: float
    rate: float
    speed: float
    power: float
    """What the map shows."""
    predicted: float
    """What the paths alone give; the rest is noise."""
    error_db: float
    """How far the power may be off, as two launches of tubes differ [dB]."""
    label: str
    contributions: tuple[Contribution, ...]

    @property
    def bodies(self) -> str:
        """Chain of the leading contribution; 'noise' if no path explains the cell."""
        return " > ".join(self.contributions[0].chain) if self.contributions else "noise"


@dataclass(frozen=True)
class Result(Told, Drawn):
    """Everything from the paths to the detections, and where each detection came from."""

    paths: Paths
    profile: Profile
    cube: Cube
    rdmap: RangeDoppler
    detections: Detections
    provenance: tuple[Explanation, ...]
    receiver: Receiver
    error: MapError
    seed: int
    timings: dict[str, float] = field(default_factory=dict)
    ledger: dict[str, Any] = field(default_factory=dict)
    stats: dict[str, Any] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    scene: Any = None
    text: str = ""
    """Source of the scene file."""
    path: str = ""
    """Where the scene file was, so that its mesh files can be found again."""
