"""The error to state of a cross-section: what launches leave open, and what refinement does not reduce."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from raychan.channel.error import LARGEST_DB, MAX_ERROR_DB, stated_error
from raychan.channel.mesh_error import MeshError
from raychan.world.geometry import Geometry


@dataclass
class Doubt:
    """Errors that refinement does not reduce: what the mesh leaves open, waves that creep around the body, and the
    terminator of a smooth one.

    Fields: `first` the amplitude [m] by the first launch, `of` what a launch by the same rule gives for another
    surface; `ring` [m] of the terminator; `waves`, bounds on creeping waves [m] and relative.
    """

    mesh_error: MeshError
    of: Callable[[Geometry], complex]
    first: complex
    ring: float
    waves: tuple[float, float]
    _others: dict[int, complex] = field(default_factory=dict)

    def numerical_db(self, value: complex, off: float) -> float:
        """Return the error [dB] of an amplitude that launches leave open by `off` [m]; NaN: unknown."""
        db = stated_error(value, off, 1.0)
        return np.nan if value == 0.0 or db > LARGEST_DB else db

    def error_db(self, value: complex, off: float) -> float:
        """Return the error [dB] to state of an amplitude that launches leave open by `off` [m]; NaN: unknown.

        Launches and normals err at the same specular points, at worst in phase; creeping waves and other surfaces are
        of unrelated phase and add in squares.
        """
        off += self.ring
        around, share = self.waves
        # A level of zero has no error in dB. Where the launches do not agree, other surfaces add nothing to know.
        if value == 0.0 or stated_error(value, off, 1.0) > LARGEST_DB:
            return np.nan
        off += self.mesh_error.facets(self.first, value, self._other) * abs(value)
        db = stated_error(value, math.hypot(off, max(around if self.ring else 0.0, share * abs(value))), 1.0)
        if db > LARGEST_DB:
            return np.nan
        # The difference between two surfaces is a figure, however large.
        return min(math.hypot(db, self.mesh_error.edges_db(self.first, value, self._other)), MAX_ERROR_DB)

    def _other(self, mesh: Geometry) -> complex:
        if id(mesh) not in self._others:
            self._others[id(mesh)] = self.of(mesh)
        return self._others[id(mesh)]
