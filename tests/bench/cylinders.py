"""Echoes over two upright cylinders, a little above the weakest detection: how many a run loses.

No single tube brings such an echo: some hundred between two curved surfaces add up to it, and where they are too wide
they come to 10 dB less. `rules._FAN` and `scene_refinement._MARGIN_DB` were chosen on seeds 30 to 89.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from time import process_time

import numpy as np

import raychan as rc
from bench.measure import Row

_FIRST, _SCENES, _QUICK = 200, 30, 4  # seeds of the judged scenes
_SNR = 23.0, 26.0  # dB; the weakest detection has 20
_TOLERANCES = 0.5, 3.0  # dB
_KNOWN = 0.1  # dB: tolerance of the run by which the level is known
_POWER = 20.0  # dBm
_NEAR = 0.2, 0.8  # m, m/s


def cylinders(scenes: Path, repeats: int, quick: bool) -> Iterator[Row]:
    """Count lost echoes of random scenes at a given SNR."""
    known = [(seed, *echo(seed)) for seed in range(_FIRST, _FIRST + (_QUICK if quick else _SCENES))]
    for snr in _SNR:
        lost, start = [], process_time()
        for seed, place, rate, found in known:
            for tolerance in _TOLERANCES:
                run = rc.simulate(scene(seed, _POWER + snr - found), tolerance_db=tolerance)
                if not detected(run, place, rate).any():
                    lost.append(f"{seed} at {tolerance:g} dB")
        count = len(known) * len(_TOLERANCES)
        more = {"lost": len(lost), "which": lost}
        yield Row("cylinders", f"{count} echoes of {snr:g} dB", process_time() - start, more=more)


def scene(seed: int, power_dbm: float) -> rc.Scene:
    """Return two cylinders that move apart along the road, so that their common echo has a rate of its own."""
    rng, bodies = np.random.default_rng(seed), []
    for i, (side, speed) in enumerate(((1.0, 6.0), (-1.0, -5.0))):
        size = {"radius": rng.uniform(0.08, 0.4), "height": rng.uniform(0.8, 1.6)}
        at = (rng.uniform(5.0, 9.0), side * rng.uniform(0.6, 2.5), 0.05)
        bodies.append(rc.Body(name=f"c{i}", shape="cylinder", params=size, position=at, velocity=(speed, 0.0, 0.0)))
    wave = {"carrier_ghz": 77.0, "bandwidth_mhz": 1000, "chirp_us": 40, "chirps": 128, "samples": 256}
    radar = {"position": [0, 0, 0.7], "power_dbm": power_dbm, "noise_figure_db": 12.0, "waveform": wave}
    return rc.Scene(bodies=bodies, radar=radar | {"antenna": {"kind": "isotropic"}}, model={"max_bounces": 2})


def echo(seed: int) -> tuple[float, float, float]:
    """Return range [m], range rate [m/s] and SNR [dB] of the echo over both cylinders, by a fine run."""
    run = rc.simulate(scene(seed, _POWER), tolerance_db=_KNOWN)
    paths = run.paths
    both = np.flatnonzero((paths.trajectories.kind != 0).sum(axis=1)[paths.trajectory] == 2)
    at = both[np.argmax(np.abs(paths.amplitude[both]))]
    place, rate = float(paths.range[at]), float(paths.range_rate[at])
    i, j = np.argmin(np.abs(run.rdmap.range - place)), np.argmin(np.abs(run.rdmap.rate - rate))
    peak = run.rdmap.power[j - 1 : j + 2, i - 1 : i + 2].max()
    return place, rate, float(10.0 * np.log10(peak / run.rdmap.noise))


def detected(run: rc.Result, place: float, rate: float) -> np.ndarray:
    """Tell which detections (n,) lie at a range [m] and a range rate [m/s]."""
    away = np.abs(run.detections.range - place), np.abs(run.detections.rate - rate)
    return (away[0] < _NEAR[0]) & (away[1] < _NEAR[1])
