"""Echoes nearer than 2 D^2 / wavelength: directions are those of spherical waves."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc
from raychan.processing.near_field import NearAperture, parts_of
from raychan.processing.spectra import Bartlett, climb
from raychan.radar.aperture import Aperture
from raychan.radar.array import mimo_array
from raychan.units import C0

WAVE = rc.Waveform(77e9, 150e6, 20e-6, 40e-6, 16, 128)
LAMBDA = C0 / WAVE.middle
WIDTH = 0.4


def sparse(count, seed):
    """Return elements (n, 3) [m] at random places of a line."""
    places = np.random.default_rng(seed).uniform(-0.5 * WIDTH, 0.5 * WIDTH, count)
    places[:2] = -0.5 * WIDTH, 0.5 * WIDTH
    return np.column_stack([np.zeros(count), np.sort(places), np.zeros(count)])


def run(elements, away, azimuths, levels, seed, **processing):
    """Return what is found of point targets [dBsm] so far away [m]."""
    size = {"length": 0.01, "width": 0.01, "height": 0.01}
    body = {"shape": "box", "params": size, "rcs_point": (0.0, 0.0, 0.0)}
    places = [(away * np.cos(x), away * np.sin(x), 0.0) for x in azimuths]
    bodies = [
        rc.Body(f"b{i}", rcs_dbsm=level, position=at, **body)
        for i, (at, level) in enumerate(zip(places, levels, strict=True))
    ]
    radar = rc.Radar(WAVE, elements=elements, position=(0.0, 0.0, 0.0), power=0.1 * (away / 20.0) ** 4)
    scene = rc.Scene(bodies, radar=radar, model={"max_bounces": 1}, processing=processing)
    return rc.simulate(scene, seed=seed)


@pytest.mark.parametrize("far", [0.05, 0.1, 0.2, 0.4])
@pytest.mark.parametrize("count", [6, 10, 16])
def test_a_lone_echo_before_a_sparse_line_is_where_it_is(count, far):
    azimuth = 0.3 - 0.05 * count + far
    found = run(sparse(count, count), far * 2.0 * WIDTH**2 / LAMBDA, [azimuth], [10.0], 1).detections
    assert len(found.azimuth) == 1
    assert np.sin(found.azimuth[0]) == pytest.approx(np.sin(azimuth), abs=0.5 * LAMBDA / WIDTH)
    assert not found.ambiguous[0]


@pytest.mark.parametrize("far", [0.15, 0.3, 0.6])
@pytest.mark.parametrize("seed", [2, 3])
def test_two_echoes_of_a_cell_are_found_or_told(seed, far):
    azimuths = [0.05 * seed, -0.3]
    found = run(sparse(12, seed), far * 2.0 * WIDTH**2 / LAMBDA, azimuths, [5.0, 2.0], seed).detections
    assert np.sin(np.sort(found.azimuth)) == pytest.approx(np.sin(np.sort(azimuths)), abs=0.5 * LAMBDA / WIDTH)


@pytest.mark.parametrize("method", ["capon", "music", "esprit"])
@pytest.mark.parametrize(
    ("count", "far", "below", "widths"), [(64, 0.35, 6.0, 26.0), (64, 0.5, 12.0, 26.0), (64, 1.8, 10.0, 26.0),
                                          (24, 2.06, 20.0, 1.5), (24, 4.0, 20.0, 1.5), (24, 4.0, 4.0, 0.8)]
)  # fmt: skip
def test_methods_of_plane_waves_find_what_a_near_echo_hides_from_them(method, count, far, below, widths):
    """What of the stronger wave is not plane hid the weaker one: spherical waves are tried beside. Farther off these
    methods tell echoes apart that beams do not."""
    line = rc.uniform_array(count, 0.5 * LAMBDA)
    cosines = np.array([-0.45, -0.45 + widths * 2.0 / count])
    away = far * 2.0 * float(np.ptp(line[:, 1])) ** 2 / LAMBDA
    found = run(line, away, np.arcsin(cosines), [20.0, 20.0 - below], 1, doa=method).detections
    order = np.argsort(found.azimuth)
    assert np.sin(found.azimuth[order]) == pytest.approx(cosines, abs=0.1 / count + 0.0002 * count)
    level = 10.0 * np.log10(found.power[order[0]] / found.power[order[1]])
    assert level == pytest.approx(below, abs=1.0)


@pytest.mark.parametrize("senders", [1, 3])
def test_waves_are_those_of_a_source_at_its_distance(senders):
    given = mimo_array(senders, 6, 0.05)
    sent, heard = given["tx_elements"], given["elements"]
    virtual = (sent[:, None] + heard[None]).reshape(-1, 3)
    near = NearAperture.of(Aperture(virtual, LAMBDA), parts_of(virtual, sent), 3.0)
    source = 3.0 * np.array([np.sqrt(1.0 - 0.3**2), 0.3, 0.0])
    away = (np.linalg.norm(source - sent, axis=1)[:, None] + np.linalg.norm(source - heard, axis=1)[None]).ravel()
    wave = np.exp(-2j * np.pi / LAMBDA * away)
    made = near.steering(np.array([[0.3, 0.0]]))[0]
    assert made / made[0] == pytest.approx(wave / wave[0], abs=1e-8)


def test_the_maximum_next_to_a_direction_is_that_of_the_slow_form():
    elements = sparse(8, 4)
    near = NearAperture.of(Aperture(elements, LAMBDA), parts_of(elements, None), 5.0)
    power = Bartlett(near.steering(np.array([[0.2, 0.0]])))
    start = np.array([[0.2015, 0.0], [-0.4, 0.0]])
    at, best = climb(power, near, start, near.grid(4))
    slow, expected = climb(lambda x: power(x), near, start, near.grid(4))
    assert at == pytest.approx(slow, abs=1e-9) and best == pytest.approx(expected)
    assert at[0, 0] == pytest.approx(0.2, abs=1e-5)
