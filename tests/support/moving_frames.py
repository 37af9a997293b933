"""The truth of frames in which bodies move: the scene moved to each chirp and traced anew."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

import raychan as rc
from raychan.radar.beam_table import beam_of
from raychan.run.solver import solve
from raychan.signal.baseband import synthesize
from raychan.tracing.settings import PruneRule, refinement
from raychan.units import C0


def every_chirp(scene: rc.Scene) -> tuple[NDArray[np.complex64], PruneRule]:
    """Return the samples, slow and obvious: the scene moved to the middle of each ramp, traced, and that ramp
    synthesised, with constant rates within it; and the rule by which it was traced."""
    wave, radar = scene.radar.waveform, scene.radar
    middle = wave.swept / wave.slope
    rule = refinement(wave.carrier, scene.model.tolerance_db, 0.0, scene.model.max_transmissions)
    rows = []
    for m in range(wave.n_chirps):
        now = scene.at(m * wave.repetition + middle)
        paths, _ = solve(now.facets(), now.points(), now.radar, wave.carrier, rule, scene.model.max_bounces)
        one = dataclasses.replace(now.radar, waveform=dataclasses.replace(wave, n_chirps=1), noise=False)
        grown = middle * paths.length_rate
        turned = paths.amplitude * np.exp(2j * np.pi * wave.carrier / C0 * grown)
        rows.append(synthesize(paths.replace(length=paths.length - grown, amplitude=turned), one).samples)
    return np.concatenate(rows, axis=1), PruneRule(radar.position, beam_of(radar), rule, scene.model.max_bounces)


def energy_db(part: NDArray[Any], whole: NDArray[Any]) -> float:
    """Return the energy of samples against that of others [dB]."""
    return float(10.0 * np.log10((np.abs(part) ** 2).sum() / (np.abs(whole) ** 2).sum()))
