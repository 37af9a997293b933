"""Provenance against a second, slow receiver and against cases solved by hand."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from support.results import WAVE, paths, receiver, result

from raychan.channel.error import stated_error
from raychan.columns import take
from raychan.processing.range_doppler import range_doppler
from raychan.radar.antenna import IsotropicAntenna
from raychan.radar.radar import Radar
from raychan.records import REFLECT, SCATTER, TRANSMIT
from raychan.run.explain import explain
from raychan.run.explanation.labels import chains, explain_cell, response_of
from raychan.signal.baseband import synthesize

GROUND, SUV, TRUCK, WALKER = range(4)
DIRECT_SUV = [(SUV, SCATTER)]
BY_GROUND = [(GROUND, REFLECT), (SUV, SCATTER)]
GHOST = [(TRUCK, REFLECT), (WALKER, SCATTER), (TRUCK, REFLECT)]


def cell(p, r, v, power=1.0, name="hann"):
    rx = receiver(name)
    return explain_cell(p, chains(p, rx.background), response_of(rx), rx, r, v, power)


@pytest.mark.parametrize("name", ["rect", "hann"])
@pytest.mark.parametrize("speed", [0.0, 20.0, -60.0], ids=["at rest", "fast", "folded"])
@pytest.mark.parametrize("bandwidth", [0.5e9, 4e9])
@pytest.mark.parametrize(("iq", "share"), [(True, 0.4), (False, 0.4), (False, 1.55)], ids=["I/Q", "real", "mirrored"])
def test_prediction_is_the_map_itself(name, speed, bandwidth, iq, share):
    rng = np.random.default_rng(1)
    wave = dataclasses.replace(WAVE, bandwidth=bandwidth, complex_sampling=iq)
    middle = share * wave.unambiguous_range
    r = middle + rng.uniform(-2, 2, 8) * wave.range_resolution
    v = speed + rng.uniform(-2, 2, 8) * wave.rate_resolution
    p = paths(r, v, rng.normal(size=8) + 1j * rng.normal(size=8), [DIRECT_SUV] * 8)
    radar = Radar(wave, np.zeros(3), antenna=IsotropicAntenna(), power=1.0, noise=False)
    rdmap = range_doppler(synthesize(p, radar), wave, name, name)
    rx = dataclasses.replace(receiver(name), waveform=wave)
    order = np.argsort(rdmap.power, axis=None)[::-1]
    known, response = chains(p, rx.background), response_of(rx)
    for place in order[:400:20]:
        i, j = np.unravel_index(place, rdmap.power.shape)
        cell_range, rate, power = float(rdmap.range[j]), float(rdmap.rate[i]), float(rdmap.power[i, j])
        got = explain_cell(p, known, response, rx, cell_range, rate, power).predicted
        assert np.sqrt(got) == pytest.approx(np.sqrt(power), abs=0.02 * np.sqrt(rdmap.power.max()))


@pytest.mark.parametrize("name", ["rect", "hann"])
@pytest.mark.parametrize("speed", [0.0, 40.0])
def test_cells_explained_together_are_what_each_is_alone_though_far_paths_are_left_out(name, speed):
    rng = np.random.default_rng(2)
    n, every = 300, [DIRECT_SUV, BY_GROUND, BY_GROUND[::-1], GHOST]
    size = 10.0 ** rng.uniform(-4, 0, n)
    p = paths(
        rng.uniform(2, 17, n), speed + rng.uniform(-10, 10, n), size * np.exp(1j * rng.uniform(0, 6.3, n)), every * 75
    )
    rx = receiver(name)
    known, response = chains(p, rx.background), response_of(rx)
    strong = np.argsort(-size)[:12]
    cells = np.stack([p.range[strong], p.range_rate[strong], size[strong]], axis=1)
    total, sizes, strongest = response.in_cells(known.part, 4, p.amplitude, p.delay, p.range_rate, cells)
    for i, (r, v, wave) in enumerate(cells):
        alone, at = response.in_cell(p.amplitude, p.delay, p.range_rate, r, v)
        for g in range(4):
            mine = known.part == g
            assert abs(total[i, g] - alone[mine].sum()) < 1e-3 * wave
            assert sizes[i, 0, g] == mine.sum()
            assert sizes[i, 2, g] == pytest.approx((np.abs(alone) ** 2 * at)[mine].sum(), abs=1e-3 * wave**2 * at.max())
        lead = known.part[int(np.argmax(np.abs(alone)))]
        assert strongest[i, lead] == np.argmax(np.abs(alone))


def test_a_lone_path_gives_its_own_power_at_its_own_cell():
    r0 = 9.0
    p = paths([r0], [0.0], [3e-6j], [DIRECT_SUV])
    why = cell(p, r0, 0.0, power=9e-12)
    assert why.predicted == pytest.approx(9e-12)
    assert (why.label, why.bodies) == ("direct", "suv.tail")
    assert why.contributions[0].text() == "radar > suv.tail > radar, 1 interaction, 9.00 m, 100 %"


def test_chains_share_as_powers_and_paths_of_a_chain_add_as_waves():
    p = paths([9, 9, 9], [0, 0, 0], [1, 1, 4], [GHOST, GHOST, DIRECT_SUV])
    why = cell(p, 9.0, 0.0)
    assert [c.share for c in why.contributions] == pytest.approx([16 / 20, 4 / 20])
    assert why.contributions[1].paths == 2


def test_paths_that_cancel_leave_no_share():
    p = paths([9, 9, 9], [0, 0, 0], [5, -5, 1], [GHOST, GHOST, DIRECT_SUV])
    assert [c.chain for c in cell(p, 9.0, 0.0).contributions] == [("suv.tail",)]


def test_a_ghost_over_two_bodies_is_multipath_and_told_in_words():
    p = paths([9.0], [0.0], [1.0], [GHOST])
    why = cell(p, 9.0, 0.0)
    assert why.label == "multipath"
    assert why.contributions[0].text() == (
        "radar > truck.tail > walker > truck.tail > radar, 3 interactions, 9.00 m, 100 %"
    )


@pytest.mark.parametrize(
    ("chain", "label", "interactions"),
    [
        ([(GROUND, SCATTER)], "clutter", 1),
        ([(GROUND, REFLECT), (SUV, SCATTER)], "direct", 2),
        ([(SUV, REFLECT), (SUV, SCATTER)], "direct", 2),
        ([(TRUCK, TRANSMIT), (WALKER, SCATTER), (TRUCK, TRANSMIT)], "direct", 1),
    ],
    ids=["ground alone", "by the ground", "corner of one body", "through glass"],
)
def test_labels(chain, label, interactions):
    why = cell(paths([9.0], [0.0], [1.0], [chain]), 9.0, 0.0)
    assert (why.label, why.contributions[0].interactions) == (label, interactions)


def test_a_long_way_over_the_ground_is_a_ghost_and_a_short_one_adds_to_the_target():
    p = paths([9.0, 9.0, 9.0], [0, 0, 0], [2.0, 1.5, 1.5], [DIRECT_SUV, BY_GROUND, BY_GROUND[::-1]])
    assert (cell(p, 9.0, 0.0).label, cell(p, 9.0, 0.0).bodies) == ("direct", "suv.tail")
    # The target stands a metre before where its echo seems to be.
    near = p.trajectories.vertices - np.float32([1.0, 0.0, 0.0])
    ghost = take(p.replace(trajectories=p.trajectories.replace(vertices=near)), [1, 2])
    assert cell(ghost, 9.0, 0.0).label == "multipath"


def test_a_cell_that_no_path_explains_is_noise():
    p = paths([5.0], [0.0], [1.0], [DIRECT_SUV])
    why = cell(p, 12.0, 3.0, power=1e-3)
    assert (why.label, why.bodies, why.contributions) == ("clutter", "noise", ())
    none = paths([], [], [], [])
    assert cell(none, 12.0, 3.0, power=1e-3).bodies == "noise"


def test_error_is_what_two_launches_differ_by_in_the_cell():
    at = 60 * WAVE.range_resolution
    p = paths([at, at], [0.0, 0.0], [1e-5, 1e-5], [DIRECT_SUV] * 2)
    r = result(p, [(at, 0.0, 1e-10)])
    differ = np.sqrt(r.error.power[tuple(r.detections.cell[0])])
    assert explain(r, at).error_db == pytest.approx(stated_error(2e-5, differ), rel=1e-3)


def test_explain_finds_the_cell_of_a_result_by_range_and_speed():
    p = paths([9.0, 9.0], [-7.0, 0.0], [1e-5, 2e-5], [DIRECT_SUV, GHOST])
    r = result(p, [(9.0, -7.0, 1e-10), (9.0, 0.0, 4e-10)])
    assert explain(r, 9.0, speed=0.0).bodies == "suv.tail"
    assert explain(r, 9.0).label == "multipath"
    with pytest.raises(ValueError, match=r"outside the map, 0\.0 to 19\.0 m"):
        explain(r, 99.0)
    with pytest.raises(ValueError, match="range rate"):
        explain(r, 9.0, speed=400.0)
