"""Three echoes in one cell before a uniform line: the best two waves may lie nearer to each other than any of them."""

from __future__ import annotations

import numpy as np
import pytest

from raychan.processing.angles import echoes_in
from raychan.processing.scan import Scan
from raychan.radar.aperture import Aperture

LAMBDA = 3.9e-3
NOISE = 1e-5


def line(count):
    out = np.zeros((count, 3))
    out[:, 1] = 0.5 * LAMBDA * (np.arange(count) - 0.5 * (count - 1))
    return Scan(Aperture(out, LAMBDA), "bartlett", 3.0)


def held(scan, towards, levels, seed):
    """Return the echoes of a cell of waves from cosines along y, of levels in dB, and noise 50 dB below in a
    receiver."""
    rng, at = np.random.default_rng(seed), np.zeros((len(towards), 2))
    at[:, 0] = towards
    waves = 10.0 ** (0.05 * np.array(levels)) * np.exp(2j * np.pi * rng.uniform(size=len(towards)))
    count = len(scan.aperture.elements)
    noise = np.sqrt(0.5 * NOISE) * (rng.standard_normal((count, 2)) @ [1.0, 1.0j])
    return echoes_in(waves @ scan.aperture.steering(at) + noise, scan, 17.0 * NOISE / count, 1000.0)


def drawn(seed, count):
    """Return three cosines 1.05 to 2 beam widths apart, and levels [dB]."""
    rng = np.random.default_rng([seed, count])
    apart = 2.0 / count * rng.uniform(1.05, 2.0, 2)
    first = rng.uniform(-0.85, 0.85 - apart.sum())
    return first + np.array([0.0, apart[0], apart.sum()]), rng.permutation([0.0, *-rng.uniform(0.0, 16.0, 2)])


@pytest.mark.parametrize("count", [8, 12, 16])
def test_three_echoes_over_a_beam_width_apart_are_all_found(count):
    scan = line(count)
    for seed in range(150):
        towards, levels = drawn(seed, count)
        found = held(scan, towards, levels, seed)
        near = np.abs(found.direction[:, :1] - towards).min(axis=0)
        assert len(found.power) == 3, seed
        assert (near < 0.25 * 2.0 / count).all(), seed
        assert not found.unsure(scan.aperture).any()


def test_two_echoes_nearer_than_a_beam_width_stay_one_and_say_so_where_much_is_left():
    scan = line(8)
    said = 0
    for seed in range(40):
        found = held(scan, [0.1, 0.25], [0.0, -1.0], seed)
        assert len(found.power) <= 2
        much = not found.explained and found.rest > 0.1 * found.power.max()
        assert found.unsure(scan.aperture).any() or not much
        said += found.unsure(scan.aperture).any()
    assert said


def test_a_lone_echo_and_two_told_apart_are_sure():
    scan = line(8)
    for towards in ([0.3], [0.3, -0.2]):
        found = held(scan, towards, [0.0, -20.0][: len(towards)], 1)
        assert len(found.power) == len(towards)
        assert not found.unsure(scan.aperture).any()
