"""Random streams of a run, one a stage, numbered so that one more leaves the others as they are."""

from __future__ import annotations

from enum import IntEnum

import numpy as np


class Stage(IntEnum):
    """Stages that draw random numbers, by the number of their stream: one more leaves the others as they are."""

    NOISE = 0
    PHASE_NOISE = 1
    INTERFERENCE = 2
    CLUTTER = 3
    FLUCTUATION = 4


def stream(seed: int, stage: Stage) -> np.random.Generator:
    """Return the generator of a stage: equal seeds give equal bytes."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(int(stage),)))
