"""What a scene says of its array: methods that one snapshot is too little for, bodies off the plane it measures in."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc
from raychan.units import C0

WAVE = rc.Waveform(carrier=77e9, bandwidth=300e6, chirp_duration=20e-6, n_chirps=32, n_samples=64)
LAMBDA = C0 / WAVE.middle
TURN = 2.0 * np.pi * np.arange(16) / 16.0
CIRCLE = 0.6 * LAMBDA * np.stack([np.cos(TURN), np.sin(TURN), 0.0 * TURN], axis=1)
LINE = rc.uniform_array(8, 0.5 * LAMBDA)
PLANE = np.array([[0.0, y, z] for y in range(3) for z in range(3)]) * 0.5 * LAMBDA


def scene(elements, doa="bartlett", elevation=0.0, azimuth=20.0) -> rc.Scene:
    """Return a scene of a point 10 m away, in a direction [deg]."""
    az, el = np.radians([azimuth, elevation])
    place = 10.0 * np.array([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)])
    body = rc.Body("target", shape="sphere", params={"radius": 0.01}, position=place, rcs_dbsm=20.0)
    settings = rc.Processing(doa=doa)
    return rc.Scene([body], radar=rc.Radar(WAVE, position=(0.0, 0.0, 0.0), elements=elements, processing=settings))


@pytest.mark.parametrize("doa", ["bartlett", "capon", "music"])
@pytest.mark.parametrize(
    ("elements", "uniform"), [(LINE, True), (PLANE, True), (LINE[[0, 1, 4, 6, 7]], False), (CIRCLE, False)]
)
def test_methods_that_need_averaging_are_told_of_where_an_array_allows_none(elements, uniform, doa):
    said = [x for x in scene(elements, doa).warnings if "one snapshot" in x]
    assert len(said) == (doa != "bartlett" and not uniform)
    assert all(f"processing.doa = '{doa}'" in x for x in said)


def test_one_receiver_has_no_directions_to_distrust():
    assert not any("snapshot" in x for x in scene(LINE[:1], "music").warnings)


@pytest.mark.parametrize("elevation", [0.0, 10.0, 60.0])
def test_a_body_off_the_plane_of_a_circle_is_told_with_what_its_best_beam_loses(elevation):
    said = [x for x in scene(CIRCLE, elevation=elevation, azimuth=0.0).warnings if "off elevation 0" in x]
    assert len(said) == (elevation == 60.0)
    # The wave's phase over the circle is that of cos(60 deg) ahead; the beams', of 1.
    angles = np.linspace(-0.5, 0.5, 3601) * np.pi
    looks = np.stack([np.cos(angles) - np.cos(np.radians(60.0)), np.sin(angles)])
    kept = np.abs(np.exp(2j * np.pi / LAMBDA * CIRCLE[:, :2] @ looks).mean(axis=0)).max()
    assert all(f"reads {-20.0 * np.log10(kept):.1f} dB less" in x for x in said)


def test_a_flat_line_and_a_plane_say_nothing_of_elevation():
    assert not any("off elevation" in x for e in (LINE, PLANE) for x in scene(e, elevation=60.0).warnings)


@pytest.mark.parametrize(
    ("towards", "azimuth", "elevation", "shown"),
    [
        ((1.0, 0.0, 1.0), 16.7, 0.0, "elevation -2.5 deg in place of 0.0"),
        ((0.0, 1.0, 1.0), 16.7, 16.0, "azimuth 33.3 deg in place of 16.7"),
        ((1.0, 1.0, 0.0), 20.0, 0.0, None),
        ((0.0, 1.0, 1.0), 20.0, 0.0, None),
        ((0.0, 1.0, 0.001), 20.0, 30.0, None),
    ],
    ids=["x+z", "y+z", "x+y in its plane", "y+z in its plane", "all but along y"],
)
def test_a_line_slanted_or_deep_tells_where_a_body_off_its_plane_shows(towards, azimuth, elevation, shown):
    line = 0.5 * LAMBDA * np.outer(np.arange(12) - 5.5, np.array(towards) / np.linalg.norm(towards))
    said = [x for x in scene(line, azimuth=azimuth, elevation=elevation).warnings if "stands off" in x]
    assert len(said) == (shown is not None)
    assert all(f"shows near {shown}" in x for x in said)
