"""The range profile of a car does not depend on the lattice of tubes."""

from __future__ import annotations

import itertools

import finufft
import numpy as np
import pytest
from support.targets import F, db, rms, view

from raychan.channel.transfer import transfer
from raychan.poses import theta_phi
from raychan.run.cross_section.refinement import refinements
from raychan.run.cross_section.single_body import facets_of
from raychan.tracing.legs import Leg
from raychan.tracing.shooting import tube_routes
from raychan.units import C0
from raychan.world.geometry import Geometry
from raychan.world.shapes.vehicle import car


def range_profile(geometry, leg, distance, rule, bandwidth=4e9, cells=512):
    """Hann-windowed profile (n,) about a body at `distance` [m], a cell of c/2B each, of one launch seen VV."""
    field = np.zeros(cells, complex)
    for routes in tube_routes(geometry, leg, [leg], np.ones(len(geometry.piece_role), bool), rule, 3):
        a = transfer(routes, geometry.facets, F, theta_phi_of, theta_phi_of, corners=True)[:, 0, 0]
        delay = 2.0 * np.pi * (routes.lengths[:, :3] - 2.0 * distance) / C0
        f = (np.arange(cells) / cells - 0.5) * bandwidth
        field += finufft.nufft1d3(delay.ravel(), a.ravel().astype(complex), f, isign=-1, eps=1e-9)
    return np.abs(np.fft.fftshift(np.fft.ifft(field * np.hanning(cells))))


def theta_phi_of(look):
    return np.stack(theta_phi(look), axis=1).astype(complex)


@pytest.mark.parametrize(("azimuth_deg", "most"), [(37.0, 1.0), (100.0, 2.0)])
def test_range_profile_of_a_car_is_that_of_a_finer_launch_over_another_lattice(azimuth_deg, most):
    """Cells within 30 dB of the peak within 1 dB rms (2 dB where least returns), by a million rays, 15 m away, 3
    bounces. At 37 degrees it is 1.000 million from either side; 0.99 and 1.01 when both were cut into facets unlike."""
    geometry = Geometry(facets_of(car(), "pec", F))
    leg = Leg(end=view(azimuth_deg)[0] * 15.0)
    coarse, fine = itertools.islice(refinements(geometry, F), 2)
    got = range_profile(geometry, leg, 15.0, coarse)
    assert geometry.rays <= 1_005_000
    true = range_profile(geometry, leg, 15.0, fine)
    seen = true > true.max() * 10.0 ** (-30.0 / 20.0)
    assert rms(db(got / true)[seen]) < most
