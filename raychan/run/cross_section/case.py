"""One cross-section to compute, what is found, and what one more bounce than is allowed would change."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from raychan.channel.mesh_error import MeshError
from raychan.run.cross_section.scattering import BodyLaunch
from raychan.tracing.legs import Leg
from raychan.tracing.tubes import Refinement
from raychan.world.geometry import Geometry
from raychan.world.limits import BOUNCES

Complexes = NDArray[np.complex128]

COUNTS = 1e-3
"""Of the strongest bounce, -60 dB: one below it does not count."""


@dataclass(frozen=True)
class Case:
    """One cross-section to compute: a body, both legs, polarisation (rows V, H of receiver and transmitter), limits."""

    geometry: Geometry
    mesh_error: MeshError
    leg: Leg
    out: Leg
    frequency: float
    bounces: int
    tolerance_db: float
    max_rays: int
    row: int
    col: int

    @property
    def rays(self) -> int:
        """Rays cast so far on the body and on the other surfaces that its mesh may stand for."""
        return self.geometry.rays + self.mesh_error.rays

    def launch(self, geometry: Geometry, rule: Refinement) -> Complexes:
        """Return the scattering amplitudes (bounces, 2, 2) [m] of one launch."""
        launch = BodyLaunch(geometry, (self.leg, self.out), self.frequency, self.bounces)
        return launch.whole(rule).by_bounce(self.bounces)


@dataclass(frozen=True)
class Value:
    """A cross-section: sigma [m^2], error [dB] and the part of it that more rays reduce (NaN: unknown), rays cast, most
    bounces that counted, change [dB] by a further bounce, scattering matrix (2, 2) [m]."""

    sigma: float
    error_db: float
    numerical_db: float
    rays: int
    bounces: int
    further_db: float
    edges_db: float
    matrix: Complexes


def further_db(case: Case, rule: Refinement, by_bounce: Complexes) -> float:
    """Return the change [dB] of the level by one more bounce than is allowed.

    The next bounce brings as much as the last at most, by estimate; where the last brings nothing, it tells nothing of
    the next: seen along its axis, a corner of three faces returns by three bounces and not by two. There, and where as
    much as the last counts, a launch by the given rule, with one more bounce, tells it."""
    if case.geometry.convex_alone:
        return 0.0
    whole, last = abs(by_bounce.sum()), abs(by_bounce[-1])
    if len(by_bounce) == 1 or not whole:
        return np.nan
    open_, nothing = _change_db(last, whole) > case.tolerance_db, last <= COUNTS * np.abs(by_bounce).max()
    if (open_ or nothing) and case.bounces < BOUNCES.high:
        last = abs(replace(case, bounces=case.bounces + 1).launch(case.geometry, rule)[-1, case.row, case.col])
    return _change_db(last, whole)


def _change_db(more: float, whole: float) -> float:
    """Return the change [dB] of an amplitude by another in phase with it."""
    return float(20.0 * np.log10(1.0 + more / whole))
