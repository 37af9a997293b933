"""Elements of an array at which a refinement follows levels: their sums are those of their samples, and a near plate's
beam is within its tolerance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.boxes_and_balls import scene_of

import raychan as rc
from raychan.run.explanation.point_spread import PointSpread
from raychan.run.receiver import map_of
from raychan.run.refinement.probes import probes_of
from raychan.run.refinement.sourced_paths import changes
from raychan.signal.baseband import synthesize
from raychan.tracing.sources import EXACT
from raychan.units import C0

WAVEFORM = rc.Waveform(carrier=77e9, bandwidth=500e6, chirp_duration=30e-6, n_chirps=32, n_samples=64)
HALF = 0.5 * C0 / WAVEFORM.middle
ARRAY = rc.uniform_array(8, HALF)


def test_a_single_element_has_no_probes():
    assert probes_of(rc.Radar(WAVEFORM, (0, 0, 1.0))) == ()


@pytest.mark.parametrize("tx", [((0, 0, 0),), ((0, 0, 0), (0, 8 * HALF, 0))])
def test_probes_are_the_ends_of_the_virtual_array(tx):
    more = {"tx_elements": np.array(tx, float), "multiplexing": "tdm"} if len(tx) > 1 else {}
    radar = rc.Radar(WAVEFORM, (0, 0, 1.0), elements=ARRAY, **more)
    width = [p.tx + p.rx for p in probes_of(radar)]
    assert np.ptp(width, axis=0) == pytest.approx([0.0, HALF * (8 * len(tx) - 1), 0.0], abs=1e-12)


def test_paths_seen_at_an_element_add_up_to_what_its_samples_hold():
    of = scene_of(2)
    paths, settings = rc.simulate(of).paths, of.processing
    radar = replace(of.radar, elements=ARRAY, noise=False)
    spread = PointSpread(radar.waveform, settings.range_window, settings.rate_window)
    for probe, row in zip(probes_of(radar), (0, -1), strict=True):
        one = replace(radar, elements=ARRAY[[row]])
        assert probe.rx == pytest.approx(one.elements_world[0])
        rdmap = map_of(synthesize(paths, one), one, settings)
        at = np.unravel_index(np.argsort(rdmap.power, axis=None)[-5:], rdmap.power.shape)
        cells = np.stack([rdmap.range[at[1]], rdmap.rate[at[0]], np.sqrt(rdmap.power[at])], axis=1)
        found = changes(spread, probe.seen(paths), np.full(len(paths.trajectories.kind), EXACT), cells).sum(axis=1)
        assert np.abs(found) ** 2 * one.power == pytest.approx(rdmap.power[at], rel=0.02)


def test_the_beam_towards_a_near_plate_is_known_to_its_tolerance():
    """One tube on a face at 2 m reaches eight elements from one place: at the phase centre nothing shows of that."""
    plate = rc.Body("plate", shape="plate", params={"width": 1.2, "height": 1.4}, position=(2.0, 0.2, 0.3), yaw_deg=174)
    radar = rc.Radar(WAVEFORM, (0, 0, 1.0), elements=ARRAY)
    of = rc.Scene(bodies=[plate], radar=radar, model={"tolerance_db": 0.3, "max_bounces": 1})
    found, finer = rc.simulate(of, seed=1), rc.simulate(of, seed=1, tolerance_db=0.05)
    assert len(found.detections.range) and (found.detections.error_db <= 0.3).all()
    at = tuple(found.detections.cell.T)
    off = np.abs(10.0 * np.log10(found.rdmap.power[at] / finer.rdmap.power[at]))
    assert (off <= found.detections.error_db + finer.detections.error_db.max()).all()
