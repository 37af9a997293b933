"""The error that a map states against a far finer launch: in scenes, cell by cell, as `test_rcs.py` does for bodies."""

from dataclasses import replace

import numpy as np
import pytest
from support.places import SCENES

import raychan as rc
from raychan.channel.error import stated_error
from raychan.run.clock import Clock
from raychan.run.receiver import noise_equivalent_amplitude, noise_of_cell, quiet_map
from raychan.run.simulate import channel_of, result_of
from raychan.run.solver import solve
from raychan.signal.baseband import synthesize
from raychan.tracing.settings import refinement
from raychan.units import C0


@pytest.mark.parametrize("name", ["living_street", "urban"])
def test_a_maps_stated_error_covers_the_true_one_in_most_cells(name):
    scene = rc.Scene.load(SCENES / f"{name}.toml")
    radar, settings, wave = scene.radar, scene.processing, scene.radar.waveform
    channel = channel_of(scene, 1.0, 2, Clock())
    fine = refinement(
        wave.carrier,
        0.25,
        noise_equivalent_amplitude(radar, settings),
        scene.model.max_transmissions,
        0.07,
        C0 / wave.bandwidth,
    )
    truth, _ = solve(channel.geometry, channel.points, radar, wave.carrier, fine, 2)
    silent = replace(radar, noise=False)
    found, true = (quiet_map(synthesize(p, silent).samples, radar, settings) for p in (channel.launched.paths, truth))
    difference = result_of(scene, channel, 0, Clock()).error.power
    rows = found > 20.0 * noise_of_cell(radar, settings)
    stated = np.array([stated_error(complex(a), b) for a, b in np.sqrt(np.stack([found, difference])[:, rows]).T])
    off = np.abs(10.0 * np.log10(found[rows] / true[rows]))
    assert rows.sum() > 100
    assert np.mean(off <= stated) > 0.9
    assert np.median(off) < 0.3
