"""Kernels that climb to directions: each step is that of its slow form, whatever the array."""

from __future__ import annotations

import numpy as np
import pytest

from raychan.processing.climb_kernels import climb_beams, refine_beams, snapshots_for
from raychan.processing.doa import amplitudes
from raychan.processing.spectra import Bartlett, Beside, beams_of, climb, explained_beside
from raychan.radar.aperture import Aperture

LAMBDA = 3.9e-3
HALF = 0.5 * LAMBDA


def line(count, axis=1, depth=0.0):
    out = np.zeros((count, 3))
    out[:, axis] = HALF * np.arange(count)
    out[1::2, 0] = depth
    return out


def rows(spacing, askew=0.0, depth=0.0):
    row, column = np.indices((4, 5)).reshape(2, -1)
    return spacing * np.stack([depth * (row + column) % 3, column + askew * (row % 2), row], axis=1)


ARRAYS = {
    "line": line(8),
    "upright line": line(6, axis=2),
    "wide line": 3.0 * line(6),
    "plane": rows(HALF),
    "oblique": rows(HALF)[:10] @ [[1.0, 0.0, 0.0], [0.0, 0.8, 0.6], [0.0, -0.6, 0.8]],
    "askew": rows(2.0 * HALF, 0.5),
    "anywhere": np.random.default_rng(1).uniform(-3.0, 3.0, (9, 3)) * [0.0, HALF, HALF],
    "deep line": line(8, depth=9.0 * LAMBDA),
    "deep plane": rows(HALF, depth=20.0),
}


def made(name, count=40, snapshots=3):
    array, rng = Aperture(ARRAYS[name], LAMBDA), np.random.default_rng(5)
    data = rng.standard_normal((snapshots, len(array.elements), 2)).view(complex)[..., 0]
    size, turn = np.sqrt(rng.uniform(0.0, 1.0, count)), rng.uniform(0.0, 2.0 * np.pi, count)
    at = size[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    return array, data, at * array.scans


@pytest.mark.parametrize("name", ARRAYS)
def test_what_waves_explain_beside_sets_of_others_is_that_of_the_slow_form(name):
    array, data, at = made(name)
    sets = [np.linalg.qr(array.steering(at[i : i + 2]).T)[0].T for i in (0, 2, 4)]
    rests = [data - (data @ basis.conj().T) @ basis for basis in sets]
    slow = [Beside(rest, basis)(array.steering(at)) for rest, basis in zip(rests, sets, strict=True)]
    found = explained_beside(np.array(rests), np.array(sets), array, at).T
    assert found == pytest.approx(np.array(slow), abs=1e-9)


@pytest.mark.parametrize("others", [0, 2])
@pytest.mark.parametrize("name", ARRAYS)
def test_the_maximum_next_to_a_direction_is_that_of_the_slow_form(name, others):
    array, data, start = made(name)
    assert array.deep == name.startswith("deep")
    basis = np.linalg.qr(array.steering(start[:others]).T)[0].T
    grid = array.grid(4)
    power = Beside(data - (data @ basis.conj().T) @ basis, basis) if others else Bartlett(data)
    at, best = climb(power, array, start, grid)
    # What is a function only is climbed in plain numpy.
    slow, expected = climb(lambda steering: power(steering), array, start, grid)
    assert best == pytest.approx(power(array.steering(at)), rel=1e-9)
    # Where both sides of a start are as high to rounding, it may climb to either.
    same = np.isclose(best, expected, rtol=1e-9)
    assert same.mean() >= 0.9
    assert at[same] == pytest.approx(slow[same], abs=1e-5)


@pytest.mark.parametrize("name", ARRAYS)
def test_several_are_refined_by_turns_as_by_the_pseudo_inverse(name):
    array, noise, start = made(name, count=3)
    start = np.array([[-0.5, 0.2], [0.05, -0.1], [0.6, 0.3]]) * array.scans
    data = np.exp(1j * np.array([[0.3, 1.2, 2.0], [2.2, 0.4, 1.0]])) @ array.steering(start) + 0.1 * noise[:2]
    grid = array.grid(2)
    slow = start + 0.02 * np.array(array.scans)
    fast = slow.copy()
    for _ in range(4):
        for k in range(3):
            waves = amplitudes(data, array, slow)
            waves[:, k] = 0.0
            rest = Bartlett(data - waves @ array.steering(slow))
            slow[k] = climb(lambda steering, rest=rest: rest(steering), array, slow[k : k + 1], grid)[0][0]
    refine_beams(fast, snapshots_for(data), beams_of(array, grid), 4, np.zeros(2))
    assert fast == pytest.approx(slow, abs=1e-6)


def test_turns_end_where_none_moves():
    array, data, start = made("line", count=2)
    beams = beams_of(array, array.grid(2))
    some, all_ = start.copy(), start.copy()
    refine_beams(some, snapshots_for(data), beams, 20, np.full(2, 10.0))
    refine_beams(all_, snapshots_for(data), beams, 1, np.zeros(2))
    assert (some == all_).all()


def test_no_start_has_no_maximum():
    array, data, _ = made("line")
    best = np.empty(0)
    climb_beams(np.zeros((0, 2)), best, snapshots_for(data), snapshots_for(data[:0]), beams_of(array, array.grid(2)))
    assert not len(best)
