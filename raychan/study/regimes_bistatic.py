"""Regime of bistatic angles: from near backscatter to forward scatter."""

from __future__ import annotations

import numpy as np

from raychan.run.rcs import rcs
from raychan.study.regimes_base import FREQUENCY, LAMBDA, Outcome, Regime, Row, same_db
from raychan.world.shapes import build

_PO = "closed form: mean of physical optics both ways, one sinc (Balanis 2012, sec. 11.3)"


def bistatic(quick: bool) -> Outcome:
    """Check a plate and a sphere at bistatic angles from 20 deg to forward scatter at 180 deg."""
    rows: list[Row] = []
    width, height = 0.1, 0.05
    plate = build("plate", {"width": width, "height": height})
    angles = (20.0, 60.0, 88.0, 92.0, 120.0, 150.0, 175.0, 180.0)
    for angle in angles:
        turn = np.radians(angle)
        shape = width * height * np.sinc(width * np.sin(turn) / LAMBDA)
        # At normal incidence the currents 2 n x H, averaged over both directions, give 0.5 (1 + |cos|) in both planes.
        exact = 4 * np.pi * (shape * 0.5 * (1.0 + abs(np.cos(turn))) / LAMBDA) ** 2
        seen = rcs(plate, FREQUENCY, 0.0, rx_azimuth_deg=angle, tolerance_db=0.05)
        rows.append(same_db(f"plate at {angle:g} deg", float(seen.sigma), float(exact), 0.05, _PO))
    radius = 0.05
    ball = build("sphere", {"radius": radius})
    for angle in (30.0, 60.0, 90.0) if quick else (30.0, 45.0, 60.0, 75.0, 90.0, 105.0):
        seen = rcs(ball, FREQUENCY, 0.0, rx_azimuth_deg=angle)
        truth = "limit: geometric optics, pi a^2 (E across the plane of both ends)"
        rows.append(same_db(f"sphere at {angle:g} deg", float(seen.sigma), np.pi * radius**2, 0.1, truth))
    seen = rcs(ball, FREQUENCY, 0.0, rx_azimuth_deg=180.0)
    shadow = 4 * np.pi * (np.pi * radius**2 / LAMBDA) ** 2
    rows.append(same_db("sphere straight through", float(seen.sigma), shadow, 0.1, "limit: 4 pi A^2 / lambda^2"))
    return Outcome(rows)


REGIMES = (Regime("bistatic", "Bistatic angles to forward", bistatic),)
