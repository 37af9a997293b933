"""Memory and time that a run needs, estimated before it starts; a run that needs too much memory is refused.

Both are counts times constants, measured on a machine of 2 cores over cubes of 3e4 to 2e7 samples, one to eight
receivers and 1 to 64 map cells a sample, the time over the three scenes as well (command not noted).
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from raychan.processing.cfar import GUARD, fitting_guard
from raychan.units import C0
from raychan.world.errors import SceneError
from raychan.world.scene import Scene

_BYTES, _SAMPLE_BYTES, _CELL_BYTES = 2e6, 120.0, 64.0  # peak memory: fixed, a sample, a map cell (tracemalloc)
_SAMPLE_SECONDS, _CELL_SECONDS, _FACET_SECONDS = 1e-6, 1.3e-7, 5e-5  # of one core
_TURN_SECONDS = 6e-7  # a sample and radian of `_bend`
_SHARE = 0.5  # of the memory that a run may take
_MOST = 64e9  # bytes a run may take at most
_LONG = 60.0  # s from which the time is announced
_CGROUPS = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")


@dataclass(frozen=True)
class Demand:
    """Estimated needs of a run: `memory` [bytes] for samples and maps, and `seconds`."""

    memory: float
    seconds: float

    @property
    def text(self) -> str:
        """The estimate in words."""
        minutes = f"{self.seconds / 60.0:,.0f} min" if self.seconds >= 90.0 else f"{self.seconds:.0f} s"
        return f"roughly {minutes} and {_size(self.memory)} of memory"


def demand(scene: Scene) -> Demand:
    """Return the estimated memory and time of a run."""
    wave = scene.radar.waveform
    samples = float(scene.radar.receivers) * wave.n_chirps * wave.n_samples
    cells = samples * scene.processing.pad[0] * scene.processing.pad[1]
    facets = sum(len(body.geometry.faces) for body in scene.bodies)
    tracings = 1 if scene.model.retrace == "auto" else scene.model.retrace
    work = (
        samples * (_SAMPLE_SECONDS + _TURN_SECONDS * _bend(scene))
        + cells * _CELL_SECONDS
        + facets * tracings * _FACET_SECONDS
    )
    return Demand(_BYTES + samples * _SAMPLE_BYTES + cells * _CELL_BYTES, work / min(os.cpu_count() or 1, 2))


def _bend(scene: Scene) -> float:
    """Return the phase [rad], if above 1, by which echoes of different rates deviate from each other over a long frame:
    grids and terms of the fast sum grow with it (see signal.keystone)."""
    wave, own = scene.radar.waveform, np.asarray(scene.radar.velocity, float)
    fastest = max((float(np.linalg.norm(body.motion.velocity - own)) for body in scene.bodies), default=0.0)
    turn = 2.0 * math.pi * wave.slope * (fastest / C0 * 0.5 * wave.frame_duration) ** 2
    return turn if turn > 1.0 else 0.0


def allowed_memory() -> float:
    """Return the memory [bytes] that a run may take: half of the machine's or of its container's, 64 GB at most."""
    found = [2.0 * _MOST]
    if hasattr(os, "sysconf") and "SC_PHYS_PAGES" in os.sysconf_names:
        found.append(float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE"))
    for name in _CGROUPS:
        try:
            found.append(float(Path(name).read_text(encoding="ascii")))
        except (OSError, ValueError):
            continue
    return min(_SHARE * min(found), _MOST)


def check_demand(scene: Scene) -> list[str]:
    """Return warnings on a map that is small for the detector.

    Raises: SceneError where the run needs more memory than it may take, or where its map is too small for the detector.
    """
    need, may = demand(scene), allowed_memory()
    if need.memory > may:
        raise _refused(scene, need.memory, may)
    return _detector(scene)


def long_run(scene: Scene, frames: int = 1) -> list[str]:
    """Return a line on the time of a run of so many frames, if it is long."""
    need = demand(scene)
    seconds = need.seconds * frames
    return [f"this takes {Demand(need.memory, seconds).text}"] if seconds > _LONG else []


def _refused(scene: Scene, need: float, may: float) -> SceneError:
    """Return the error that names the key by which a scene needs too much memory, and the value that is possible."""
    wave, pad, receivers = scene.radar.waveform, scene.processing.pad, scene.radar.receivers
    plain = float(wave.n_chirps) * wave.n_samples * (_SAMPLE_BYTES + _CELL_BYTES)
    key: str
    value: Any
    if pad[0] * pad[1] > 1 and receivers * plain <= may:
        most = int((may / (receivers * wave.n_chirps * wave.n_samples) - _SAMPLE_BYTES) / _CELL_BYTES)
        key, value, allowed = "processing.pad", list(pad), f"a product of both of at most {most}"
    elif receivers > 1 and need / receivers <= may:
        key, value = "radar.elements_mm", receivers
        allowed = f"at most {int(may * receivers / need)} receivers"
    else:
        name = "chirps" if wave.n_chirps > wave.n_samples else "samples"
        value = max(wave.n_chirps, wave.n_samples)
        key, allowed = f"radar.waveform.{name}", f"at most {int(may / need * value)} with the other keys as they are"
    cube = f"{wave.n_chirps} chirps x {wave.n_samples} samples x {receivers} receivers, padded {pad[0]} x {pad[1]}"
    problem = (
        f"{cube}, needs {_size(need)} of memory; a run may have {_size(may)} (half of the machine's, 64 GB at most)"
    )
    return SceneError(problem, file=scene.path, key=key, value=value, allowed=allowed)


def _detector(scene: Scene) -> list[str]:
    """Return a line where the map is so small that the CFAR's guard must be smaller than set."""
    wave, asked = scene.radar.channel_waveform, scene.processing
    count = wave.n_chirps, wave.n_samples if wave.complex_sampling else wave.n_samples // 2
    guard, train = (sizes and sizes[::-1] for sizes in (asked.guard, asked.train))
    fitted = fitting_guard(count, guard, train)
    size = f"a map of {count[0]} x {count[1]} cells (range rate x range)"
    if fitted is None:
        key = "processing.train" if train == (0, 0) else "radar.waveform.samples"
        allowed = "a cell or more" if train == (0, 0) else "6 chirps or 12 samples (24 if real) at least"
        raise SceneError(f"{size} has no room for the detector's training cells", key=key, allowed=allowed)
    if fitted == (guard or GUARD):
        return []
    return [f"{size} is small for the detector: processing.guard = {list(fitted[::-1])} taken"]


def _size(count: float) -> str:
    return f"{count / 1e9:,.3g} GB" if count >= 1e9 else f"{count / 1e6:,.3g} MB"
