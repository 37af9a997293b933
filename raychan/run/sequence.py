"""Sequences of frames: poses advance by velocities and turn rates; each frame gives a result, which is not kept."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from raychan.run.clock import Clock, Progress
from raychan.run.files.output import StoreError, csv_bytes, staging
from raychan.run.result import Result
from raychan.run.scene_channel import Channel, channel_of
from raychan.run.simulate import result_of
from raychan.run.storage import CONTENTS, columns_of, rows, write_result
from raychan.run.turning import moves_as_one
from raychan.world.geometry import geometry_of
from raychan.world.limits import FRAMES, INTERVAL, SEED
from raychan.world.scene import Scene
from raychan.world.scene_given import check_scene

HEAD = ("frame", "time_s")


@dataclass(frozen=True)
class Frame:
    """One frame of a sequence: `number` from 0, `time` [s] at which it begins."""

    number: int
    time: float
    result: Result

    @property
    def name(self) -> str:
        """Name of the frame's directory."""
        return _name(self.number)


def frames(
    scene: Scene,
    count: int,
    interval: float | None = None,
    seed: int = 0,
    tolerance_db: float | None = None,
    max_bounces: int | None = None,
    progress: Progress | None = None,
) -> Iterator[Frame]:
    """Give the frames of a scene one after the other; frame k is `simulate(scene.at(k * interval), seed + k)`.

    Args: count of frames; interval [s] from frame to frame (default the waveform's frame, without a pause); the rest
    as for `simulate`. A scene in which nothing moves relative to the radar is traced once.
    Raises: ValueError on a count, an interval or an override out of range; SceneError for no Scene, and where the radar
    runs into a body, or motion leads beyond the places that a scene may have.
    """
    check_scene(scene)
    count = FRAMES.check("count", count, whole=True)
    seed = SEED.check("seed", seed, whole=True)
    step = scene.radar.waveform.frame_duration if interval is None else interval
    step = INTERVAL.check("interval", step)
    for k in range(count):
        scene.at(k * step)  # a radar in a body, or one too far off, is an error before the first frame is computed
    return _frames(scene, count, step, seed, tolerance_db, max_bounces, progress)


def overlap(scene: Scene, count: int, interval: float | None) -> list[str]:
    """Return a line where frames of an interval [s] begin before the one before has ended, which no radar's do."""
    frame = scene.radar.waveform.frame_duration
    # A frame that follows without a pause, given in decimals, is none of these.
    if interval is None or count < 2 or interval >= frame * (1.0 - 1e-6):
        return []
    return [
        f"frames overlap in time: one lasts {frame:g} s, and the next begins after {interval:g} s (--frame-interval)"
    ]


def _frames(
    scene: Scene,
    count: int,
    step: float,
    seed: int,
    tolerance_db: float | None,
    max_bounces: int | None,
    progress: Progress | None,
) -> Iterator[Frame]:
    once = moves_as_one(scene)
    first: Channel | None = None
    for k in range(count):
        time, clock = k * step, Clock(progress)
        now = scene.at(time)
        if first is not None and once:
            channel = _shifted(first, now, time)
        else:
            channel = channel_of(now, tolerance_db, max_bounces, clock)
            first = channel if once else None
        result = result_of(now, channel, seed + k, clock)
        # Frees the memory of this frame before the next is built.
        del channel, now
        yield Frame(k, time, result)


def _shifted(channel: Channel, scene: Scene, time: float) -> Channel:
    """Return the channel of a scene whose bodies and radar have all moved alike for a time [s]."""
    shift, since = time * np.asarray(scene.radar.velocity, float), channel.geometry.facets.since
    then = scene.at(since)
    stats = channel.stats | {"rays": 0, "tubes": 0}
    return replace(
        channel,
        geometry=geometry_of(then, channel.model.tolerance_db, since),
        points=then.points(),
        launched=channel.launched.moved(shift),
        others=channel.others.moved(shift),
        stats=stats,
    )


def _name(number: int) -> str:
    return f"frame_{number:04d}"


class Store:
    """A directory of frames: frame_0000, frame_0001, ..., each as `raychan run` writes it, and detections.csv of all.

    The first frame replaces the results of an earlier run, all at once. Each further frame is written whole or not at
    all, and detections.csv lists the frames that are there. Raises: StoreError for errors of the disk, and where
    something else has written into the directory since the last frame.
    """

    def __init__(self, directory: str | Path) -> None:
        self.directory = Path(directory).resolve()
        self.count = 0
        self._left: tuple[int, int] | None = None

    def add(self, frame: Frame, draw: Callable[[Result, Path], None] | None = None) -> None:
        """Write a frame; `draw(result, directory)` adds pictures to it."""
        lines = csv_bytes((frame.number, f"{frame.time:.6f}", *row) for row in rows(frame.result))
        if self.count == 0:
            with staging(self.directory, CONTENTS, self._counted) as stage:
                (stage / "detections.csv").write_bytes(csv_bytes([(*HEAD, *columns_of(frame.result))]) + lines)
                (stage / frame.name).mkdir()
                _fill(stage / frame.name, frame, draw)
            return
        self._check()
        with staging(self.directory / frame.name, CONTENTS, lambda: self._listed(frame, lines)) as stage:
            _fill(stage, frame, draw)
            self._check()  # pictures take a while

    def _listed(self, frame: Frame, lines: bytes) -> None:
        """Append a frame in place to detections.csv, or remove it."""
        try:
            self._append(lines)
        except StoreError:
            shutil.rmtree(self.directory / frame.name, ignore_errors=True)
            raise
        self._counted()

    def _counted(self) -> None:
        self.count += 1
        self._left = self._found()

    def _check(self) -> None:
        """Raise StoreError unless the directory is as the last frame left it: of two sequences that share one, or of a
        sequence and a run, the first to begin ends here, and the last keeps the directory for itself."""
        if self._left is None or self._found() != self._left:
            frames = f"{self.count} frame{'' if self.count == 1 else 's'}"
            kept = "something else writes there, or has changed detections.csv; name another directory"
            raise StoreError(f"{self.directory}: is not as this sequence left it after {frames}: {kept}")

    def _found(self) -> tuple[int, int] | None:
        """Return which file detections.csv is, and its size; None where there is none, or not the first frame."""
        try:
            there = (self.directory / "detections.csv").stat()
        except OSError:
            return None
        whole = (self.directory / _name(0) / "result.nc").is_file()
        return (there.st_ino, there.st_size) if whole else None

    def _append(self, lines: bytes) -> None:
        """Append lines to detections.csv, or leave it unchanged."""
        path = self.directory / "detections.csv"
        try:
            with open(path, "ab", buffering=0) as file:
                end = file.tell()
                try:
                    while lines:
                        lines = lines[file.write(lines) :]
                except BaseException:
                    file.truncate(end)
                    raise
        except OSError as error:
            raise StoreError(f"{path}: cannot write: {error.strerror or error}") from error


def _fill(place: Path, frame: Frame, draw: Callable[[Result, Path], None] | None) -> None:
    write_result(frame.result, place)
    if draw is not None:
        draw(frame.result, place)
