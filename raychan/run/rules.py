"""What a run asks of tracing: the scene's model with what was asked for, and the prune rules of its two launches."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from raychan.radar.beam_table import beam_of
from raychan.radar.radar import Radar
from raychan.run.receiver import noise_equivalent_amplitude
from raychan.run.resources import check_demand
from raychan.tracing.settings import PruneRule, refinement
from raychan.tracing.tubes import Refinement
from raychan.units import C0
from raychan.world.limits import BOUNCES, TOLERANCE_DB
from raychan.world.scene import Scene

_COARSER = 3.0  # times the tolerance: the check launch
_JITTER = 0.13  # of an edge, off its middle: the check launch's own lattice of cuts


def asked(scene: Scene, tolerance_db: float | None, max_bounces: int | None) -> Any:
    """Return the scene's model settings with a tolerance [dB] and a number of bounces in place of its own.

    Raises: ValueError where one is out of range; SceneError where the machine has too little memory.
    """
    if tolerance_db is not None:
        TOLERANCE_DB.check("tolerance_db", tolerance_db)
    if max_bounces is not None:
        BOUNCES.check("max_bounces", max_bounces, whole=True)
    check_demand(scene)
    changes = {k: v for k, v in (("tolerance_db", tolerance_db), ("max_bounces", max_bounces)) if v is not None}
    return scene.model.model_copy(update=changes) if changes else scene.model


def fine_rule(radar: Radar, settings: Any, model: Any) -> PruneRule:
    """Return the prune rule of the launch whose paths become the result."""
    return _rule(radar, settings, model, model.tolerance_db, 0.0)


def check_rule(radar: Radar, settings: Any, model: Any) -> PruneRule:
    """Return the prune rule of the launch that tells how wrong the fine one may be: coarser, on another lattice."""
    return _rule(radar, settings, model, _COARSER * model.tolerance_db, _JITTER)


def _rule(radar: Radar, settings: Any, model: Any, tolerance_db: float, jitter: float) -> PruneRule:
    carrier, cell = radar.waveform.carrier, C0 / radar.waveform.bandwidth
    floor = noise_equivalent_amplitude(radar, settings)
    refined = refinement(carrier, tolerance_db, floor, model.max_transmissions, jitter, cell)
    return rule_of(radar, settings, refined, model.max_bounces, model.diffraction)


def rule_of(radar: Radar, settings: Any, refined: Refinement, bounces: int, diffraction: bool = False) -> PruneRule:
    """Return the prune rule of a radar: where it is, where its antennas look, and its noise."""
    place, noise = np.asarray(radar.position, float), noise_equivalent_amplitude(radar, settings)
    return PruneRule(place, beam_of(radar), refined, bounces, noise, diffraction, radar.rx_position)


def changed(rule: PruneRule, **changes: Any) -> PruneRule:
    """Return a prune rule with some fields changed."""
    return dataclasses.replace(rule, **changes)
