"""Faces a few wavelengths to a metre before the radar return what a direct sum of physical optics, or their image,
does: facets far larger than their distance have neither a quadratic phase nor one amplitude."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc
from raychan.tracing.settings import refinement
from raychan.units import C0

_POWER_DBM, _GAIN = 10.0, 2.0  # of the radar; of its antennas, which see half of all directions
_HEIGHT = 5.0  # m of the radar
# dB: further terms than those of half the cuts, on which the stated error rests.
_FURTHER_DB = 0.1
_FACES = [
    # carrier [Hz], width, height, distance [m], offset of the middle to the left and up [m]
    (77e9, 0.1, 0.1, 0.02, 0.0, 0.0),
    (77e9, 0.113, 0.131, 0.0146, -0.024, -0.028),
    (77e9, 0.12, 0.11, 0.0465, 0.0, 0.0),
    (77e9, 0.18, 0.126, 0.1131, 0.031, 0.02),
    (77e9, 0.243, 0.162, 0.6422, -0.014, -0.01),
    (24e9, 0.424, 0.589, 0.2152, 0.029, 0.05),
    (24e9, 0.184, 0.33, 0.0607, -0.032, -0.08),
    (10e9, 0.059, 0.066, 0.1155, 0.008, 0.015),
]
_WIDE = [
    (77e9, 4.0, 2.4, 0.13, 0.0, 0.0),
    (77e9, 1.0, 1.0, 0.01, 0.0, 0.0),
    (24e9, 3.604, 6.254, 0.0345, 0.661, 1.08),
]


def _wave(carrier):
    return rc.Waveform(carrier=carrier, bandwidth=600e6, chirp_duration=40e-6, n_chirps=16, n_samples=128)


def _echo(body, carrier, tolerance):
    radar = rc.Radar(waveform=_wave(carrier), position=(0.0, 0.0, _HEIGHT), power=10.0 ** (_POWER_DBM / 10.0 - 3.0))
    scene = rc.Scene(bodies=[body], radar=radar, model={"max_bounces": 1, "tolerance_db": tolerance})
    found = rc.simulate(scene).detections
    assert len(found.power)
    return 10.0 * np.log10(found.power[0]) + 30.0, found.error_db[0]


def _plate(width, height, distance, left, up):
    params = {"width": width, "height": height}
    return rc.Body("p", shape="plate", params=params, position=(distance, left, _HEIGHT + up), material="pec")


def _box(width, height, distance, left, up):
    params = {"width": width, "height": height, "length": 0.1}
    position = (distance + 0.05, left, _HEIGHT + up - 0.5 * height)
    return rc.Body("p", shape="box", params=params, position=position, material="pec")


def _level(field, carrier):
    """Return the level [dBm] of a scattered field [1/m] of a unit field at 1 m."""
    return _POWER_DBM + 20.0 * np.log10(field * _GAIN * C0 / _wave(carrier).middle / (4.0 * np.pi))


def _by_image(carrier, distance):
    return _level(1.0 / (2.0 * distance), carrier)


def _by_sum(carrier, width, height, distance, left, up):
    """Return the level [dBm] by k / (2 pi) of the sum of cos_i exp(-2 j k R) / R^2 over a plate's elements."""
    k = 2.0 * np.pi * _wave(carrier).middle / C0
    step = min(2.0 * np.pi / k, distance) / 8.0
    (y, dy), (z, dz) = _cells(width, left, step), _cells(height, up, step)
    r = np.sqrt(distance**2 + y[:, None] ** 2 + z**2)
    whole = np.sum(distance / r * np.exp(-2j * k * r) / r**2) * dy * dz
    return _level(k / (2.0 * np.pi) * abs(whole), carrier)


def _cells(size, middle, step):
    count = int(size / step) + 1
    return middle + ((np.arange(count) + 0.5) / count - 0.5) * size, size / count


@pytest.mark.parametrize(("shape", "tolerance"), [(_plate, 3.0), (_plate, 0.1), (_box, 0.5)])
@pytest.mark.parametrize("face", _FACES)
def test_a_near_face_returns_what_a_direct_sum_over_it_does(face, shape, tolerance):
    level, error = _echo(shape(*face[1:]), face[0], tolerance)
    assert abs(level - _by_sum(*face)) < error + _FURTHER_DB
    assert error < max(tolerance, 0.3)


@pytest.mark.parametrize(("shape", "tolerance"), [(_plate, 3.0), (_plate, 0.1), (_box, 0.5)])
@pytest.mark.parametrize("face", _WIDE)
def test_a_wide_face_nearby_returns_what_its_image_does(face, shape, tolerance):
    level, error = _echo(shape(*face[1:]), face[0], tolerance)
    assert abs(level - _by_image(face[0], face[3])) < error + _FURTHER_DB


@pytest.mark.parametrize("distance", [0.01, 0.02, 0.05])
def test_a_near_sphere_returns_what_geometrical_optics_does_at_all_tolerances(distance):
    ball = rc.Body("b", shape="sphere", params={"radius": 0.5}, position=(0.5 + distance, 0.0, _HEIGHT), material="pec")
    # The image thinned by the sphere: radius / (radius + distance).
    truth = _level(0.5 / (2.0 * distance * (0.5 + distance)), 77e9)
    for tolerance in (3.0, 0.5, 0.1):
        level, error = _echo(ball, 77e9, tolerance)
        assert abs(level - truth) < error + _FURTHER_DB


def test_first_tubes_reach_less_far_the_finer_the_tolerance():
    shares = [refinement(77e9, tolerance).near for tolerance in (3.0, 0.5, 0.25, 0.05)]
    assert shares[0] == shares[1] > shares[2] > shares[3] > 0.0
