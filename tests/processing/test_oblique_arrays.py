"""Arrays that are longer one way than the other and lie obliquely in y and z: beams are oblique ridges."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc
from raychan.processing.spectra import steps_of
from raychan.radar.aperture import Aperture

LAMBDA = 3.9e-3
SNR = 1e4  # of one element
PLACES = [[-0.677, -0.18], [-0.357, 0.055], [0.323, 0.287], [0.491, 0.558], [0.029, 0.116], [0.763, 0.722]]
TOWARDS = [(0.287, -0.03), (-0.1, 0.2), (0.4, 0.15)]


def rolled(rows, columns, turn=0.25 * np.pi):
    up, over = np.indices((rows, columns)).reshape(2, -1) * 0.5 * LAMBDA
    c, s = np.cos(turn), np.sin(turn)
    return np.stack([np.zeros(up.size), c * over - s * up, s * over + c * up], axis=1)


ARRAYS = {
    "2 x 8": rolled(2, 8),
    "2 x 16": rolled(2, 16),
    "3 x 12": rolled(3, 12),
    "by 30 deg": rolled(2, 8, np.pi / 6.0),
    "six places": LAMBDA * np.array([[0.0, *x] for x in PLACES]),
}


@pytest.mark.parametrize("method", ["bartlett", "capon", "music"])
@pytest.mark.parametrize("name", ARRAYS)
def test_the_direction_of_one_wave_is_off_by_what_noise_asks_for(name, method):
    places, rng, off = ARRAYS[name] / LAMBDA, np.random.default_rng(3), []
    across = places[:, 1:] - places[:, 1:].mean(axis=0)
    bound = 2.0 * SNR * (2.0 * np.pi) ** 2 * across.T @ across  # Fisher's information of the two cosines
    for u, w in TOWARDS * 20:
        wave = np.exp(2j * np.pi * places[:, 1:] @ [u, w])
        noise = rng.standard_normal((len(places), 2)) @ [1.0, 1.0j] / np.sqrt(2.0 * SNR)
        found = rc.doa(wave + noise, ARRAYS[name], LAMBDA, method=method, sources=1, smoothing=None)
        elevation = found.elevation[0]
        by = np.array([np.cos(elevation) * np.sin(found.azimuth[0]) - u, np.sin(elevation) - w])
        off.append(by @ bound @ by / 2.0)
    # Of 120 normal numbers.
    assert np.sqrt(np.mean(off)) == pytest.approx(1.0, abs=0.2)


def test_a_search_of_one_ridge_finds_it_once():
    array = ARRAYS["six places"]
    rng = np.random.default_rng(4)
    for u, w in TOWARDS:
        waves = np.exp(2j * np.pi / LAMBDA * array[:, 1:] @ np.array([[u, -0.5], [w, 0.1]]))
        data = (waves @ (rng.standard_normal((2, 50, 2)) @ [1.0, 1.0j])).T
        found = rc.doa(data + 1e-3 * rng.standard_normal(data.shape), array, LAMBDA, "music", sources=2)
        assert sorted(np.sin(found.elevation)) == pytest.approx(sorted([w, 0.1]), abs=2e-3)


def test_a_level_rectangle_and_a_deep_array_are_searched_along_y_and_z():
    level = Aperture(rolled(2, 8, 0.0), LAMBDA)
    deep = Aperture(rolled(2, 8) + np.arange(16)[:, None] * [LAMBDA, 0.0, 0.0], LAMBDA)
    assert level.table is not None
    assert deep.deep
    for array in (level, deep):
        grid = array.grid(4)
        assert (steps_of(array, grid) == np.diag(grid.step)).all()
