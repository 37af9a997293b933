"""Spectrograms: received power against range rate and time, over seconds in which bodies move in themselves.

The chirps of the radar follow each other without a pause for as long as is asked. The scene is traced at equal
distances, and the samples of all chirps are carried on from tracing to tracing (see run.micro_doppler). Range cells
are formed chirp by chirp, and each is transformed over short stretches of slow time.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import ShortTimeFFT

from raychan.blas import on_one_blas_thread
from raychan.columns import Record, column
from raychan.radar.declared import reals
from raychan.radar.radar import Radar
from raychan.radar.windows import window
from raychan.records import Cube
from raychan.reprs import Plotted
from raychan.run.clock import Clock, Progress
from raychan.run.micro_doppler import stretches
from raychan.run.received import clipping
from raychan.run.rounding import coarse_picture, rounding_of, spoils
from raychan.run.rules import allowed_memory, asked, check_demand, fine_rule
from raychan.run.streams import Stage, stream
from raychan.signal.baseband import noisy
from raychan.signal.converter import digitized
from raychan.units import C0, db
from raychan.world.errors import SceneError
from raychan.world.limits import CELL_RANGE, RATE_STEP, SECONDS, SEED, TRACED
from raychan.world.scene import Scene
from raychan.world.scene_given import check_scene

Floats = NDArray[np.float64]
Samples = NDArray[np.complex64]

_TRACINGS = 50.0
"""A second: fewer are less accurate, as limbs turn other sides to the radar in between. Of a walker neighbours differ
by -19, -21, -23, -21 dB at 12.5, 25, 50, 100 (the error that `raychan spectrogram --tracings N` prints); from 50 on the
random part of the launches is what is left."""
_RESOLUTION = 0.1  # m/s: finer tells slow limbs apart, coarser follows fast ones (not measured)
_LEAST = 4  # chirps in a stretch: fewer tell hardly any rate from another (not measured)
_BYTES = 32.0  # of memory, a sample of slow time: the samples, and the transforms of one range cell
_OVERLAP = 8  # stretches that each instant belongs to: a picture without steps (not measured)


@dataclass(frozen=True)
class Spectrogram(Record, Plotted):
    """Power against time and range rate.

    The peak of a lone echo of even motion reads its received power, less between two rates (up to 0.4 dB with a Hann
    window), and where cells that its range window spreads it over are not asked for.
    """

    time: Floats = column("t", unit="s", doc="middle of each stretch, from the start of the first chirp")
    rate: Floats = column("v", unit="m/s", doc="range rate, receding positive")
    power: Floats = column("t v", unit="W", doc="of the range cells asked for, mean of the receivers")
    ranges: tuple[float, float]
    """Range cells summed, from and to [m]."""
    resolution: float
    """Of the range rate, rectangular window [m/s]."""
    noise: float
    """Thermal noise of a cell, of all range cells asked for [W]; 0 where noise is off."""
    error_db: float
    """Power by which neighbouring tracings differ, over the power of all samples [dB]: the error of carrying on."""
    tracings: int
    """Tracings of the scene."""
    seed: int
    warnings: tuple[str, ...] = ()
    """What a user should know: samples that the converter clips, and what is left out."""


@on_one_blas_thread
def spectrogram(
    scene: Scene,
    duration: float,
    *,
    ranges: tuple[float, float] | None = None,
    resolution: float = _RESOLUTION,
    tracings_per_second: float = _TRACINGS,
    seed: int = 0,
    tolerance_db: float | None = None,
    max_bounces: int | None = None,
    progress: Progress | None = None,
) -> Spectrogram:
    """Return the spectrogram of a scene over a duration [s] of chirps without a pause.

    Args: ranges (from, to) [m] of the cells to sum, all if None; resolution [m/s] of the range rate, which sets the
    length of a stretch; tracings_per_second of the scene; seed of the noise; tolerance_db [dB] and max_bounces override
    the scene's; progress is told how far it is. Rates fold at the unambiguous range rate of the waveform.
    Raises: ValueError on arguments out of range; SceneError for no Scene, a radar that runs into a body, or motion
    beyond the places that a scene may have.
    """
    check_scene(scene)
    tracings_per_second = TRACED.check("tracings_per_second", tracings_per_second)
    seed = SEED.check("seed", seed, whole=True)
    duration, resolution = SECONDS.check("duration", duration), RATE_STEP.check("resolution", resolution)
    chirps, length = _chirps(scene, duration, resolution)
    check_demand(scene)
    model = asked(scene.model, tolerance_db, max_bounces)
    wave = scene.radar.waveform
    count = max(2, 1 + round(duration * tracings_per_second))
    radar = replace(scene.radar, waveform=replace(wave, n_chirps=chirps))
    cells = _cells(radar, ranges)
    _check_memory(duration, chirps * len(cells) * len(radar.elements), radar)
    tell = Clock(progress).tell
    rng, slow, signal, error, clipped = stream(seed, Stage.NOISE), list[Samples](), 0.0, 0.0, 0
    spoilt = list[Samples]()
    rule = fine_rule(scene.radar, scene.processing, model)
    for quiet, off in stretches(_with(scene, radar), rule, model, count, lambda share: tell("trace", share)):
        signal, error = signal + float((np.abs(quiet) ** 2).sum()), error + float((np.abs(off) ** 2).sum())
        cube = Cube(quiet.astype(np.complex64), 0.0)
        spoilt += _rounded(cube, radar, cells)
        cube = noisy(cube, radar, rng)
        cube, over = digitized(cube, radar.impairments, wave.complex_sampling)
        clipped += over
        slow.append(_range_cells(cube, radar, cells))
    time, rate, power, gain = _transformed(np.concatenate(slow, axis=1), radar, length)
    # The range window spreads an echo over neighbouring cells, whose powers add up to this times its own.
    spread = wave.n_samples * _range_gain(radar)
    noise = _noise(radar, gain * len(cells))
    return Spectrogram(
        time=time,
        rate=rate,
        power=power / spread,
        ranges=(float(cells[0] * wave.range_resolution), float(cells[-1] * wave.range_resolution)),
        resolution=0.5 * C0 / wave.middle / (length * wave.repetition),
        noise=noise,
        error_db=float(db(error / signal)) if signal > 0.0 else float("-inf"),
        tracings=count,
        seed=seed,
        warnings=(*_coarse(spoilt, radar, length, spread, noise), *_clipping(clipped, radar), *_left_out(scene)),
    )


def _check_memory(duration: float, samples: int, radar: Radar) -> None:
    """Raise ValueError if so many samples of slow time, over a duration [s], take more memory than is allowed."""
    # Those that a coarse converter rounds are held once more, and its errors too.
    if (need := _BYTES * samples * (3 if spoils(radar) else 1)) > allowed_memory():
        raise ValueError(f"duration = {duration:g} s takes {need / 1e9:.0f} GB of memory: fewer ranges take less")


def _rounded(cube: Cube, radar: Radar, cells: NDArray[np.int64]) -> list[Samples]:
    """Return what a coarse converter rounds of samples without noise, and its errors, as one array (2, antenna, chirp,
    cell); nothing of others."""
    rounding = rounding_of(cube.samples, radar)
    if rounding is None:
        return []
    return [np.stack([_range_cells(Cube(x, 0.0), radar, cells) for x in (rounding.signal, rounding.error)])]


def _noise(radar: Radar, gain: float) -> float:
    """Return the thermal noise [W] of cells that hold such a share of that of a sample, over all samples of a ramp."""
    if not radar.noise:
        return 0.0
    return radar.noise_power / radar.waveform.n_samples * gain * (1.0 if radar.waveform.complex_sampling else 2.0)


def _coarse(spoilt: list[Samples], radar: Radar, length: int, spread: float, noise: float) -> list[str]:
    """Return a line on the converter's steps. Args: spoilt, signals and errors of rounding (2, antenna, chirp, cell) of
    all parts; the rest as `_transformed` and `Spectrogram` have it."""
    if not spoilt:
        return []
    signal, error = np.concatenate(spoilt, axis=2)
    plain, rounded, alone = (_transformed(x, radar, length)[2] / spread for x in (signal, signal + error, error))
    return coarse_picture(plain, rounded, alone, noise, radar)


def _clipping(clipped: int, radar: Radar) -> list[str]:
    wave = radar.waveform
    return clipping(clipped, wave.n_chirps * wave.n_samples * radar.receivers)


def _left_out(scene: Scene) -> list[str]:
    """Return a line on what a scene has and its spectrogram is without."""
    named = [f"interferer '{one.name}'" for one in scene.interferers]
    wrong = scene.radar.impairments
    named += [] if wrong.chirp_error is None else ["the chirp error"]
    named += [] if wrong.phase_noise is None else ["phase noise"]
    return [f"the spectrogram is without {', '.join(named)}: only `raychan run` has that"] if named else []


def _chirps(scene: Scene, duration: float, resolution: float) -> tuple[int, int]:
    """Return how many chirps there are, and how many of them make a stretch. Raises: ValueError where that cannot be;
    SceneError for a target that fluctuates, which only `simulate` draws."""
    if scene.radar.rx_position is not None:
        raise ValueError("a spectrogram is of receivers beside the transmitter: radar.rx_position is elsewhere")
    if scene.radar.rx_polarization == "both":
        raise ValueError('a spectrogram is of receivers of one polarisation: radar.rx_polarization = "both" has two')
    if len(scene.radar.tx_elements) > 1:
        raise ValueError("a spectrogram is of one transmitter: radar.tx_elements has several")
    if scene.radar.waveform.stagger:
        raise ValueError("a spectrogram is of ramps at equal distances: radar.waveform has a stagger")
    for body in scene.bodies:
        if body.fluctuates:
            key, allowed = f"bodies.{body.name}.swerling", "0: in a spectrogram targets are steady"
            raise SceneError(f"{body.swerling} is not possible", key=key, value=body.swerling, allowed=allowed)
    wave = scene.radar.waveform
    chirps, one = round(duration / wave.repetition), 0.5 * C0 / wave.middle / wave.repetition
    if chirps < _LEAST:
        raise ValueError(f"duration = {duration:g} s: a stretch of {_LEAST} chirps, the shortest, takes longer")
    length = round(one / resolution)
    if length > chirps:
        raise ValueError(f"duration = {duration:g} s: a range rate resolution of {resolution:g} m/s takes longer")
    if length < _LEAST:
        ends = (
            f"{one / chirps:.3g} m/s, a stretch of all {chirps:,} chirps, and {one / _LEAST:.3g} m/s, one of {_LEAST}"
        )
        raise ValueError(f"resolution = {resolution:g} m/s: must lie between {ends}")
    return chirps, length


def _with(scene: Scene, radar: Radar) -> Scene:
    """Return the same scene with another radar at the same place."""
    there = copy(scene)
    there.__dict__["radar"] = radar
    return there


def _cells(radar: Radar, ranges: tuple[float, float] | None) -> NDArray[np.int64]:
    """Return the range cells to sum. Raises: ValueError where there is none."""
    wave = radar.waveform
    cells = np.arange(wave.n_samples if wave.complex_sampling else wave.n_samples // 2)
    if ranges is not None:
        ends = reals("ranges", ranges)
        if ends.shape != (2,):
            raise ValueError(f"ranges = {ranges!r}: two numbers are wanted, from and to [m]")
        near, far = ends.tolist()
        CELL_RANGE.check("ranges[0]", near)
        at = cells * wave.range_resolution
        cells = cells[(at >= near) & (at <= far)]
    if not len(cells):
        raise ValueError(f"ranges = {ranges} m: no range cell lies there, of 0 to {wave.unambiguous_range:.4g} m")
    return cells


def _range_cells(cube: Cube, radar: Radar, cells: NDArray[np.int64]) -> Samples:
    """Return the slow-time signal (antenna, chirp, cell) of range cells; the peak of an echo reads its voltage."""
    taper = window(radar.processing.range_window, radar.waveform.n_samples)
    # Echoes turn backwards in our samples: of their conjugate, ranges and receding rates are positive frequencies.
    spectrum = np.fft.fft(cube.samples.conj() * (taper / taper.sum()), axis=2)[..., cells]
    return np.asarray(spectrum * (1.0 if radar.waveform.complex_sampling else 2.0), np.complex64)


def _range_gain(radar: Radar) -> float:
    taper = window(radar.processing.range_window, radar.waveform.n_samples)
    return float((taper**2).sum() / taper.sum() ** 2)


def _transformed(slow: Samples, radar: Radar, length: int) -> tuple[Floats, Floats, Floats, float]:
    """Return times, range rates, powers (t, v), and what windowing leaves of white noise, of signals (antenna, chirp,
    cell) over stretches of `length` chirps."""
    wave = radar.waveform
    taper = window(radar.processing.rate_window, length)
    size = 1 << int(np.ceil(np.log2(2 * length)))
    # Where no stretch of the finer grid lies within the chirps, the first one that does begins with them.
    for step in (max(1, length // _OVERLAP), length // 2):
        short = ShortTimeFFT(taper / taper.sum(), step, 1.0 / wave.repetition, fft_mode="centered", mfft=size)
        begin, end = short.lower_border_end[1], short.upper_border_begin(slow.shape[1])[1]
        if end > begin:
            break
    power: Floats | float = 0.0
    for antenna in slow:
        for signal in antenna.T:
            power = power + np.abs(short.stft(signal, p0=begin, p1=end)) ** 2
    time = short.t(slow.shape[1], begin, end) + 0.5 * wave.chirp_duration
    # A rate is that of the carrier at the middle of the ramp.
    rate = short.f * 0.5 * C0 / wave.middle
    return time, rate, np.asarray(power).T / len(slow), float((taper**2).sum() / taper.sum() ** 2)
