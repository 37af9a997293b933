"""What a real receiver records: noise-free samples, then phase errors, interference, thermal noise, I/Q imbalance and
the converter, in this order."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.radar.radar import Radar
from raychan.records import Cube, Paths
from raychan.run.rounding import Rounding, rounding_of
from raychan.run.segments import Retraced
from raychan.run.streams import Stage, stream
from raychan.signal.baseband import noisy, synthesize
from raychan.signal.converter import digitized
from raychan.signal.phase_error import Delays, Oscillator, faulty


def received(
    quiet: Cube,
    paths: Paths,
    radar: Radar,
    seed: int,
    interference: NDArray[np.complex128] | None = None,
    clean: Cube | None = None,
    turned: Retraced | None = None,
) -> tuple[Cube, list[str], Rounding | None]:
    """Return what the radar's receiver records, what a user should know of it, and what its converter may spoil.

    Args: quiet, the samples without noise or impairments; paths, of which they are the sum, as far as phase errors
    apply to them; seed; interference, samples (a, c, s) that other radars add; clean, the samples of `paths` without
    impairments where they are known (`quiet` itself, where it has nothing else); turned, a frame traced several times,
    whose turning part is turned beside the paths.
    """
    cube = quiet
    if radar.impairments.phase_errors:
        clean = clean or synthesize(paths, radar)
        delays, again = Delays.of(paths, radar.waveform), turned and turned.again
        # One oscillator for all: its draw is long enough for every delay.
        by = Oscillator.of(radar, again.beside(delays) if again else delays, stream(seed, Stage.PHASE_NOISE))
        errors = faulty(paths, radar, by).samples - clean.samples
        if turned and again:
            errors = errors + (again.samples(by) - turned.turning).astype(np.complex64)
        cube = Cube(samples=quiet.samples + errors, noise_power=0.0)
    if interference is not None:
        cube = Cube(samples=(cube.samples + interference).astype(np.complex64), noise_power=0.0)
    rounding = rounding_of(cube.samples, radar)
    cube = noisy(cube, radar, stream(seed, Stage.NOISE))
    cube, clipped = digitized(cube, radar.impairments, radar.waveform.complex_sampling)
    return cube, clipping(clipped, cube.samples.size), rounding


def clipping(clipped: int, count: int) -> list[str]:
    """Return a line where the converter clips some of `count` samples."""
    if not clipped:
        return []
    return [
        f"the converter clips {clipped:,} of {count:,} samples ({100.0 * clipped / count:.3g} %): a higher "
        "adc_full_scale_dbm avoids it; the errors stated do not hold what clipping does to levels, nor its spurs"
    ]


def notes(radar: Radar, whole: bool) -> list[str]:
    """Return what phase errors leave out: paths that are too many to keep."""
    if whole or not radar.impairments.phase_errors:
        return []
    return ["chirp error and phase noise are those of the strongest paths only, which are kept"]
