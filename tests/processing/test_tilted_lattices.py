"""Lattices in a tilted plane: all directions ahead that look alike count, a grating lobe away or on the other side."""

from __future__ import annotations

import numpy as np
import pytest
from support.arrays import noise

import raychan as rc
from raychan.processing.doa import by_turns
from raychan.processing.tilted import plane_of
from raychan.processing.twins import ambiguous
from raychan.radar.aperture import Aperture

SEEDS = range(60)


def tilted(seed: int, pitch: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a rectangle (a, 3) [wavelengths] tilted by up to 57 deg twice, its normal and axes (3, 3), and a
    direction (3,) ahead."""
    rng = np.random.default_rng(seed)
    yaw, lift = rng.uniform(-1.0, 1.0, 2)
    (cy, cl), (sy, sl) = np.cos([yaw, lift]), np.sin([yaw, lift])
    axes = np.array([[cy * cl, sy * cl, -sl], [-sy, cy, 0.0], [cy * sl, sy * sl, cl]])
    places = np.indices((rng.integers(3, 7), rng.integers(2, 6))).reshape(2, -1).T * pitch
    az, el = rng.uniform(-1.2, 1.2), rng.uniform(-0.6, 0.6)
    look = np.array([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)])
    return places @ axes[1:], axes, look


def alike(axes: np.ndarray, look: np.ndarray, pitch: float) -> np.ndarray:
    """Return all directions (n, 3) ahead that look quite like one (3,), this first."""
    off = (np.indices((9, 9)).reshape(2, -1).T - 4) / pitch
    along = axes[1:] @ look + off[np.argsort((off**2).sum(axis=1), kind="stable")]
    along = along[(along**2).sum(axis=1) <= 1.0]
    up = np.sqrt(1.0 - (along**2).sum(axis=1))[:, None] * axes[0]
    found = np.concatenate([along @ axes[1:] + up, along @ axes[1:] - up])
    return found[found[:, 0] > 0.0]


@pytest.mark.parametrize("method", ["bartlett", "music"])
@pytest.mark.parametrize("pitch", [0.6, 1.0])
def test_of_all_directions_alike_the_one_nearest_boresight_is_given_as_ambiguous(pitch, method):
    for seed in SEEDS:
        elements, axes, look = tilted(seed, pitch)
        twins = alike(axes, look, pitch)
        near = twins[twins[:, 0].argmax()]
        if abs(near @ axes[0]) < 0.2:  # along the plane beams are wide
            continue
        found = rc.doa(np.exp(2j * np.pi * elements @ look), elements, 1.0, method, sources=1)
        az, el = found.azimuth[0], found.elevation[0]
        given = np.array([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)])
        np.testing.assert_allclose(given, near, atol=0.02)
        far = np.linalg.norm(twins - near, axis=1).max()
        assert far < 0.5 or found.ambiguous.all()


def test_what_noise_leaves_of_a_twin_is_one_nevertheless():
    for seed in SEEDS:
        elements, axes, look = tilted(seed, 1.0)
        aperture, rng = Aperture(elements, 1.0), np.random.default_rng(seed)
        found = by_turns(np.exp(2j * np.pi * elements @ look)[None] + noise(rng, 1, len(elements)) * 0.01, aperture, 1)
        assert len(alike(axes, look, 1.0)) < 2 or ambiguous(aperture, found, np.array([len(elements) * 1e4])).all()


def test_where_all_that_looks_alike_lies_behind_nothing_is_ambiguous():
    for seed in SEEDS:
        elements, axes, look = tilted(seed, 0.45)
        along = alike(axes, look, 0.45)
        behind = look - 2.0 * (look @ axes[0]) * axes[0]
        if len(along) == 1 and abs(look @ axes[0]) > 0.3 and min(-behind[0], look[0]) > 0.3:
            assert not ambiguous(Aperture(elements, 1.0), look[None, 1:], np.array([1e5])).any()


def test_the_own_direction_is_among_those_alike_and_images_of_images_are_the_directions():
    rng = np.random.default_rng(0)
    elements, *_ = tilted(1, 0.5)
    plane = plane_of(Aperture(elements, 1.0))
    assert plane.exact
    some = 0.5 * rng.uniform(-1.0, 1.0, (20, 2))
    twin, _ = plane.alike(some, np.zeros((1, 2)))
    ahead = np.column_stack([np.sqrt(1.0 - (some**2).sum(axis=1)), some])
    assert np.linalg.norm(twin[:, 0] - ahead[:, None], axis=-1).min(axis=1).max() < 1e-9
    image, front = plane.mirrored(some)
    np.testing.assert_allclose(plane.mirrored(image[front])[0], some[front], atol=1e-9)


def test_an_echo_in_the_plane_of_the_array_may_be_on_either_side_of_it():
    """Beams along the plane are wide across it: noise leaves open by how much an echo is off it, and on which side."""
    found = 0
    for seed in range(200):
        elements, axes, look = tilted(seed, 0.5)
        twins = alike(axes, look, 0.5)
        if not (len(twins) == 2 and 0.02 < abs(look @ axes[0]) < 0.15):
            continue
        aperture, rng, size = Aperture(elements, 1.0), np.random.default_rng(seed), len(elements)
        wave = np.exp(2j * np.pi * elements @ look)[None] + noise(rng, 1, size) * np.sqrt(size * 10.0**-3.7)
        at, found = by_turns(wave, aperture, 1), found + 1
        assert ambiguous(aperture, at, np.array([10.0**3.7])).all()
    assert found > 5
