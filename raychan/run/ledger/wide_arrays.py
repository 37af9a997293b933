"""The ledger's entry of arrays so wide for their distance that footprints of turning bodies have too few points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.channel.footprint_paths import share_lacking
from raychan.radar.array import half_axes
from raychan.radar.radar import Radar
from raychan.records import Paths
from raychan.run.ledger_entry import NOTHING, Entry
from raychan.run.mechanisms import peak
from raychan.signal.fronts import fronts_of
from raychan.units import C0, db

WIDE = "turning bodies before wide arrays"
_CORNERS = 3  # paths of a footprint that acts from its corners


def before_wide_arrays(paths: Paths, turns: NDArray[np.bool_], radar: Radar, settings: object, weakest: float) -> Entry:
    """Return the entry of footprints of turning bodies, which act from their corners alone where several tracings make
    a frame, though the phase at the outermost elements asks for more points.

    Args: paths of the frame's middle, where such footprints have as many as they need; turns (b,) which bodies turn;
    settings of the processing; weakest power [W] of a detection.
    """
    met, n = paths.trajectories, len(paths.trajectories.kind)
    on = (turns[np.maximum(met.body, 0)] & (met.body >= 0) & (met.kind > 0)).any(axis=1)
    more = on & (np.bincount(paths.trajectory, minlength=n) > _CORNERS)
    rows = np.flatnonzero(more[paths.trajectory])
    if not len(rows) or not weakest > 0.0:
        return Entry(NOTHING, "exact", "footprints of turning bodies need no more than their corners")
    fronts, middle = fronts_of(paths)[rows], 2.0 * np.pi * radar.waveform.middle / C0
    angles = paths.aside[rows] / np.stack([fronts.tx_radius, fronts.radius], axis=1)[:, :, None]
    run = 2.0 * float(middle * np.abs(np.einsum("pex,eax->pea", angles, half_axes(radar))).sum(axis=(1, 2)).max())
    level = peak(paths, more[paths.trajectory], radar, settings) * float(share_lacking(np.array([run]))[0]) ** 2
    bodies = np.unique(met.body[more])
    names = ", ".join(paths.body_names[b] for b in bodies[bodies >= 0] if turns[b])
    how = (
        f"footprints of {names} act from their corners alone, though the phase at the outermost elements runs by up to "
        f"{run:.2g} rad over one: levels there may be off by so much"
    )
    return Entry(float(db(max(level, 1e-300) / weakest)), "estimate", how)
