"""Sensors and paths of point echoes, for tests of the receiver."""

from __future__ import annotations

import numpy as np

from raychan.radar.antenna import IsotropicAntenna
from raychan.radar.radar import Radar
from raychan.radar.waveform import Waveform
from raychan.records import Paths

WIDE = Waveform(77e9, 4e9, 25.6e-6, 40e-6, 128, 1024)
"""The study's 4 GHz frame."""
SMALL = Waveform(77e9, 1e9, 20e-6, 40e-6, 64, 128)


def make_radar(waveform: Waveform, **changes) -> Radar:
    """Return an isotropic radar at the origin, without noise unless asked for."""
    given = {"position": np.zeros(3), "power": 1.0, "noise_figure_db": 15.0, "noise": False} | changes
    return Radar(antenna=IsotropicAntenna(), waveform=waveform, **given)


def echoes(ranges, rates=0.0, amplitudes=1.0, azimuth=0.0, elevation=0.0) -> Paths:
    """Paths of given range [m] and rate [m/s] at the start of the frame, amplitude with its phase, azimuth and
    elevation [rad]."""
    r, v, a, az, el = np.broadcast_arrays(np.atleast_1d(ranges), rates, amplitudes, azimuth, elevation)
    n = len(r)
    look = np.stack([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)], axis=1)
    none = np.full((n, 1), -1)
    return Paths.of(
        length=2.0 * r, amplitude=a.astype(complex), length_rate=2.0 * v, departure=look, arrival=look,
        body=none, part=none, kind=none * 0, vertices=np.zeros((n, 1, 3)),
        body_names=(), part_names=(), tx=np.zeros(3), rx=np.zeros(3),
    )  # fmt: skip
