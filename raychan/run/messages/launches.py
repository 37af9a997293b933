"""Lines that a run prints and stores on its launches: tubes left uncut, runs that took long, facets merged."""

from __future__ import annotations

import numpy as np

from raychan.tracing.stats import Stats
from raychan.world.geometry import Geometry


def uncut(geometry: Geometry, *launches: Stats) -> tuple[str, ...]:
    """Return a line if launches needed to subdivide more tubes on a body than they may."""
    left = np.zeros(len(geometry.facets.role), np.int64)
    for stats in launches:
        left[: len(stats.uncut)] += stats.uncut
    if not left.any():
        return ()
    worst, facets = int(np.argmax(left)), geometry.facets
    area = float(geometry.area[facets.body == worst].sum())
    body = f"body '{facets.body_names[worst]}': {int(left[worst]):,} tubes on its {area:.3g} m2"
    return (
        f"{body} are coarser than the tolerance asks for: too many are partly hidden or too large. Errors may exceed "
        "those stated; a larger tolerance asks for fewer, and a mesh file may have spikes, faces that cross or lie on "
        "each other, or another unit",
    )


def overrun(seconds: float, allowed: float | None) -> tuple[str, ...]:
    """Return a line if a run took more seconds than a budget allows."""
    if allowed is None or seconds <= allowed:
        return ()
    return (
        f"the run took longer than the {allowed:g} s allowed (model.max_seconds), as the first launch, one step and "
        "what follows the steps always end: a larger tolerance (model.tolerance_db), fewer bounces or fewer elements "
        "far apart take less, a preview (model.mode) least",
    )


def merged(geometry: Geometry) -> tuple[str, ...]:
    """Return a line if facets were merged, with the deviation of the surface."""
    return (f"smooth surfaces: {geometry.merged} (model.simplify)",) if geometry.merged else ()
