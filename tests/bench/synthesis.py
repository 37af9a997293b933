"""I/Q synthesis against the direct sum and against the 2-D FFT of the same cube; cost by paths, receivers, chirps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import scipy.fft
from support.echoes import echoes, make_radar

from bench.direct import recurrent_sum
from bench.measure import Row, against, barred, rounds
from raychan.columns import take
from raychan.radar.impairments import Impairments, PhaseNoise
from raychan.radar.waveform import Waveform
from raychan.records import Paths
from raychan.signal.baseband import synthesize
from raychan.signal.dechirp import beat_sum
from raychan.signal.phase_error import faulty, spacing
from raychan.units import C0, db

WAVE = Waveform(77e9, 4e9, 60e-6, 60e-6, 128, 1024)
_FEW = 2_000  # paths of the direct sums, whose cost is proportional to their number


def some_paths(count: int) -> Paths:
    """Return random echoes between 1 and 38 m that move by up to 30 m/s."""
    rng = np.random.default_rng(count)
    sizes = rng.normal(size=count) + 1j * rng.normal(size=count)
    return echoes(rng.uniform(1.0, 38.0, count), rng.uniform(-30.0, 30.0, count), sizes)


def synthesis(scenes: Path, repeats: int, quick: bool) -> Iterator[Row]:
    """1e5 paths into 128 chirps of 1,024 samples, 4 GHz, with range migration."""
    count = 10_000 if quick else 100_000
    paths, radar = some_paths(count), make_radar(WAVE)
    name = f"{count:,} paths into 128 x 1,024"
    few = (paths.amplitude[:_FEW], paths.delay[:_FEW], paths.length_rate[:_FEW] / C0)
    ramp = (WAVE.carrier, WAVE.slope, WAVE.repetition, WAVE.chirp_duration / WAVE.n_samples, 128, 1024)

    def ours() -> None:
        synthesize(paths, radar)

    truth = recurrent_sum(*few, *ramp)
    off = synthesize(take(paths, slice(_FEW)), radar).samples[0] - truth
    error = float(db(np.abs(off).max() ** 2 / np.abs(truth).max() ** 2))

    for said, direct in (("phase recurrences", recurrent_sum), ("sin and cos", beat_sum)):
        row = against(
            "synthesis",
            name,
            ours,
            f"direct sum, {said}",
            lambda direct=direct: direct(*few, *ramp),
            repeats,
            times=count / _FEW,
            direct_sum_measured_with_paths=_FEW,
            error_of_ours_db=round(error, 1),
        )
        # A shorter job has less to gain: the bar is that of 1e5 paths.
        yield row if quick else barred(row, "< 1/150", row.ratio < 1.0 / 150.0)
    cube = synthesize(paths, radar).samples[0]

    def fft() -> None:
        scipy.fft.fft2(cube, workers=2)

    yield against("synthesis", name, ours, "2-D FFT of the cube", fft, repeats)


def phase_noise(scenes: Path, repeats: int, quick: bool) -> Iterator[Row]:
    """Synthesis with phase noise against without: few and many groups of paths."""
    count = 10_000 if quick else 100_000
    mask = PhaseNoise([[1e4, -75.0], [1e6, -95.0], [1e7, -115.0]])
    for samples in (256, 1024):
        wave = replace(WAVE, n_samples=samples)
        paths, radar = some_paths(count), make_radar(wave, impairments=Impairments(phase_noise=mask))
        groups = round(float(np.ptp(paths.delay)) / spacing(wave, mask, None))
        name = f"{count:,} paths, 128 x {samples}, {groups} groups"
        yield against(
            "phase noise",
            name,
            lambda p=paths, r=radar: faulty(p, r, np.random.default_rng(0), "groups"),
            "the same without phase noise",
            lambda p=paths, r=radar: synthesize(p, r),
            repeats,
        )


def scaling(scenes: Path, repeats: int, quick: bool) -> Iterator[Row]:
    """Cost of the synthesis by paths, receivers and chirps, each against the first of its kind."""
    count = 10_000 if quick else 100_000
    counts = (1_000, 10_000, 100_000) if quick else (1_000, 10_000, 100_000, 1_000_000)
    steps: list[tuple[str, list[tuple[str, Paths, Waveform, int]]]] = [
        ("paths", [(f"{n:,} paths", some_paths(n), WAVE, 1) for n in counts]),
        ("receivers", [(f"{n} receiver{'s'[: n > 1]}", some_paths(count), WAVE, n) for n in (1, 2, 4, 8)]),
        ("chirps", [(f"{n} chirps", some_paths(count), replace(WAVE, n_chirps=n), 1) for n in (64, 128, 256, 512)]),
    ]  # fmt: skip
    for group, jobs in steps:
        calls = []
        for name, paths, wave, receivers in jobs:
            elements = np.zeros((receivers, 3))
            elements[:, 1] = 0.5 * wave.wavelength * np.arange(receivers)
            radar = replace(make_radar(wave), elements=elements)
            calls.append((name, lambda p=paths, r=radar: synthesize(p, r)))
        for row in rounds(f"synthesis by {group}", calls, repeats):
            yield barred(row, "<= 5", row.ratio <= 5.0) if row.name == "8 receivers" else row
