"""By reciprocity it is all one on which of several surfaces a wave scatters; where it is not, runs say by how much."""

from __future__ import annotations

import numpy as np
import pytest
from truth.corner import corner

import raychan as rc
from raychan.records import DIFFUSE, REFLECT, SCATTER, TRANSMIT
from raychan.run.explanation.turns import turns_of
from raychan.units import C0


def _off(names, kinds, waves, one_end=True):
    return turns_of(names, np.array(kinds, np.int8), one_end).off_db(np.array(waves, complex))


def test_waves_alike_from_both_surfaces_are_reciprocal_and_one_way_alone_tells_nothing():
    names, kinds = [("a", "b"), ("b", "a"), ("a",)], [[REFLECT, SCATTER], [REFLECT, SCATTER], [SCATTER, 0]]
    assert _off(names, kinds, [0.4j, 0.4j, 1.0]) == pytest.approx(0.0, abs=1e-6)
    # A wave and its reverse, both scattered by b.
    kinds[1] = [SCATTER, REFLECT]
    assert _off(names, kinds, [0.4j, 0.4j, 1.0]) == 0.0
    assert _off([], np.zeros((0, 2)), []) == 0.0


def test_what_one_turn_brings_more_than_the_other_is_off_the_sum():
    kinds = [[REFLECT, SCATTER], [REFLECT, SCATTER]]
    expected = 20.0 * np.log10(1.0 + abs(0.5 - 0.1j) / abs(0.5 + 0.1j))
    assert _off([("a", "b"), ("b", "a")], kinds, [0.5, 0.1j]) == pytest.approx(expected)
    # From one end to another a way has one direction.
    assert _off([("a", "b"), ("b", "a")], kinds, [0.5, 0.1j], one_end=False) == 0.0
    kinds[1] = [SCATTER, REFLECT]
    assert _off([("a", "b"), ("a", "b")], kinds, [0.5, 0.1j], one_end=False) == pytest.approx(expected)


def test_layers_on_the_way_make_no_other_way():
    names = [("(pane)", "a", "b"), ("b", "a")]
    kinds = [[TRANSMIT, REFLECT, SCATTER], [REFLECT, SCATTER, 0]]
    assert _off(names, kinds, [0.3, 0.3]) == pytest.approx(0.0, abs=1e-6)


def test_clutter_of_a_wall_is_no_other_turn_of_its_echo():
    assert _off([("wall",), ("wall",)], [[SCATTER], [DIFFUSE]], [1.0, 0.3j]) == 0.0


@pytest.mark.parametrize(("opening_deg", "turn_deg"), [(90.0, 10.0), (90.8, -19.2)])
def test_two_plates_are_off_by_what_geometrical_optics_differs_by_between_their_faces(opening_deg, turn_deg):
    size, gap, place = 0.8, 0.33, np.array([8.0, 0.28, 0.05])
    wave = rc.Waveform(carrier=10e9, bandwidth=100e6, chirp_duration=30e-6, n_chirps=8, n_samples=64)
    plates, faces = [], []
    for name, side in (("left", 1.0), ("right", -1.0)):
        angle = np.radians(180.0 + turn_deg + side * opening_deg / 2.0)
        along, up = np.array([np.cos(angle), np.sin(angle), 0.0]), np.array([0.0, 0.0, size / 2.0])
        middle, half = place + (gap + size / 2.0) * along, along * size / 2.0
        shape = {"shape": "plate", "params": {"width": size, "height": size}}
        plates.append(rc.Body(name, position=middle, yaw_deg=np.degrees(angle) - 90.0 * side, **shape))
        faces.append(np.array([-half - up, half - up, half + up, up - half]) + middle - place)
    radar = rc.Radar(wave, antenna=rc.IsotropicAntenna())
    found = rc.simulate(rc.Scene(bodies=plates, radar=radar, model={"max_bounces": 2, "tolerance_db": 0.25}))
    far = float(np.linalg.norm(place))
    ends, k = (-place / far, far), 2.0 * np.pi * wave.middle / C0
    one, other = (corner(faces, k, ends, orders=[order])[0, 0] for order in ((0, 1), (1, 0)))
    whole = corner(faces, k, ends, max_bounces=2)[0, 0]
    expected = 20.0 * np.log10(1.0 + abs(one - other) / abs(whole))
    why = found.provenance[0]
    assert len(why.contributions[0].chain) == 2
    assert why.reciprocity_db == pytest.approx(expected, abs=0.1)
    assert any("scatter, which reciprocity makes alike" in line for line in found.warnings) == (expected > 0.3)
