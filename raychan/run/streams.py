"""Random streams of a run, one a stage, and in a stage one a name: one more leaves the others as they are."""

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


def stream(seed: int, stage: Stage, name: str | None = None) -> np.random.Generator:
    """Return the generator of a stage, or of what a name stands for in it: equal seeds give equal bytes."""
    # The letters themselves are the key: no two names share one, and it is the same in every process.
    own = () if name is None else tuple(name.encode("utf-8", "surrogatepass"))
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(int(stage), *own)))
