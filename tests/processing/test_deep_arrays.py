"""Arrays with depth along x, as conformal ones have: directions are found up to the edge of what is visible."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc
from raychan.processing.beams import BeamBank
from raychan.radar.aperture import Aperture

WAVELENGTH = 4e-3


def circle(radius: float, count: int, heights=(0.0,)) -> np.ndarray:
    turn = 2.0 * np.pi * np.arange(count) / count
    rings = [np.stack([radius * np.cos(turn), radius * np.sin(turn), 0.0 * turn + z], axis=1) for z in heights]
    return WAVELENGTH * np.concatenate(rings)


def ball(radius: float, count: int) -> np.ndarray:
    places = np.random.default_rng(0).standard_normal((count, 3))
    return WAVELENGTH * radius * places / np.linalg.norm(places, axis=1)[:, None]


def wave(elements: np.ndarray, look: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return a wave from a direction (3,), 27 dB above the noise of an element."""
    noise = 0.03 * rng.standard_normal((len(elements), 2)).view(complex)[:, 0]
    return np.exp(2j * np.pi / WAVELENGTH * (elements @ look)) + noise


@pytest.mark.parametrize("method", ["bartlett", "capon", "music"])
@pytest.mark.parametrize("axis", [1, 2])
def test_a_circle_finds_directions_up_to_90_deg(axis, method):
    elements, rng = circle(2.0, 28), np.random.default_rng(0)
    if axis == 2:
        elements = elements[:, [0, 2, 1]]
    for degrees in np.linspace(-89.0, 89.0, 45):
        angle = np.radians(degrees)
        look = np.cos(angle) * np.eye(3)[0] + np.sin(angle) * np.eye(3)[axis]
        found = rc.doa(wave(elements, look, rng), elements, WAVELENGTH, method=method, sources=1)
        seen = found.azimuth if axis == 1 else found.elevation
        assert np.degrees(seen) == pytest.approx([degrees], abs=1.0)


@pytest.mark.parametrize("elements", [ball(2.0, 64), circle(1.5, 16, (-0.75, -0.25, 0.25, 0.75))], ids=["ball", "drum"])
def test_arrays_round_two_axes_find_directions_everywhere_ahead(elements):
    rng = np.random.default_rng(1)
    for k in range(30):
        look = rng.standard_normal(3)
        # Every second wave comes from near the edge.
        look[0] = abs(look[0]) * (0.1 if k % 2 else 1.0)
        look /= np.linalg.norm(look)
        found = rc.doa(wave(elements, look, rng), elements, WAVELENGTH, sources=1)
        az, el = found.azimuth[0], found.elevation[0]
        seen = np.array([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)])
        assert np.degrees(np.arccos(min(1.0, seen @ look))) < 1.5


def test_two_waves_at_the_edge_of_a_circle_are_told_apart():
    elements, rng = circle(2.0, 28), np.random.default_rng(0)
    looks = [np.array([np.cos(a), np.sin(a), 0.0]) for a in np.radians([62.0, 84.0])]
    both = wave(elements, looks[0], rng) + 0.7j * wave(elements, looks[1], rng)
    found = rc.doa(both, elements, WAVELENGTH, sources=2)
    assert np.degrees(np.sort(found.azimuth)) == pytest.approx([62.0, 84.0], abs=1.0)


@pytest.mark.parametrize("elements", [circle(2.0, 28), ball(1.0, 32)], ids=["circle", "ball"])
def test_the_detectors_beams_see_echoes_everywhere_ahead(elements):
    """As of flat arrays: an echo between two reads 0.9 dB low, of an array of two axes 1.8 dB."""
    array, rng = Aperture(elements, WAVELENGTH), np.random.default_rng(3)
    look = rng.standard_normal((500, 3)) * np.array([1.0, 1.0, float(array.scans[1])])
    look[:, 0] = np.abs(look[:, 0]) * rng.choice([0.1, 1.0], len(look))
    look /= np.linalg.norm(look, axis=1)[:, None]
    waves = np.exp(2j * np.pi / WAVELENGTH * (elements @ look.T))
    seen = 10.0 * np.log10((np.abs(BeamBank(array).rows @ waves) ** 2).max(axis=0))
    assert seen.min() > (-1.8 if array.scans[1] else -0.9)


def test_noise_in_the_beams_of_a_circle_keeps_the_false_alarm_rate():
    array, rng = Aperture(circle(2.0, 28), WAVELENGTH), np.random.default_rng(4)
    noise = rng.standard_normal((28, 400_000, 2)).view(complex)[..., 0] / np.sqrt(2.0)
    bank = BeamBank(array)
    top = np.concatenate([(np.abs(bank.rows @ part) ** 2).max(axis=0) for part in np.array_split(noise, 20, axis=1)])
    share = float((top > -bank.noise_gain * np.log(bank.single(1e-3))).mean())
    assert 0.6e-3 < share < 1.1e-3


def test_flat_and_slightly_bent_arrays_are_not_deep():
    line = rc.uniform_array(16, 0.5 * WAVELENGTH)
    bent = line + np.outer(np.linspace(-1.0, 1.0, 16) ** 2, [0.1 * WAVELENGTH, 0.0, 0.0])
    assert not any(Aperture(x, WAVELENGTH).deep for x in (line, bent, ball(2.0, 64) * [0.0, 1.0, 1.0]))
    assert Aperture(circle(2.0, 28), WAVELENGTH).deep
