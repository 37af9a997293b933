"""The targets of a scene that are given by their RCS."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from raychan.records import Points
from raychan.world.body import Body
from raychan.world.mesh import Floats


def points_of(bodies: Sequence[Body], time: float = 0.0) -> Points:
    """Return the targets given by their RCS among bodies at a time [s]; all tables on the finest table's azimuths."""
    rows = [(i, b) for i, b in enumerate(bodies) if b.rcs_dbsm is not None]
    tables = [b.target() for _, b in rows]
    knots = max((t[0] for t in tables), key=len, default=np.array([-np.pi, np.pi]))
    place: list[Floats] = [b.motion.to_world(b.target_point(), time) for _, b in rows]
    velocity = [b.motion.velocity_at(p, time) for (_, b), p in zip(rows, place, strict=True)]
    return Points(
        position=np.array(place).reshape(-1, 3),
        velocity=np.array(velocity).reshape(-1, 3),
        body=np.array([i for i, _ in rows], np.int32),
        azimuth=knots,
        sigma=np.array([np.interp(knots, *t) for t in tables]).reshape(-1, len(knots)),
        heading=np.array([b.motion.heading(time) for _, b in rows], float),
    )
