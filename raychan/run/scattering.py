"""Scattering matrix of a body by itself: one launch of tubes, and the fields that its routes bring back."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.channel.transfer import transfer
from raychan.poses import theta_phi
from raychan.run.first_surface import first_surface
from raychan.tracing.contributions import Contributions
from raychan.tracing.legs import Leg
from raychan.tracing.shooting import tube_routes
from raychan.tracing.tubes import Refinement, Tubes
from raychan.units import C0
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


def scattering(geometry: Geometry, leg: Leg, out: Leg, frequency: float, bounces: int, rule: Refinement) -> Complexes:
    """Return the scattering amplitudes (bounces, 2, 2) [m] of one launch, by number of bounces; sigma = 4 pi |sum|^2.

    Rows are the receiver's V, H and columns the transmitter's; V, H are theta-hat, phi-hat of the direction to which
    each end looks. Amplitudes of ends at a finite distance are scaled by their distances from the origin.
    """
    every = np.ones(len(geometry.piece_role), bool)
    total = np.zeros((bounces, 2, 2), complex)

    def first(tubes: Tubes, found: Contributions) -> None:
        total[0] += first_surface(geometry, leg, out, tubes, found, frequency, _basis)

    for routes in tube_routes(geometry, leg, [out], every, rule, bounces, first=None if out == leg else first):
        count = int((routes.kind[0] != 0).sum()) - int((routes.kind[0] == 2).sum())
        total[min(count, bounces) - 1] += transfer(routes, geometry.facets, frequency, _basis, _basis).sum(axis=0)
    reach = 1.0 if leg.far else float(np.linalg.norm(leg.end))
    reach *= 1.0 if out.far else float(np.linalg.norm(out.end))
    total *= 4.0 * np.pi * frequency / C0 * reach
    return total


def reciprocal_scattering(
    geometry: Geometry, leg: Leg, out: Leg, frequency: float, bounces: int, rule: Refinement
) -> Complexes:
    """Return the scattering amplitudes (bounces, 2, 2) [m] of one launch, reciprocal by construction.

    Over several bounces physical optics is not reciprocal; the mean over both directions is. For one and the same end
    the other direction is the transposed matrix.
    """
    s = scattering(geometry, leg, out, frequency, bounces, rule)
    back = s if out == leg else scattering(geometry, out, leg, frequency, bounces, rule)
    return 0.5 * (s + back.transpose(0, 2, 1))


def _basis(look: Floats) -> Complexes:
    return np.stack(theta_phi(look), axis=1).astype(np.complex128)
