"""What a ship's voyage leaves: ship.csv and scan.nc scan by scan, summary.json, and a thinned log for the pictures."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.run.files.contents import Contents
from raychan.run.files.netcdf import CONVENTIONS
from raychan.run.files.output import write_whole
from raychan.run.files.sheltered_file import ShelteredFile
from raychan.run.ship.loop import Frame, ShipLoop, hit_points
from raychan.run.ship.places import LostScans
from raychan.run.ship.scene import ShipScene
from raychan.run.storage import versions
from raychan.sensors.laser import NO_BODY, SEA, Ints
from raychan.world.errors import SceneError

Floats = NDArray[np.float64]

COLUMNS = ("t_s", "x_m", "y_m", "heading_deg", "roll_deg", "rudder_deg", "speed_mps")
"""Of ship.csv; logged poses that have pitch and height add `ship_replay.OPTIONAL`, so that it can be replayed."""
PICTURES = ("scan.png", "track.png", "motion.png", "scene.png")
CONTENTS = Contents(("ship.csv", "scan.nc", "summary.json", *PICTURES), signs=("scan.nc",))
_MOST_SCANS = 10_000_000  # a day at 75 Hz has 6.5 million; of 181 beams 14 GB before packing
_BLOCK = 512  # scans written at once: 0.7 MB of 181 beams (not measured)
_LOGGED = 4000  # scans that pictures draw; a picture is 1600 pixels wide
_HEADING = COLUMNS.index("heading_deg")
_AXES = "x to north, y to west, z up; heading clockwise from x; roll positive with starboard down"


def rounded_heading(degrees: float, form: str) -> str:
    """Return a heading [deg] in a format, below 360 also where it rounds up to it."""
    text = f"{degrees:{form}}"
    return f"{0.0:{form}}" if float(text) >= 360.0 else text


@dataclass(frozen=True)
class ShipLog:
    """Every `stride`-th scan of a voyage, for pictures; k scans of n beams.

    `row` (k, 7) of `COLUMNS`; `wanted` (k,) heading [deg]; `range` (k, n) [m], inf for none; `body` (k, n); `hits`
    (h, 3) [m] where beams met something, `hit_body` (h,).
    """

    stride: int
    row: Floats
    wanted: Floats
    range: Floats
    body: Ints
    hits: Floats
    hit_body: Ints


class Voyage:
    """The files of a voyage as they grow, in a folder. Use as a context; `add` each frame in turn."""

    def __init__(self, scene: ShipScene, folder: Path, scans: int) -> None:
        self._scene, self._folder, self._scans = scene, folder, scans
        self._stride = max(1, -(-scans // _LOGGED))
        self._k, self._start = 0, perf_counter()
        self._ranges: list[Floats] = []
        self._bodies: list[Ints] = []
        self._log: list[tuple[list[float], float, Floats, Ints, Floats, Ints]] = []
        self._echoes = np.zeros(len(scene.names) + 2, int)  # SEA and NO_BODY count from the end
        self._nearest = np.full(len(scene.names) + 2, np.inf)
        self._roll = [np.inf, -np.inf]
        self._lost = LostScans()
        self._last: Frame | None = None
        self._optional = () if scene.poses is None else scene.poses.optional

    def __enter__(self) -> Voyage:
        import h5netcdf
        import h5py

        with ExitStack() as opened:
            self._csv = opened.enter_context((self._folder / "ship.csv").open("w", encoding="utf-8", newline=""))
            self._rows = csv.writer(self._csv, lineterminator="\n")
            self._rows.writerow([*COLUMNS, *self._optional])
            self._disk = opened.enter_context(closing(ShelteredFile(self._folder / "scan.nc")))
            held = opened.enter_context(h5py.File(self._disk, "w", track_order=True))
            self._nc = opened.enter_context(h5netcdf.File(held, "w"))
            self._header()
            self._disk.check()
            self._opened = opened.pop_all()
        return self

    def __exit__(self, *error: object) -> None:
        with self._opened:
            if error[0] is None:
                self._flush()

    def _header(self) -> None:
        scanner, file, n = self._scene.scanner, self._nc, self._scene.scanner.count
        file.attrs.update({
            "Conventions": CONVENTIONS, "title": "raychan laser scans of a ship", "scene": self._scene.text,
            "comment": _AXES, "seed": self._scene.tables.run.seed, "versions": json.dumps(versions()),
            "bodies": json.dumps(self._scene.names),
        })  # fmt: skip
        if self._scene.poses is not None:
            file.attrs["log_start_s"] = self._scene.poses.start
        file.dimensions = {"time": self._scans, "beam": n}
        coordinates = {
            "angle_deg": ("degree", "angle of the beam on the scanner, to port positive", np.degrees(scanner.angles)),
            "beam_time": ("s", "time of the beam after that of its scan", scanner.times),
        }
        for name, (unit, title, values) in coordinates.items():
            made = file.create_variable(name, ("beam",), float, data=values)
            made.attrs.update({"units": unit, "long_name": title})
        columns: dict[str, tuple[tuple[str, ...], Any, dict[str, Any]]] = {
            "time": (("time",), np.float64, {"units": "s", "long_name": "start of the scan"}),
            "range_m": (("time", "beam"), np.float32, {
                "units": "m", "long_name": "range, NaN where no echo came back", "coordinates": "angle_deg beam_time",
            }),
            "body": (("time", "beam"), np.int32, {
                "units": "1", "long_name": "what the beam met, a number in the list of bodies",
                "flag_values": np.array([NO_BODY, SEA], np.int32), "flag_meanings": "no_echo sea",
            }),
        }  # fmt: skip
        for name, (axes, kind, attrs) in columns.items():
            # Most beams of an open sea meet nothing: a deflated file is a tenth as large.
            packed: dict[str, Any] = {"compression": "gzip", "compression_opts": 1} if len(axes) > 1 else {}
            if packed:
                packed["chunks"] = (min(_BLOCK, self._scans), n)
            file.create_variable(name, axes, kind, **packed).attrs.update(attrs)

    def add(self, frame: Frame) -> None:
        """Take the next frame."""
        angles = np.degrees([frame.heading, frame.roll, frame.rudder]).tolist()
        row = [frame.time, frame.x, frame.y, *angles, frame.speed]
        texts = [f"{value:.9g}" for value in row]
        texts[_HEADING] = rounded_heading(row[_HEADING], ".9g")
        further = {"pitch_deg": np.degrees(frame.pitch), "z_m": frame.z}
        self._rows.writerow([*texts, *(f"{further[name]:.9g}" for name in self._optional)])
        met = frame.scan
        self._ranges.append(met.range)
        self._bodies.append(met.body)
        echo = met.body != NO_BODY
        if echo.any():
            np.add.at(self._echoes, met.body[echo], 1)
            np.minimum.at(self._nearest, met.body[echo], met.range[echo])
        self._roll = [min(self._roll[0], angles[1]), max(self._roll[1], angles[1])]
        self._lost.add(frame.lost_in, frame.time)
        if self._k % self._stride == 0:
            hits = hit_points(self._scene.scanner, frame.beams, met)
            self._log.append((row, float(np.degrees(frame.heading_wanted)), met.range, met.body, hits, met.body[echo]))
        self._k, self._last = self._k + 1, frame
        if len(self._ranges) == _BLOCK:
            self._flush()

    def _flush(self) -> None:
        if not self._ranges:
            return
        rows = slice(self._k - len(self._ranges), self._k)
        ranges = np.array(self._ranges)
        self._nc["time"][rows] = np.arange(rows.start, rows.stop) * self._scene.scanner.duration
        self._nc["range_m"][rows] = np.where(np.isfinite(ranges), ranges, np.nan).astype(np.float32)
        self._nc["body"][rows] = np.array(self._bodies)
        self._ranges, self._bodies = [], []
        self._disk.check()

    @property
    def log(self) -> ShipLog:
        """The thinned log of what was added."""
        row, wanted, ranges, body, hits, hit_body = zip(*self._log, strict=True)
        return ShipLog(
            self._stride, np.array(row), np.array(wanted), np.array(ranges), np.array(body), np.concatenate(hits),
            np.concatenate(hit_body),
        )  # fmt: skip

    def summary(self) -> dict[str, Any]:
        """Return what summary.json holds."""
        last, t = self._last, self._scene.tables
        assert last is not None
        names = {i: name for i, name in enumerate(self._scene.names)} | {SEA: "sea"}
        took, lasted = perf_counter() - self._start, self._k * self._scene.scanner.duration
        return {
            "title": self._scene.title,
            "model": "replay" if t.replay is not None else t.ship.model,
            "controller": None if t.replay is not None else t.steering.controller,
            "seed": t.run.seed,
            "log_start_s": None if self._scene.poses is None else self._scene.poses.start,
            "duration_s": lasted,
            "scans": self._k,
            "beams": self._scene.scanner.count,
            "echoes": {name: int(self._echoes[i]) for i, name in names.items()},
            "nearest_m": {name: float(self._nearest[i]) for i, name in names.items() if self._echoes[i]},
            "lost_in": self._lost.summary,
            "roll_deg": {"least": self._roll[0], "most": self._roll[1]},
            "end": {"x_m": last.x, "y_m": last.y, "heading_deg": float(np.degrees(last.heading))},
            "seconds": took,
            "real_time_factor": lasted / took,
            "axes": _AXES,
            "versions": versions(),
        }


def _next(loop: ShipLoop) -> Frame:
    """Return the next frame. Raises: SceneError where the model does not hold, as of a ship that stops."""
    try:
        return loop.step_scan()
    except (ValueError, OverflowError) as error:
        raise SceneError(f"the ship cannot sail on after {loop.now:.2f} s: {error}", file=loop.scene.path) from error


def sail_into(scene: ShipScene, folder: Path, tell: Callable[[str, float], None]) -> tuple[ShipLog, dict[str, Any]]:
    """Run a scene's loop over its duration and write ship.csv, scan.nc and summary.json into a folder.

    Args: tell (stage, share done) shows progress. Returns: the log for pictures, and the summary.
    Raises: SceneError for a voyage of too many scans.
    """
    loop = ShipLoop(scene)
    if loop.scans > _MOST_SCANS:
        allowed = f"at most {_MOST_SCANS:,} scans, here {_MOST_SCANS * scene.scanner.duration:g} s"
        problem, asked = f"{loop.scans:,} scans", scene.tables.run.duration_s
        raise SceneError(problem, file=scene.path, key="run.duration_s", value=asked, allowed=allowed)
    with Voyage(scene, folder, loop.scans) as files:
        for k in range(loop.scans):
            files.add(_next(loop))
            if k % 75 == 0:
                tell("sailing", k / loop.scans)
        tell("sailing", 1.0)
    found = files.summary()
    write_whole(folder / "summary.json", (json.dumps(found, indent=2) + "\n").encode())
    return files.log, found
