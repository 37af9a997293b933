"""Choice of mechanisms for `model.mode = "auto"`: those that the tolerance needs, by a coarse launch with all."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.columns import take
from raychan.radar.radar import Radar
from raychan.records import DIFFRACT, TRANSMIT, Paths
from raychan.run.ledger_entry import NOTHING, ModelChoice
from raychan.run.receiver import FAINT, noise_of_beam, quiet_map
from raychan.signal.baseband import synthesize
from raychan.units import db, undb

Floats = NDArray[np.float64]

_SHARE = 0.5  # of the tolerance, as an amplitude: what is left out of bounces, and of layers; not measured
QUIET = 0.87  # of the least detection: noise of its cell raises a level by more (1.2 dB) once in 40 times
_LEVEL = 1e-4  # of the sum of all amplitudes: error of the transform that gives a mechanism's level (not measured)


def interactions(paths: Paths) -> NDArray[np.int64]:
    """Return the number of interactions (n,) of each path, transmissions through thin layers not counted."""
    kind = paths.trajectories.kind
    return np.asarray(((kind > 0) & (kind != TRANSMIT)).sum(axis=1))[paths.trajectory]


def slots_used(paths: Paths) -> int:
    """Return how many of the slots of trajectories hold an interaction of any."""
    return int(np.flatnonzero(paths.trajectories.kind.any(axis=0)).max(initial=-1)) + 1


def layers(paths: Paths) -> NDArray[np.int64]:
    """Return the number of transmissions through thin layers (n,) of each path."""
    return np.asarray((paths.trajectories.kind == TRANSMIT).sum(axis=1))[paths.trajectory]


def layers_at_once(paths: Paths) -> NDArray[np.int64]:
    """Return the most thin layers that each trajectory (w,) passes on one stretch, from surface to surface."""
    found = paths.trajectories.kind
    run = most = np.zeros(len(found), np.int64)
    for kind in found.T:
        run = np.where(kind == TRANSMIT, run + 1, 0)
        most = np.maximum(most, run)
    return most


def needed(paths: Paths, chosen: ModelChoice) -> NDArray[np.bool_]:
    """Return which trajectories (w,) of paths the chosen mechanisms make."""
    kind = paths.trajectories.kind
    bounces = ((kind > 0) & (kind != TRANSMIT)).sum(axis=1)
    few = (bounces <= chosen.bounces) & (layers_at_once(paths) <= chosen.transmissions)
    return np.asarray(few & (chosen.diffraction | ~(kind == DIFFRACT).any(axis=1)))


def peak(paths: Paths, rows: NDArray[np.bool_], radar: Radar, settings: Any) -> float:
    """Return the strongest cell [W] of the noise-free map of some of the paths."""
    return float(_levels(paths, rows, radar, settings).max()) if rows.any() else 0.0


def _levels(paths: Paths, rows: NDArray[np.bool_], radar: Radar, settings: Any) -> Floats:
    """Return the noise-free map [W] of some of the paths."""
    # One pair of elements is as loud as the mean over all.
    one = dataclasses.replace(
        radar, noise=False, elements=radar.elements[:1], tx_elements=radar.tx_elements[:1], multiplexing="none",
        ddm_slots=None, rx_polarization=None if radar.rx_polarization == "both" else radar.rx_polarization,
    )  # fmt: skip
    cube = synthesize(take(paths, rows), one, tolerance=_LEVEL)
    return np.asarray(quiet_map(cube.samples, one, settings))


def least_detection(radar: Radar, settings: Any) -> float:
    """Return the power [W] of the weakest detection that thermal noise allows; 0 without noise."""
    return noise_of_beam(radar, settings) * float(undb(settings.min_snr_db))


def choose(paths: Paths, radar: Radar, settings: Any, tolerance_db: float) -> ModelChoice:
    """Return the fewest bounces and layers that keep every detectable return within the tolerance [dB].

    Args: paths of a launch with all mechanisms. All that has more bounces, or more layers, is left out together where
    in no cell of the map it could change what is detected there, or the weakest detectable return (without noise: 80 dB
    under the strongest cell), by half the tolerance.
    """
    chances = _Chances(paths, radar, settings, tolerance_db)
    if chances.least == 0.0:
        return _choice(1, 0, False, ["nothing returns and there is no noise: no mechanism is needed"], tolerance_db)
    kept: list[int] = []
    passed = layers_at_once(paths)[paths.trajectory]
    for name, count, fewest in (("interactions", interactions(paths), 1), ("thin layers on a stretch", passed, 0)):
        most = int(count.max(initial=fewest))
        while most > fewest and not chances.needed(count >= most, f"{most} {name} or more"):
            most -= 1
        kept.append(most)
    over = (paths.trajectories.kind == DIFFRACT).any(axis=1)[paths.trajectory]
    diffraction = bool(over.any()) and chances.needed(over, "diffraction")
    return _choice(kept[0], kept[1], diffraction, chances.why, tolerance_db, chances.left_db)


class _Chances:
    """What groups of paths could change of a map's detectable cells, and what was found: a line each, `why`, and the
    strongest cell `left_db` [dB] of those that are not needed, against the weakest detectable return."""

    def __init__(self, paths: Paths, radar: Radar, settings: Any, tolerance_db: float) -> None:
        self._paths, self._radar, self._settings, self._tolerance_db = paths, radar, settings, tolerance_db
        total = _levels(paths, np.ones(len(paths.delay), bool), radar, settings)
        self.least = least_detection(radar, settings) or FAINT * float(total.max())
        self._total, self._weak = np.sqrt(total), QUIET * np.sqrt(self.least)
        self.why: list[str] = []
        self.left_db: float | str = NOTHING

    def needed(self, rows: NDArray[np.bool_], name: str) -> bool:
        """Tell whether paths (n,) are needed."""
        levels = _levels(self._paths, rows, self._radar, self._settings)
        level, brought = float(levels.max()) / self.least, np.sqrt(levels)
        # Where all together stays below any detection, with them or without, nothing depends on them.
        matters = self._total + brought >= self._weak
        allowed = _SHARE * (1.0 - 10.0 ** (-self._tolerance_db / 20.0)) * np.maximum(self._total, self._weak)
        share = float((brought / allowed)[matters].max(initial=0.0)) ** 2
        needed, there = share > 1.0, float(db(max(level, 1e-30)))
        most = f"at most {db(share):+.0f} dB of what {self._tolerance_db:g} dB allow" if share > 0.0 else "nothing"
        self.why.append(
            f"{name}: strongest cell {there:+.0f} dB of the weakest detection possible, {most} in a cell that may be "
            f"detected: {'needed' if needed else 'left out'}"
        )
        if not needed:
            self.left_db = there if self.left_db == NOTHING else max(float(self.left_db), there)
        return needed


def _choice(
    bounces: int,
    transmissions: int,
    diffraction: bool,
    why: list[str],
    tolerance_db: float,
    level: float | str = NOTHING,
) -> ModelChoice:
    how = (
        f"chosen by a coarse launch with all mechanisms for a tolerance of {tolerance_db:g} dB; level: the strongest "
        "cell of what is left out, against the weakest detection possible"
    )
    return ModelChoice(level, "estimate", how, bounces, transmissions, diffraction, tuple(why))
