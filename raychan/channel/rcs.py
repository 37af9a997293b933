"""Radar cross-section of a body by itself: the same tubes and fields as in a scene."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.channel.fields import transfer
from raychan.channel.legs import Leg
from raychan.channel.shoot import tube_routes
from raychan.channel.surface import Surface
from raychan.channel.tubes import Refinement
from raychan.frames import theta_phi
from raychan.units import C0

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


def scattering(surface: Surface, leg: Leg, out: Leg, frequency: float, bounces: int, rule: Refinement) -> Complexes:
    """Return the scattering amplitudes (bounces, 2, 2) [m] by number of bounces; sigma = 4 pi |sum|^2.

    Rows are the receiver's V, H and columns the transmitter's; V, H are theta-hat, phi-hat of the direction of travel.
    Point ends are scaled to their distances from the origin.
    """
    bodies = np.ones(len(surface.facets.role), bool)
    total = np.zeros((bounces, 2, 2), complex)
    for routes in tube_routes(surface, leg, [out], bodies, rule, bounces):
        count = int((routes.kind[0] > 0).sum()) - 1
        parts = transfer(routes, surface.facets, frequency, lambda d: _basis(d), lambda d: _basis(-d))
        total[min(count, bounces - 1)] += parts.sum(axis=0)
    wavelength = C0 / frequency
    reach = 1.0 if leg.far else float(np.linalg.norm(leg.end) * np.linalg.norm(out.end))
    return total * (4.0 * np.pi / wavelength) * reach


def _basis(travel: Floats) -> Complexes:
    return np.stack(theta_phi(travel), axis=1).astype(complex)
