"""Weaker echoes of one snapshot, which raise no maximum of Capon's spectrum or one beside them: beams find them."""

from __future__ import annotations

import numpy as np
import pytest

from raychan.processing.angles import echoes_in
from raychan.processing.scan import Scan
from raychan.radar.aperture import Aperture

LAMBDA = 3.9e-3
NOISE = 10.0**-4.5


def scan_of(places, method):
    """Return how directions are sought before places (a,) [wavelengths] along y."""
    out = np.zeros((len(places), 3))
    out[:, 1] = LAMBDA * (places - np.mean(places))
    return Scan(Aperture(out, LAMBDA), method, 30.0)


def drawn(seed, scan):
    """Return two cosines 1.1 to 6 beam widths apart, and levels [dB], the weaker 16 to 28 dB below."""
    rng, width = np.random.default_rng(seed), scan.aperture.beamwidth[0]
    while True:
        towards = np.sort(rng.uniform(-0.8, 0.8, 2))
        if 1.1 * width < np.ptp(towards) < 6.0 * width:
            return towards, rng.permutation([0.0, -rng.uniform(16.0, 28.0)])


def held(scan, towards, levels, seed):
    """Return the echoes of a cell of waves from cosines along y, of levels in dB, and noise 45 dB below in a
    receiver."""
    rng, at = np.random.default_rng(seed), np.zeros((len(towards), 2))
    at[:, 0] = towards
    waves = 10.0 ** (0.05 * np.array(levels)) * np.exp(2j * np.pi * rng.uniform(size=len(towards)))
    count = len(scan.aperture.elements)
    noise = np.sqrt(0.5 * NOISE) * (rng.standard_normal((count, 2)) @ [1.0, 1.0j])
    return echoes_in(waves @ scan.aperture.steering(at) + noise, scan, 17.0 * NOISE / count, 1000.0)


@pytest.mark.parametrize("method", ["capon", "music"])
@pytest.mark.parametrize("form", ["uniform", "free"])
def test_a_weaker_echo_over_a_beam_width_aside_is_found(method, form):
    for seed in range(100):
        rng = np.random.default_rng([1, seed])
        count = int(rng.integers(7, 17))
        places = 0.5 * np.arange(count) if form == "uniform" else np.cumsum(rng.uniform(0.3, 0.7, count))
        scan = scan_of(places, method)
        towards, levels = drawn(seed, scan)
        found = held(scan, towards, levels, seed)
        assert len(found.power) == 2, seed
        near = np.abs(found.direction[:, :1] - towards).min(axis=0)
        assert (near < 0.15 * scan.aperture.beamwidth[0]).all(), seed
        assert not found.unsure(scan.aperture).any(), seed


def test_music_tells_apart_what_beams_do_not():
    scan = scan_of(0.5 * np.arange(12), "music")
    for seed in range(30):
        found = held(scan, [0.1, 0.1 + 0.6 / 6.0], [0.0, -3.0], seed)
        assert len(found.power) == 2, seed
        assert np.allclose(np.sort(found.direction[:, 0]), [0.1, 0.2], atol=0.15 / 6.0), seed
