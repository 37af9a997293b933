"""Waves on arrays of irregular form: directions are those that explain most of what is received."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from support.arrays import noise
from support.echoes import SMALL, echoes, make_radar

from raychan.processing import joint_search
from raychan.processing.angles import echoes_in
from raychan.processing.detection import detect
from raychan.processing.doa import by_turns
from raychan.processing.joint_search import explained
from raychan.processing.range_doppler import range_doppler
from raychan.processing.scan import Scan
from raychan.radar.aperture import Aperture
from raychan.signal.baseband import synthesize
from raychan.units import C0


def circle(count: int) -> np.ndarray:
    """Return elements (count, 3) on an upright circle, 0.45 wavelengths of 1 m apart."""
    turn = 2.0 * np.pi * np.arange(count) / count
    return 0.45 * count / (2.0 * np.pi) * np.stack([0.0 * turn, np.cos(turn), np.sin(turn)], axis=1)


def sparse(rng: np.random.Generator, count: int) -> np.ndarray:
    """Return elements (count, 3) at some of 20 places half a wavelength of 1 m apart."""
    return np.outer(0.5 * np.sort(rng.choice(20, count, replace=False)), [0.0, 1.0, 0.0])


def unlike(rng: np.random.Generator, aperture: Aperture, count: int) -> np.ndarray:
    """Return cosines (count, 2) whose waves correlate below 0.3."""
    while True:
        at = rng.uniform(-0.65, 0.65, (count, 2)) * aperture.scans
        waves = aperture.steering(at)
        if np.abs(np.triu(waves @ waves.conj().T, 1)).max() < 0.3 * len(aperture.elements):
            return at


def received(rng: np.random.Generator, aperture: Aperture, at: np.ndarray) -> np.ndarray:
    """Return a snapshot (1, a) of waves of 33 dB from cosines (k, 2)."""
    phase = np.exp(2j * np.pi * rng.random((1, len(at))))
    return phase @ aperture.steering(at) + np.sqrt(5e-4) * noise(rng, 1, len(aperture.elements))


@pytest.mark.parametrize("count", [6, 8])
def test_no_pair_of_beams_explains_more_than_the_two_waves_that_are_told(count):
    rng, axis = np.random.default_rng(count), np.linspace(-1.0, 1.0, 81)
    beams = np.stack([axis, 0.0 * axis], axis=1)
    for _ in range(4):
        aperture = Aperture(sparse(rng, count), 1.0)
        true = unlike(rng, aperture, 2)
        data = received(rng, aperture, true)
        found = by_turns(data, aperture, 2)
        most = explained(data, aperture, found)
        assert most >= explained(data, aperture, true)
        pairs = np.array(list(combinations(aperture.steering(beams), 2)))
        fitted = np.einsum("pka,a->pk", np.linalg.pinv(pairs.transpose(0, 2, 1)), data[0])
        left = (np.abs(data - np.einsum("pk,pka->pa", fitted, pairs)) ** 2).sum(axis=1)
        assert most >= (np.abs(data) ** 2).sum() - left.min()


@pytest.mark.parametrize(("kind", "waves"), [("sparse", 2), ("sparse", 3), ("circle", 3)])
def test_what_is_told_of_like_waves_explains_as_much_as_the_truth_and_is_it(kind, waves):
    rng = np.random.default_rng(waves)
    for _ in range(8 // waves if kind == "sparse" else 2):
        elements = circle(16) if kind == "circle" else sparse(rng, 4 * waves - 2)
        aperture = Aperture(elements, 1.0)
        true = unlike(rng, aperture, waves)
        found = by_turns(received(rng, aperture, true), aperture, waves)
        apart = aperture.apart(true[:, None], found[None])
        assert (apart.min(axis=1) < 0.1).all()


def test_where_two_waves_are_nearer_than_a_beam_the_one_told_is_unsure_and_two_that_are_told_are_not():
    aperture = Aperture(sparse(np.random.default_rng(4), 6), 1.0)
    for beams in (0.7, 2.5):
        at = np.array([[0.1, 0.0], [0.1 + beams * aperture.beamwidth[0], 0.0]])
        data = np.array([1.0, 1.0j]) @ aperture.steering(at)
        held = echoes_in(data, Scan(aperture, "bartlett", 1e3), 1e-2, 1e9)
        assert held.unsure(aperture).tolist() == ([True] if beams < 1.0 else [False, False])


def test_two_like_echoes_in_a_cell_of_a_sparse_line_are_detected_where_they_are():
    rng, wavelength = np.random.default_rng(9), C0 / SMALL.middle
    for _ in range(4):
        elements = sparse(rng, 6)
        at = np.sort(unlike(rng, Aperture(elements, 1.0), 2)[:, 0])
        paths = echoes([6.0, 6.0], 2.0, 1e-3 * np.exp(2j * np.pi * rng.random(2)), np.arcsin(at))
        cube = synthesize(paths, make_radar(SMALL, elements=wavelength * elements, noise=True), rng)
        found = detect(range_doppler(cube, SMALL), waveform=SMALL, elements=wavelength * elements)
        if Aperture(elements, 1.0).apart(*np.stack([at, 0.0 * at], axis=1)) > 1.1:
            np.testing.assert_allclose(np.sort(np.sin(found.azimuth)), at, atol=0.01)


@pytest.mark.parametrize(("rows", "columns", "count"), [(3, 3, 3), (2, 4, 3), (2, 3, 2)])
def test_no_waves_a_beam_width_apart_explain_more_before_small_rectangles_than_those_given(rows, columns, count):
    elements = np.stack([np.zeros(rows * columns), *0.5 * np.indices((rows, columns)).reshape(2, -1)], axis=1)
    aperture, size = Aperture(elements, 1.0), rows * columns
    for seed in range(40):
        rng = np.random.default_rng(seed)
        true = rng.uniform(-0.65, 0.65, (count, 2))
        apart = aperture.apart(true[:, None], true[None])[np.triu_indices(count, 1)]
        if apart.min() < 1.0:
            continue
        wave = np.exp(2j * np.pi * rng.random(count)) @ aperture.steering(true)
        data = wave[None] + 0.01 * rng.standard_normal((1, size, 2)).view(complex)[..., 0]
        assert explained(data, aperture, by_turns(data, aperture, count)) > explained(data, aperture, true) - 1e-3


def test_the_best_pairs_are_found_where_memory_holds_few_beams_at_once(monkeypatch):
    """Beams that none of the best pairs has are left out block by block."""
    for seed in range(5):
        rng = np.random.default_rng(seed)
        aperture = Aperture(rng.uniform(-3.0, 3.0, (12, 3)) * [0.0, 1.0, 1.0], 1.0)
        data = received(rng, aperture, unlike(rng, aperture, 2))
        assert len(aperture.grid(joint_search._PER_BEAM).points) > 700
        with monkeypatch.context() as small:
            pairs = joint_search._on_grid(data, aperture, 2)
            small.setattr(joint_search, "_BATCH", 32 * 200)
            assert joint_search._on_grid(data, aperture, 2)[:5].tolist() == pairs[:5].tolist()
