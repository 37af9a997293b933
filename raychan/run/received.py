"""What a real receiver records: noise-free samples, then phase errors, interference, thermal noise, I/Q imbalance and
the converter, in this order."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.radar.radar import Radar
from raychan.records import Cube, Paths
from raychan.run.streams import Stage, stream
from raychan.signal.baseband import noisy, synthesize
from raychan.signal.converter import digitized
from raychan.signal.phase_error import faulty
from raychan.units import db

_FINE = 0.8
"""Of the converter's step: the root mean square of samples' parts from which on rounding changes the level of an echo 6
dB above the noise of a sample by 0.14 dB at most; by 0.54 dB at 0.67, by -1.9 at 0.4 (one seed)."""


def received(
    quiet: Cube,
    paths: Paths,
    radar: Radar,
    seed: int,
    interference: NDArray[np.complex128] | None = None,
    clean: Cube | None = None,
) -> tuple[Cube, list[str]]:
    """Return what the radar's receiver records, and what a user should know of it.

    Args: quiet, the samples without noise or impairments; paths, of which they are the sum, as far as phase errors
    apply to them; seed; interference, samples (a, c, s) that other radars add; clean, the samples of `paths` without
    impairments where they are known (`quiet` itself, where it has nothing else).
    """
    cube = quiet
    if radar.impairments.phase_errors:
        clean = clean or synthesize(paths, radar)
        errors = faulty(paths, radar, stream(seed, Stage.PHASE_NOISE)).samples - clean.samples
        cube = Cube(samples=quiet.samples + errors, noise_power=0.0)
    if interference is not None:
        cube = Cube(samples=(cube.samples + interference).astype(np.complex64), noise_power=0.0)
    cube = noisy(cube, radar, stream(seed, Stage.NOISE))
    said = too_coarse(power_of_parts(cube, radar), radar)
    cube, clipped = digitized(cube, radar.impairments, radar.waveform.complex_sampling)
    return cube, [*said, *clipping(clipped, cube.samples.size)]


def power_of_parts(cube: Cube, radar: Radar) -> float:
    """Return the mean power [W] of the parts of samples that a converter rounds: of I and Q, or of real samples."""
    parts = cube.samples.real.astype(np.float64), cube.samples.imag.astype(np.float64)
    return sum(float((x**2).mean()) for x in parts) / (2.0 if radar.waveform.complex_sampling else 1.0)


def too_coarse(power: float, radar: Radar) -> list[str]:
    """Return a line where samples are small against the steps of a converter. Args: power as `power_of_parts`, without
    I/Q imbalance and DC offset."""
    converter = radar.impairments.converter
    if converter is None or power >= (_FINE * converter.step) ** 2:
        return []
    step, size = (db(max(x, 1e-300)) + 30.0 for x in (converter.step**2, power))
    beside = "" if radar.impairments.dc_offset_dbm is None else ", the DC offset aside"
    return [
        f"the converter's step of {step:.1f} dBm is more than {1.0 / _FINE:g} times the samples' root mean square of "
        f"{size:.1f} dBm{beside}: echoes may be lost or their levels far off, which no error stated holds; more "
        "adc_bits or a lower adc_full_scale_dbm avoids it"
    ]


def clipping(clipped: int, count: int) -> list[str]:
    """Return a line where the converter clips some of `count` samples."""
    if not clipped:
        return []
    return [
        f"the converter clips {clipped:,} of {count:,} samples ({100.0 * clipped / count:.3g} %): a higher "
        "adc_full_scale_dbm avoids it; the errors stated do not hold what clipping does to levels, nor its spurs"
    ]


def notes(radar: Radar, whole: bool, turning: bool) -> list[str]:
    """Return what phase errors leave out: paths that are too many to keep, and bodies that turn."""
    if not radar.impairments.phase_errors:
        return []
    said = [] if whole else ["chirp error and phase noise are those of the strongest paths only, which are kept"]
    return said + (["returns of bodies that turn are without chirp error and phase noise"] if turning else [])
