"""Measures of a scene's inputs: antennas, link budget, waveform, materials, places of bodies."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from raychan.radar.pattern import Characteristics, characteristics
from raychan.study.validation.bench import Bench
from raychan.study.validation.measures import Seen, measure
from raychan.world.errors import SceneError, nearest
from raychan.world.material import material
from raychan.world.scene_files.radar_mount import antenna_of


@cache
def _figures_of(name: str, scenes: Path) -> Characteristics:
    """Return the figures of merit of an antenna file beside the scenes, from its pattern; SceneError without one."""
    return characteristics(antenna_of(f"antennas/{name}.toml", "V", scenes, "antenna"))


def _figure(record: Any, name: str) -> float:
    """Return a number of a record by its name; SceneError if it has none of that name."""
    value = record.get(name) if isinstance(record, dict) else getattr(record, name, None)
    if not isinstance(value, int | float):
        known = record if isinstance(record, dict) else [n for n in dir(record) if not n.startswith("_")]
        raise SceneError(f"no figure '{name}'", key="measure", value=name, allowed=nearest(name, known))
    return float(value)


@measure
def antenna(bench: Bench, name: str, figure: str) -> Seen:
    """Return a figure of merit of an antenna [dBi, deg, dB]; None for a side lobe that its pattern does not have."""
    value = _figure(_figures_of(name, bench.study.scenes), figure)
    return None if np.isnan(value) else round(value, 6) + 0.0  # rounding: a grating lobe is as high as the main beam


@measure
def budget(bench: Bench, run: str, figure: str, sensitivity_dbm: float | None = None) -> Seen:
    """Return a line of the link budget."""
    return _figure(bench.scene(run).radar.link_budget(sensitivity_dbm), figure)


@measure
def waveform(bench: Bench, run: str, figure: str, scale: float = 1.0) -> Seen:
    """Return a figure of the waveform times `scale`."""
    return scale * _figure(bench.scene(run).radar.waveform, figure)


@measure
def samples(bench: Bench, run: str) -> Seen:
    """Return the samples of a chirp, from rate and duration."""
    wave = bench.scene(run).radar.waveform
    return float(wave.sample_rate * wave.chirp_duration)


@measure
def model(bench: Bench, run: str, figure: str) -> Seen:
    """Return a setting of the model."""
    return _figure(bench.scene(run).model, figure)


@measure
def processing(bench: Bench, run: str, figure: str) -> Seen:
    """Return a setting of the receiver."""
    return _figure(bench.scene(run).processing, figure)


@measure
def rays(bench: Bench, run: str) -> Seen:
    """Return the rays cast in a run."""
    return int(bench.run(run).stats["rays"])


@measure
def height(bench: Bench, run: str) -> Seen:
    """Return the radar's height [m]."""
    return float(bench.scene(run).radar.position[2])


@measure
def placed(bench: Bench, target: str) -> Seen:
    """Return the distance [m] of a target's place from the radar."""
    return bench.place(target)[1]


@measure
def ground_speed(bench: Bench, target: str) -> Seen:
    """Return the speed [m/s] over ground that the scene gives a target, positive away from the radar."""
    given = bench.target(target)
    scene = bench.scene_file(given.scene)
    at, distance = bench.place(target)
    facets = scene.facets(0.0)
    velocity = facets.velocity[facets.body_names.index(given.parts[0].split(".")[0])]
    return float(velocity @ (at - np.asarray(scene.radar.position)) / distance)


@measure
def material_of(bench: Bench, run: str, name: str, figure: str) -> Seen:
    """Return a figure of a material at the run's frequency [-, S/m]."""
    scene = bench.scene(run)
    return _figure(scene.materials.get(name) or material(name, scene.frequency), figure)
