"""Visibility of one body to the radar: the share of it that is hidden, by which bodies, and the levels of its
returns."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from raychan.columns import take
from raychan.processing.range_doppler import range_doppler
from raychan.radar.declared import check_type
from raychan.radar.radar import Radar
from raychan.records import DIFFRACT, MIRROR, Facets, Paths, Points
from raychan.run.explanation.labels import Chains, chains, label_of
from raychan.run.receiver import noise_of_beam
from raychan.run.result import DIRECT, MULTIPATH, Explanation, Result
from raychan.run.solver import paths_over_wedges
from raychan.scalars import is_one_of, shown
from raychan.signal.baseband import synthesize
from raychan.tracing.occlusion import Occlusion, occlusion
from raychan.units import db, undb
from raychan.world.body import Body
from raychan.world.geometry import Geometry
from raychan.world.scene import Scene

DIFFRACTED = "diffracted"
WAYS = (DIRECT, MULTIPATH, DIFFRACTED)

_FINE = 4  # zero padding with which the strongest cell is within 0.2 dB of the peak (command not recorded)


@dataclass(frozen=True)
class Level:
    """Level of the returns of one kind in a map without noise and other bodies."""

    power: float
    """Power of the strongest cell [W]; 0 where there is no such path."""
    margin_db: float | None
    """Level over the weakest reported power (minimum SNR over thermal noise) [dB]; None without noise."""
    range: float | None
    """Range of that cell [m]."""


@dataclass(frozen=True)
class Visibility:
    """Visibility of one body to one radar."""

    target: str
    occlusion: Occlusion
    levels: dict[str, Level | None]
    """By WAYS; None for what is not modelled: diffraction round edges to bodies that are meshes."""
    detections: tuple[int, ...]
    """Rows of the result's detections whose leading chain holds the body, strongest first."""


def visibility(result: Result, target: str) -> Visibility:
    """Return the visibility of a body to the radar of a result.

    Args: result of a run with its scene; target a body's name. A path counts as direct or multipath by the
    rule for the labels of detections; as diffracted where it met an edge, by the scene's model or, where that leaves
    diffraction out, by single wedges (UTD).
    Raises: ValueError for no Result, an unknown body, the ground, or the radar's own vehicle.
    """
    check_type("result", result, Result)
    scene, time = check_target(result.scene, target), result.traced_at
    facets, points, radar = scene.facets(time).replace(since=time), scene.points(time), scene.radar_at(time)
    hidden = occlusion(facets, points, radar.position, target, scene.model.max_transmissions)
    return Visibility(target, hidden, _levels(result, facets, points, radar, target), led_by(result, target))


def check_target(scene: Scene | None, target: str) -> Scene:
    """Return the scene; ValueError where a body is none of its, or none that can be a target, or where it is None."""
    if scene is None:
        raise ValueError("the scene of this result cannot be read again")
    names = [b.name for b in scene.bodies]
    if not is_one_of(target, names):
        raise ValueError(f"no body {shown(target)}; there are {', '.join(names) or 'none'}")
    body = scene.bodies[names.index(target)]
    if is_background(body):
        raise ValueError(f"'{target}' is the ground or the radar's own vehicle, which is no target")
    return scene


def is_background(body: Body) -> bool:
    """Return whether a body is never a target (see run.simulate.background)."""
    return bool(body.resolved_role == MIRROR or body.name.startswith("ego"))


def led_by(result: Result, target: str) -> tuple[int, ...]:
    """Return the detections (rows) whose leading chain holds a body: direct before multipath, then strongest first."""
    rows = [i for i, why in enumerate(result.provenance) if why.contributions and _holds(why, target)]
    return tuple(sorted(rows, key=lambda i: (result.provenance[i].label != DIRECT, -result.detections.power[i])))


def _holds(why: Explanation, target: str) -> bool:
    # Parts are written 'body.part', and no body's name holds a dot; layers passed stand in brackets.
    return any(link.split(".")[0] == target for link in why.contributions[0].chain)


def _levels(result: Result, facets: Facets, points: Points, radar: Radar, target: str) -> dict[str, Level | None]:
    settings = result.require_scene().processing
    weakest = noise_of_beam(radar, settings) * float(undb(settings.min_snr_db))
    kind = ways_of(result, chains(result.paths, result.receiver.background), target)
    found: dict[str, Level | None] = {
        name: _level(take(result.paths, kind == i), radar, settings, weakest) for i, name in enumerate(WAYS)
    }
    if not (kind == WAYS.index(DIFFRACTED)).any():
        found[DIFFRACTED] = _diffracted(facets, points, radar, settings, weakest, target)
    return found


def ways_of(result: Result, known: Chains, target: str) -> np.ndarray[Any, np.dtype[np.int64]]:
    """Return the index in WAYS of the way by which each path (n,) met a body; -1 where it did not."""
    paths, size = result.paths, np.abs(result.paths.amplitude)
    kind = np.full(len(known.names), -1, np.int64)
    order = np.lexsort((-size, known.part))
    strongest = order[np.searchsorted(known.part[order], np.arange(len(known.names)))]
    for g, (row, bodies) in enumerate(zip(strongest, known.bodies, strict=True)):
        if target in bodies:
            way = (
                DIFFRACTED
                if (paths.trajectories.kind[paths.trajectory[row]] == DIFFRACT).any()
                else label_of(paths, row, bodies, result.receiver)
            )
            kind[g] = WAYS.index(way)
    return kind[known.part]


def _diffracted(
    facets: Facets, points: Points, radar: Radar, settings: Any, weakest: float, target: str
) -> Level | None:
    mine = points.body == facets.body_names.index(target)
    if not mine.any():
        return None
    row = {f: getattr(points, f)[mine] for f in ("position", "velocity", "body", "sigma", "heading")}
    paths = paths_over_wedges(Geometry(facets), replace(points, **row), radar, radar.waveform.carrier)
    return _level(paths, radar, settings, weakest)


def _level(paths: Paths, radar: Radar, settings: Any, weakest: float) -> Level:
    if not len(paths.delay):
        return _strength(0.0, None, weakest)
    cube = synthesize(paths, replace(radar, noise=False))
    pad = (max(_FINE, settings.pad[0]), max(_FINE, settings.pad[1]))
    rdmap = range_doppler(cube, radar.waveform, settings.range_window, settings.rate_window, pad)
    column = int(np.argmax(rdmap.power.max(axis=0)))
    return _strength(float(rdmap.power[:, column].max()), float(rdmap.range[column]), weakest)


def _strength(power: float, at: float | None, weakest: float) -> Level:
    return Level(power, float(db(power / weakest)) if weakest > 0.0 else None, at if power > 0.0 else None)
