"""Micro-Doppler: a frame of a turbine by few tracings, against tracing every chirp."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import raychan as rc
from bench.measure import Row, barred, paired, seconds
from raychan.radar.beam_table import beam_of
from raychan.run.micro_doppler import retraced
from raychan.run.solver import solve
from raychan.signal.baseband import synthesize
from raychan.tracing.settings import PruneRule, refinement

_CHIRPS = 256


def turbine(scenes: Path, repeats: int, quick: bool) -> Iterator[Row]:
    """Three blades of 5 m on a mast, 60 m away: tracing every chirp is timed on some of them, each costing alike."""
    some = 8 if quick else 32
    for rpm in (20.0, 200.0):
        scene = rotor(rpm)
        wave = scene.radar.waveform
        rule = refinement(wave.carrier, scene.model.tolerance_db, 0.0, scene.model.max_transmissions)
        at = np.linspace(0, _CHIRPS - 1, some).astype(int)
        few: list[Any] = []
        rows: list[Any] = []

        def ours(scene: rc.Scene = scene, rule: Any = rule, few: list[Any] = few) -> None:
            prune = PruneRule(scene.radar.position, beam_of(scene.radar), rule, scene.model.max_bounces)
            few.append(retraced(scene, prune, scene.model))

        def every(scene: rc.Scene = scene, rule: Any = rule, rows: list[Any] = rows, at: Any = at) -> None:
            rows[:] = [_chirp(scene, rule, int(m)) for m in at]

        ours()
        every()
        pairs = [(seconds(ours), seconds(every) * _CHIRPS / some) for _ in range(repeats)]
        truth = np.concatenate(rows, axis=1)
        size = (np.abs(truth) ** 2).sum()
        off = (np.abs(few[-1].samples[:, at] - truth) ** 2).sum() / size
        said = few[-1].level()
        row = paired(
            "turbine", f"{rpm:g} rpm, {_CHIRPS} chirps", pairs, "tracing every chirp", tracings=len(few[-1].times),
            chirps_of_truth_measured=some, true_error_db=round(10.0 * float(np.log10(off)), 1),
            stated_error_db=round(10.0 * float(np.log10(said)), 1),
        )  # fmt: skip
        yield barred(row, "<= 1/20", row.ratio <= 1.0 / 20.0 and off <= said)


def _chirp(scene: rc.Scene, rule: Any, chirp: int) -> Any:
    """Return the samples (antenna, 1, sample) of a chirp of the scene moved to it."""
    wave = scene.radar.waveform
    now = scene.at(chirp * wave.repetition)
    paths, _ = solve(now.facets(), now.points(), now.radar, wave.carrier, rule, scene.model.max_bounces)
    one = dataclasses.replace(now.radar, waveform=dataclasses.replace(wave, n_chirps=1), noise=False)
    return synthesize(paths, one).samples


def rotor(rpm: float) -> rc.Scene:
    """Return a small wind turbine: mast, nacelle and three pitched blades that turn about its nose."""
    import trimesh

    turned = trimesh.transformations.rotation_matrix
    blades = []
    for i in range(3):
        blade = trimesh.creation.box((0.05, 0.5, 4.5))
        blade.apply_transform(turned(np.radians(15.0), (0, 0, 1)))
        blade.apply_translation((0, 0, 2.75))
        blade.apply_transform(turned(2.0 * np.pi * i / 3.0, (1, 0, 0)))
        blades.append(blade)
    hub, yaw = (60.0, 0.0, 8.0), 140.0
    back = np.array([np.cos(np.radians(yaw)), np.sin(np.radians(yaw))])
    bodies = [
        rc.Body("blades", trimesh.util.concatenate(blades), position=hub, yaw_deg=yaw, spin_dps=(6.0 * rpm, 0, 0)),
        rc.Body("nacelle", shape="box", params={"length": 1.5, "width": 0.8, "height": 0.8},
                position=(hub[0] - 1.2 * back[0], hub[1] - 1.2 * back[1], 7.6), yaw_deg=yaw),
        rc.Body("mast", shape="cylinder", params={"radius": 0.25, "height": 7.5},
                position=(hub[0] - 1.2 * back[0], hub[1] - 1.2 * back[1], 0.0)),
    ]  # fmt: skip
    radar = {
        "position": [0.0, 0.0, 1.5],
        "noise": False,
        "antenna": {"kind": "isotropic"},
        "waveform": {"bandwidth_mhz": 300.0, "chirp_us": 30.0, "chirps": _CHIRPS, "samples": 256},
    }
    return rc.Scene(bodies=bodies, radar=radar, model={"max_bounces": 2})
