"""Targets given by their RCS, and an isotropic radar that sees them, for tests of the channel."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from raychan.poses import theta_phi
from raychan.records import Points


def radar(position=(0.0, 0.0, 0.5), velocity=(0.0, 0.0, 0.0), polarization=0):
    """Return an isotropic radar, of polarisation V or H."""

    def field(look):
        return theta_phi(look)[polarization].astype(complex)

    return SimpleNamespace(position=np.array(position), velocity=np.array(velocity), tx_field=field, rx_field=field)


def point(position, sigma, velocity=(0.0, 0.0, 0.0), body=0):
    """Return one target at a place [m] of a given RCS [m^2]."""
    return Points(
        position=[position],
        velocity=[velocity],
        body=[body],
        azimuth=[-np.pi, np.pi],
        sigma=[[sigma, sigma]],
        heading=[0.0],
    )


def no_points():
    """Return no target."""
    return Points(
        position=np.zeros((0, 3)), velocity=np.zeros((0, 3)), body=np.zeros(0, int), azimuth=[-np.pi, np.pi],
        sigma=np.zeros((0, 2)), heading=np.zeros(0),
    )  # fmt: skip
