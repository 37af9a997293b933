"""What a run asks for: memory and time of the machine, and of tracing the prune rules of its two launches.

A run that needs too much memory is refused before it starts. Memory and time are counts times constants, measured on a
machine of 2 cores over cubes of 3e4 to 2e7 samples, one to eight receivers and 1 to 64 map cells a sample, the time
over the three scenes as well (command not noted).
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from raychan.processing.cfar import GUARD, TRAIN, Grid, fitting_guard, full_count, least_snr_db, training
from raychan.processing.staggered import least_snr
from raychan.radar.beam_table import beam_of
from raychan.radar.radar import Radar
from raychan.run.receiver import aperture_of, looks_of, noise_equivalent_amplitude
from raychan.tracing.settings import PruneRule, refinement
from raychan.tracing.tubes import Refinement
from raychan.units import C0
from raychan.world.errors import SceneError
from raychan.world.limits import BOUNCES, TOLERANCE_DB
from raychan.world.scene import Scene

# Peak memory: fixed, a sample, a map cell. Of one scene 25.0 to 26.4 MB by what two threads hold at once (tracemalloc).
_BYTES, _SAMPLE_BYTES, _CELL_BYTES = 2e6, 136.0, 64.0
_SAMPLE_SECONDS, _CELL_SECONDS, _FACET_SECONDS = 1e-6, 1.3e-7, 5e-5  # of one core
_TURN_SECONDS = 6e-7  # a sample and radian of `_bend`
_SHARE = 0.5  # of the memory that a run may take
_MOST = 64e9  # bytes a run may take at most
_LONG = 60.0  # s from which the time is announced
_CGROUPS = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")
_COARSE = 3.0  # times half the noise: a corner of three faces returns by six tubes, some 10 times the noise if detected
_COARSER = 3.0  # times the tolerance: the check launch
# rad: tubes of the first launch: rays against later steps. Their edges are no longer than those of later launches: with
# 1 m the seats behind a windscreen, 36 dB over the noise, are not seen (`bench.detections`, seed 9722).
_PHASE, _TURN = 0.5, 0.5
# Times half the noise: uncut tubes of the first launch. At 4 frames of mode `auto` take 4 to 26 % less CPU, but three
# levels in place of one lie beyond the errors stated (`make bench BENCH="--only auto"`, docs/measurements.md).
_FLOOR = 2.0
# rad: of 120 runs with echoes over two upright cylinders, 23 dB over the noise, 34 lose them with 0.1 and with
# `scene_refinement._MARGIN_DB` of 6, 10 with this and 9, 6 with 0.03 and 9: wider tubes bring them 10 dB too weak
# (`bench.cylinders`, seeds 30 to 89). Rays of the three scenes at 0.5, 1 and 3 dB: 13.7, 14.6 and 15.0 million.
_FAN = 0.05
# Times `Refinement.relative` squared: the error of the antennas' pattern at the middle of an edge of a first tube, over
# its peak.
_PATTERN = 6.0
_JITTER = 0.13  # of an edge, off its middle: the check launch's own lattice of cuts


def asked(model: Any, tolerance_db: float | None, max_bounces: int | None) -> Any:
    """Return a scene's model settings with a tolerance [dB] and a number of bounces in place of its own.

    Raises: ValueError where one is out of range.
    """
    if tolerance_db is not None:
        tolerance_db = TOLERANCE_DB.check("tolerance_db", tolerance_db)
    if max_bounces is not None:
        max_bounces = BOUNCES.check("max_bounces", max_bounces, whole=True)
    changes = {k: v for k, v in (("tolerance_db", tolerance_db), ("max_bounces", max_bounces)) if v is not None}
    return model.model_copy(update=changes) if changes else model


def fine_rule(radar: Radar, settings: Any, model: Any) -> PruneRule:
    """Return the prune rule of the launch whose paths become the result."""
    return _rule(radar, settings, model, model.tolerance_db, 0.0)


def check_rule(radar: Radar, settings: Any, model: Any) -> PruneRule:
    """Return the prune rule of the launch that tells how wrong the fine one may be: coarser, on another lattice."""
    return _rule(radar, settings, model, _COARSER * model.tolerance_db, _JITTER)


def first_rule(radar: Radar, settings: Any, model: Any, step: int = 0) -> PruneRule:
    """Return the prune rule of the launch that tells what a model needs and what feeds detections: coarse, and tubes
    that bounced are cut only where one alone may bring about what a detection needs, or as much of what is found
    there. Args: step, below 0 where it begins twice as coarse for each."""
    rule = step_rule(radar, settings, model, step)
    refined = rule.refinement
    coarse = replace(refined, phase=_PHASE, turn=_TURN, floor=_FLOOR * refined.floor, coarse=_COARSE, fan=_FAN)
    return replace(rule, refinement=coarse)


def step_rule(radar: Radar, settings: Any, model: Any, step: int) -> PruneRule:
    """Return the prune rule of a launch half as coarse for each step, every other one on a lattice of its own."""
    return _rule(radar, settings, model, model.tolerance_db * 0.5**step, _JITTER * (step % 2))


def _rule(radar: Radar, settings: Any, model: Any, tolerance_db: float, jitter: float) -> PruneRule:
    noise, cell = noise_equivalent_amplitude(radar, settings), C0 / radar.waveform.bandwidth
    refined = refinement(radar.waveform.carrier, tolerance_db, noise, model.max_transmissions, jitter, cell)
    return rule_of(radar, noise, refined, model.max_bounces, model.diffraction)


def rule_of(radar: Radar, noise: float, refined: Refinement, bounces: int, diffraction: bool = False) -> PruneRule:
    """Return the prune rule of a radar: where it is, where its antennas look, and its noise [1/m] (see
    `receiver.noise_equivalent_amplitude`)."""
    place, beam = np.asarray(radar.position, float), beam_of(radar)
    # Along an edge the pattern counts as linear: at its middle it is off by bend * angle^2 / 8 of the peak.
    widest = refined.relative * np.sqrt(8.0 * _PATTERN / beam.bend) if beam.bend > 0.0 else np.inf
    return PruneRule(place, beam, replace(refined, widest=widest), bounces, noise, diffraction, radar.rx_position)


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


def check_demand(scene: Scene, memory: float | None = None) -> list[str]:
    """Return warnings on a map that is small for the detector.

    Args: memory [bytes] that the run may take; None: what this machine allows. Raises: SceneError where the run needs
    more, or where its map is too small for the detector.
    """
    need, may = demand(scene), allowed_memory() if memory is None else memory
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
    """Return a line where the map is so small that the CFAR's guard must be smaller than set, and one where it has so
    few training cells that the detector misses echoes above the least SNR."""
    wave, asked = scene.radar.channel_waveform, scene.processing
    count = wave.n_chirps, wave.n_samples if wave.complex_sampling else wave.n_samples // 2
    guard, train = (sizes and sizes[::-1] for sizes in (asked.guard, asked.train))
    fitted = fitting_guard(count, guard, train)
    size = f"a map of {count[0]} x {count[1]} cells (range rate x range)"
    if fitted is None:
        key = "processing.train" if train == (0, 0) else "radar.waveform.samples"
        allowed = "a cell or more" if train == (0, 0) else "6 chirps or 12 samples (24 if real) at least"
        raise SceneError(f"{size} has no room for the detector's training cells", key=key, allowed=allowed)
    said = []
    if fitted != (guard or GUARD):
        said.append(f"{size} is small for the detector: processing.guard = {list(fitted[::-1])} taken")
    windows = asked.rate_window, asked.range_window
    found, full = training(Grid((1, 1), count), fitted, train or TRAIN, windows), full_count(fitted, train or TRAIN)
    few = scene.radar.noise and len(found.offsets) < full
    looks, pfa = looks_of(scene.radar, asked) if few else (1, asked.pfa)
    least = least_snr_db(pfa, found.worth, asked.cfar, looks)
    if few and least > asked.min_snr_db:
        said.append(
            f"{size} has {len(found.offsets)} of the detector's {full} training cells: only echoes "
            f"{least:.0f} dB above the noise are detected, not all above processing.min_snr_db = {asked.min_snr_db:g} "
            "(radar.waveform.chirps, processing.train)"
        )
    return said + _ambiguities(scene)


def _ambiguities(scene: Scene) -> list[str]:
    """Return a line on staggered ramps that tell folds apart at high SNR only, and one on an array without angles."""
    radar, asked, said = scene.radar, scene.processing, []
    if radar.waveform.stagger and radar.noise:
        least = 10.0 * math.log10(least_snr(radar))
        if least > asked.min_snr_db:
            snr = f"above an SNR of {math.ceil(least)} dB only" if math.isfinite(least) else "at no SNR"
            said.append(
                f"the staggered ramps tell folded rates apart, in 99 of 100 cases, {snr}; else a slower rate may "
                "be taken (radar.waveform.stagger_us)"
            )
    if len(radar.elements) > 1 and asked.beams == "coherent" and not any(aperture_of(radar).scans):
        said.append(
            "the receivers spread too little along y and z, under a sixth of a wavelength: no azimuth, and their "
            "powers are averaged instead of added in phase (radar.elements_mm)"
        )
    return said


def _size(count: float) -> str:
    return f"{count / 1e9:,.3g} GB" if count >= 1e9 else f"{count / 1e6:,.3g} MB"
