"""A flat array that is tilted cannot tell a direction from its mirror image about its plane: where both are ahead, the
one nearest boresight is given, as ambiguous."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc
from raychan.processing.twins import ambiguous
from raychan.radar.aperture import Aperture

LAMBDA = 3.9e-3


def turned(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Return the matrix (3, 3) that turns about x, then y, then z by angles [rad]."""
    (a, b, c), (p, q, r) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    about = [[1, 0, 0], [0, a, -p], [0, p, a]], [[b, 0, q], [0, 1, 0], [-q, 0, b]], [[c, -r, 0], [r, c, 0], [0, 0, 1]]
    return np.array(about[2]) @ np.array(about[1]) @ np.array(about[0])


def tilted(rng) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a rectangle (a, 3) tilted at random, and two directions (3,) ahead, images about its plane, over 30 deg
    apart, first the one nearest boresight."""
    rows, columns = rng.integers(3, 9, 2)
    y, z = np.indices((rows, columns)).reshape(2, -1) * rng.uniform(0.4, 0.6, (2, 1)) * LAMBDA
    while True:
        turn = turned(rng.uniform(-np.pi, np.pi), *rng.uniform(-0.9, 0.9, 2))
        look = rng.standard_normal(3)
        look /= np.linalg.norm(look)
        image = look - 2.0 * (look @ turn[:, 0]) * turn[:, 0]
        if min(look[0], image[0]) > 0.4 and look @ image < np.cos(np.radians(30.0)):
            pair = (look, image) if look[0] > image[0] else (image, look)
            return np.stack([0.0 * y, y, z], axis=1) @ turn.T, *pair


def towards(found) -> np.ndarray:
    """Return the directions (n, 3) found."""
    az, el = found.azimuth, np.nan_to_num(found.elevation)
    return np.stack([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)], axis=1)


def heard(elements, look, rng, noise=0.03) -> np.ndarray:
    """Return what elements hear of a wave from a direction (3,)."""
    return np.exp(2j * np.pi / LAMBDA * elements @ look) + noise * rng.standard_normal((len(elements), 2)) @ [1.0, 1j]


@pytest.mark.parametrize("method", ["bartlett", "capon", "music"])
@pytest.mark.parametrize("which", [0, 1])
def test_of_a_direction_and_its_image_the_one_nearest_boresight_is_given_as_ambiguous(which, method):
    for seed in range(20):
        rng = np.random.default_rng(seed)
        elements, *pair = tilted(rng)
        found = rc.doa(heard(elements, pair[which], rng), elements, LAMBDA, method, sources=1)
        assert found.ambiguous.all()
        assert np.degrees(np.arccos(np.clip(towards(found) @ pair[0], -1.0, 1.0))) < 8.0


def test_an_image_is_no_second_wave():
    rng = np.random.default_rng(3)
    elements, one, _ = tilted(rng)
    other = turned(0.0, 0.0, 0.5) @ one
    data = np.array([heard(elements, one, rng) * rng.standard_normal() for _ in range(40)])
    data += np.array([heard(elements, other, rng) * rng.standard_normal() for _ in range(40)])
    found = rc.doa(data, elements, LAMBDA, "music", sources=2)
    phases = [np.exp(2j * np.pi / LAMBDA * elements @ x) / np.sqrt(len(elements)) for x in (one, other)]
    seen = np.exp(2j * np.pi / LAMBDA * towards(found) @ elements.T) / np.sqrt(len(elements))
    assert (np.abs(seen.conj() @ np.array(phases).T) ** 2).max(axis=0).min() > 0.95


def test_all_images_of_arrays_in_a_tilted_plane_are_told_at_any_snr():
    """Rectangles of 3 x 3 to 8 x 8 elements, whose beams are narrower one way than the other."""
    for seed in range(100):
        elements, one, other = tilted(np.random.default_rng(100 + seed))
        assert ambiguous(Aperture(elements, LAMBDA), np.array([one[1:], other[1:]])).all()


@pytest.mark.parametrize("azimuth", [5.0, 85.0])
def test_a_line_of_depth_gives_of_both_sides_of_it_that_nearest_boresight(azimuth):
    elements = np.outer(np.arange(12) * 0.5 * LAMBDA, np.sqrt([0.5, 0.5, 0.0]))
    look = np.array([np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth)), 0.0])
    found = rc.doa(heard(elements, look, np.random.default_rng(0)), elements, LAMBDA, sources=1)
    assert np.degrees(found.azimuth) == pytest.approx([5.0], abs=1.0) and found.ambiguous.all()


def test_an_array_off_its_plane_by_what_the_noise_tells_keeps_its_direction():
    rng = np.random.default_rng(8)
    elements, near, far = tilted(rng)
    elements = elements + rng.uniform(-0.2, 0.2, elements.shape) * LAMBDA
    for look in (near, far):
        found = rc.doa(heard(elements, look, rng, 1e-3), elements, LAMBDA, sources=1)
        assert (towards(found) @ look > np.cos(np.radians(3.0))).all() and not found.ambiguous.any()
