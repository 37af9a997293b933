"""Choice of mechanisms for `model.mode = "auto"`: those that the tolerance needs, by a coarse launch with all."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.columns import take
from raychan.radar.radar import Radar
from raychan.records import DIFFRACT, TRANSMIT, Paths
from raychan.run.ledger import NOTHING, ModelChoice
from raychan.run.receiver import quiet_map
from raychan.signal.baseband import synthesize
from raychan.units import db, undb

_LEVEL = 1e-4  # of the sum of all amplitudes: error of the transform that gives a mechanism's level (not measured)


def interactions(paths: Paths) -> NDArray[np.int64]:
    """Return the number of interactions (n,) of each path, transmissions through thin layers not counted."""
    kind = paths.trajectories.kind
    return np.asarray(((kind > 0) & (kind != TRANSMIT)).sum(axis=1))[paths.trajectory]


def layers(paths: Paths) -> NDArray[np.int64]:
    """Return the number of transmissions through thin layers (n,) of each path."""
    return np.asarray((paths.trajectories.kind == TRANSMIT).sum(axis=1))[paths.trajectory]


def needed(paths: Paths, chosen: ModelChoice) -> NDArray[np.bool_]:
    """Return which trajectories (w,) of paths the chosen mechanisms make."""
    kind = paths.trajectories.kind
    bounces, passed = ((kind > 0) & (kind != TRANSMIT)).sum(axis=1), (kind == TRANSMIT).sum(axis=1)
    few = (bounces <= chosen.bounces) & (passed <= chosen.transmissions)
    return np.asarray(few & (chosen.diffraction | ~(kind == DIFFRACT).any(axis=1)))


def peak(paths: Paths, rows: NDArray[np.bool_], radar: Radar, settings: Any) -> float:
    """Return the strongest cell [W] of the noise-free map of some of the paths."""
    if not rows.any():
        return 0.0
    # One pair of elements is as loud as the mean over all.
    one = dataclasses.replace(
        radar, noise=False, elements=radar.elements[:1], tx_elements=radar.tx_elements[:1], multiplexing="none",
        ddm_slots=None, rx_polarization=None if radar.rx_polarization == "both" else radar.rx_polarization,
    )  # fmt: skip
    cube = synthesize(take(paths, rows), one, tolerance=_LEVEL)
    return float(quiet_map(cube.samples, one, settings).max())


def choose(paths: Paths, radar: Radar, settings: Any, noise: float, tolerance_db: float) -> ModelChoice:
    """Return the fewest bounces and layers that keep every detectable return within the tolerance.

    Args: paths of a launch with all mechanisms; noise [W] of a cell of the map (0: 80 dB under the strongest cell
    counts). A mechanism counts where its strongest cell could change the weakest detectable return by the tolerance
    [dB].
    """
    everything = np.ones(len(paths.delay), bool)
    weakest = noise * undb(settings.min_snr_db) if noise > 0.0 else peak(paths, everything, radar, settings) * 1e-8
    limit = float(weakest) * (10.0 ** (tolerance_db / 20.0) - 1.0) ** 2
    why, chosen = [], []
    if limit == 0.0:
        return _choice(1, 0, False, ["nothing returns and there is no noise: no mechanism is needed"], tolerance_db)
    for name, count, least in (
        ("interactions", interactions(paths), 1),
        ("thin layers passed", layers(paths), 0),
    ):
        keep = least
        for n in range(least, int(count.max(initial=least)) + 1):
            level = peak(paths, count == n, radar, settings)
            needed = level > limit
            keep = n if needed else keep
            if level > 0.0:
                say = "needed" if needed else "not needed"
                why.append(
                    f"{n} {name}: strongest cell {db(level / limit):+.0f} dB of what {tolerance_db:g} dB allow: {say}"
                )
        chosen.append(keep)
    level = peak(paths, (paths.trajectories.kind == DIFFRACT).any(axis=1)[paths.trajectory], radar, settings)
    say = "needed" if level > limit else "not needed"
    why.append(
        f"diffraction: strongest cell {db(max(level / limit, 1e-30)):+.0f} dB of what {tolerance_db:g} dB allow: {say}"
    )
    return _choice(chosen[0], chosen[1], level > limit, why, tolerance_db)


def _choice(bounces: int, transmissions: int, diffraction: bool, why: list[str], tolerance_db: float) -> ModelChoice:
    how = f"chosen by a coarse launch with all mechanisms for a tolerance of {tolerance_db:g} dB"
    return ModelChoice(NOTHING, "estimate", how, bounces, transmissions, diffraction, tuple(why))
