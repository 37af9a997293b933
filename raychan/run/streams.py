"""Random streams of a run, one a stage, numbered so that one more leaves the others as they are."""

from __future__ import annotations

import numpy as np

NOISE = 0
FLUCTUATION = 7


def stream(seed: int, stage: int) -> np.random.Generator:
    """Return the generator of a stage: equal seeds give equal bytes."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(stage,)))
