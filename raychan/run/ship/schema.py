"""The tables and keys of a ship's scene file, with types and limits in the units of the file."""

from __future__ import annotations

from typing import Literal

from pydantic import model_validator

from raychan.world.scene_files.base import Table
from raychan.world.scene_files.quantities import (
    Angle,
    BeamRange,
    Courses,
    Damping,
    Divergence,
    Fan,
    FeedbackGain,
    FileName,
    Gains,
    Heading,
    Horizontal,
    LoopRate,
    Merge,
    Mirror,
    Peak,
    Place,
    Reflectivity,
    Rings,
    Rudder,
    RudderRate,
    ScanStep,
    Seed,
    ShipSpeed,
    SpotWidth,
    Spread,
    Strength,
    Switch,
    TurnRate,
    Voyage,
    WaveHeight,
    WavePeriod,
    WayPointList,
    Weight,
    Weights,
)
from raychan.world.scene_files.schema import PlacedBodyTable


class ShipHeader(Table):
    """Table [scene]."""

    title: str = ""


class ShipTable(Table):
    """Table [ship]."""

    model: Literal["printed", "corrected", "container", "yacht"] = "corrected"
    speed_mps: ShipSpeed | None = None
    """Default 20 knots; of the yacht 12 knots."""
    position: Horizontal = [0.0, 0.0]
    """Where it starts, x and y of the world."""
    heading_deg: Heading = 0.0


class SteeringNoiseTable(Table):
    """Table [steering.noise]: what disturbs the ship, and what its sensors err; standard deviations."""

    roll_rate_dps: Strength = 0.05
    yaw_rate_dps: Strength = 0.05
    roll_deg: Strength = 0.2
    heading_deg: Strength = 0.5
    sway_mps2: Strength = 0.01
    """White accelerations, per root of a hertz."""
    roll_dps2: Strength = 0.1
    yaw_dps2: Strength = 0.02


class SteeringTable(Table):
    """Table [steering]."""

    controller: Literal["pd", "lqr", "lqg"] = "lqr"
    weights: Weights = [1.0, 1.0, 1.0, 1.0, 1.0]
    """Of LQR and LQG: sway velocity, roll rate, yaw rate, roll, heading, in SI."""
    rudder_weight: Weight = 1.0
    gain: Gains | None = None
    """Of LQR and LQG, in place of weights."""
    frequency: LoopRate = 0.1
    """Of PD: natural frequency [rad/s] of the heading's loop."""
    damping: Damping = 1.0
    kp: FeedbackGain | None = None
    """Of PD, with kd [s], in place of frequency and damping."""
    kd: FeedbackGain | None = None
    max_rudder_deg: Rudder = 35.0
    max_rudder_rate_dps: RudderRate = 5.0
    noise: SteeringNoiseTable | None = None

    @model_validator(mode="after")
    def _fits(self) -> SteeringTable:
        if (self.kp is None) != (self.kd is None):
            raise ValueError("kp and kd together")
        if self.kp is not None and self.controller != "pd":
            raise ValueError("kp and kd only with controller = 'pd'")
        if self.gain is not None and self.controller == "pd":
            raise ValueError("gain only with controller = 'lqr' or 'lqg'")
        if self.rudder_weight == 0.0:
            raise ValueError("rudder_weight above 0")
        return self


class ProgrammeTable(Table):
    """Table [programme]: headings from given times on, or way-points."""

    headings: Courses | None = None
    turn_rate_dps: TurnRate | None = None
    """At which the wanted heading goes from one to the next; none: at once, by the shorter turn."""
    way_points: WayPointList | None = None
    """Places [x, y] [m] of the world."""
    acceptance_m: BeamRange = 50.0
    lookahead_m: BeamRange = 100.0

    @model_validator(mode="after")
    def _one_of(self) -> ProgrammeTable:
        if self.headings is not None and self.way_points is not None:
            raise ValueError("either headings or way_points")
        if self.turn_rate_dps is not None and self.headings is None:
            raise ValueError("turn_rate_dps only with headings")
        return self


class SpotTable(Table):
    """Table [scanner.spot]: the width of a beam, which makes mixed pixels."""

    divergence_mrad: Divergence = 4.6
    """Full angle."""
    exit_mm: SpotWidth = 13.0
    rings: Rings = 1
    echo: Literal["first", "strongest", "mean"] = "first"
    merge_m: Merge = 0.45
    """Echoes nearer than this flow into one."""


class ScannerTable(Table):
    """Table [scanner]: the laser scanner and its mount on the ship."""

    step_deg: ScanStep = 1.0
    fan_deg: Fan = 180.0
    mirror_hz: Mirror = 75.0
    max_range_m: BeamRange = 80.0
    dark_range_m: BeamRange = 30.0
    """To a surface of 10 % reflectivity."""
    position: Place = [0.0, 0.0, 5.0]
    """On the ship: ahead, to port, above the water line."""
    yaw_deg: Angle = 0.0
    pitch_deg: Angle = 0.0
    roll_deg: Angle = 0.0
    noise_m: Spread = 0.0
    """Standard deviation of a range."""
    lambert: Switch = False
    """Power falls with the cosine of the angle of incidence."""
    spot: SpotTable | None = None
    """None: a beam is a ray of no width."""
    motion: Switch = True
    """Each beam leaves at the pose of its own time; false: all at the pose of the scan's start."""


class WavesTable(Table):
    """Table [sea.waves]."""

    height_m: WaveHeight
    """Significant height."""
    period_s: WavePeriod
    """Of the spectrum's peak."""
    gamma: Peak = 1.0
    heading_deg: Heading = 0.0
    """Towards which the waves run."""
    spread: Switch = True
    """Directions vary as cos^2 about the heading."""


class SeaTable(Table):
    """Table [sea]: the plane z = 0, or waves about it."""

    reflectivity: Reflectivity = 0.1
    """0: no sea."""
    waves: WavesTable | None = None


class ShipBodyTable(PlacedBodyTable):
    """Table [[bodies]] of a ship's scene; a material is a name of the reflectivity table."""

    reflectivity: Reflectivity | None = None
    """In place of a material; default 0.5."""

    @model_validator(mode="after")
    def _material_or_reflectivity(self) -> ShipBodyTable:
        if self.material is not None and self.reflectivity is not None:
            raise ValueError("either material or reflectivity")
        return self


class AvoidanceTable(Table):
    """Table [avoidance]: the ship turns from what its scanner meets."""

    distance_m: BeamRange = 10.0
    """Kept from every echo."""


class ShipRunTable(Table):
    """Table [run]."""

    duration_s: Voyage = 60.0
    seed: Seed = 0


class ReplayTable(Table):
    """Table [replay]: logged poses in place of a model."""

    file: FileName
    """CSV, relative to the scene file."""
    max_gap_s: Voyage = 1.0
    """Longest time between two rows."""


class ShipFile(Table):
    """A whole scene file of a ship."""

    scene: ShipHeader = ShipHeader()
    ship: ShipTable = ShipTable()
    steering: SteeringTable = SteeringTable()
    programme: ProgrammeTable = ProgrammeTable()
    avoidance: AvoidanceTable | None = None
    scanner: ScannerTable = ScannerTable()
    sea: SeaTable | None = None
    bodies: list[ShipBodyTable] = []
    run: ShipRunTable = ShipRunTable()
    replay: ReplayTable | None = None
