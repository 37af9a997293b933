"""Entries of the ledger that come from the length of the waves: what creeps around bodies, and what changes over the
band of a ramp."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.channel.mesh_error import creeping
from raychan.em.fresnel import coefficients_array
from raychan.radar.dual_paths import scaled
from raychan.radar.radar import Radar
from raychan.records import MIRROR, TRANSMIT, Facets, Paths
from raychan.run.ledger import NOTHING, Entry
from raychan.run.mechanisms import peak
from raychan.units import C0, db
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]

_THICK = 0.01  # of a body's echo: smaller creeping waves count by their absolute bound only
_STEADY = 1e-3  # of a coefficient: a mean over the band that differs less from the middle's is none
_STEPS = 33  # frequencies of a band: over a layer's resonances, a tenth of a GHz apart in 4 GHz
_COSINES = 1.0, 0.85, 0.7  # of incidence, to 45 degrees: where most echoes come from (estimate)
_FADED = 1e-9  # coefficients below this bring nothing even where the band's mean is 1


def creeping_waves(paths: Paths, geometry: Geometry, radar: Radar, settings: Any, weakest: float) -> Entry:
    """Return the entry of waves that creep around curved bodies: of the body where they may bring most.

    The bounds are those of `rcs`, by the body's smallest extent: one absolute, for what faces the radar, and one
    against the body's own echo, which counts where physical optics does not hold.
    """
    f, wave = geometry.facets, radar.waveform
    k = 2.0 * np.pi * wave.middle / C0
    best, which = 0.0, ""
    for body in np.unique(f.body[geometry.curved]):
        rows = np.flatnonzero(f.body == body)
        if f.role[body] == MIRROR:
            continue
        around, share = creeping(geometry, k, rows)
        away = f.vertices[rows].mean(axis=(0, 1)) - np.asarray(radar.position)
        r = float(np.linalg.norm(away))
        look = (away / r)[None]
        gain = np.prod([(np.abs(field(look)) ** 2).sum() for field in (radar.tx_field, radar.rx_field)])
        power = radar.power * gain * (C0 / wave.middle) ** 2 * 4.0 * np.pi * around**2 / ((4.0 * np.pi) ** 3 * r**4)
        if share > _THICK:
            own = (paths.trajectories.body == body).any(axis=1)[paths.trajectory]
            power = max(power, share**2 * peak(paths, own, radar, settings))
        if power > best:
            best, which = float(power), f.body_names[body]
    if best == 0.0:
        return Entry(NOTHING, "exact", "no closed body has a curved side")
    how = f"bound of a sphere as wide as the body's smallest extent, without occlusion: around {which}"
    return Entry(float(db(best / weakest)), "bound", how)


def over_band(paths: Paths, facets: Facets, radar: Radar, settings: Any, weakest: float) -> Entry:
    """Return the entry of coefficients that change over the band of a ramp: paths have those of its middle."""
    reflected, passed = _changes(facets, radar)
    worst = int(np.argmax(np.maximum(reflected, passed)))
    if max(reflected[worst], passed[worst]) <= _STEADY:
        return Entry(NOTHING, "estimate", "no material's coefficients change by a thousandth over the band")
    way, parts = paths.trajectories, len(facets.part_names)
    row = np.zeros((len(facets.body_names), parts), np.int64)
    row[facets.body, facets.part] = facets.material
    met = row[np.maximum(way.body, 0), np.maximum(way.part, 0)]
    change = np.where(way.kind == TRANSMIT, passed[met], reflected[met])
    off = np.where((way.body >= 0) & (way.kind > 0), change, 0.0).sum(axis=1)
    if not off[paths.trajectory].any():
        return Entry(NOTHING, "estimate", "no path meets a material whose coefficients change over the band")
    level = peak(scaled(paths, off[paths.trajectory]), off[paths.trajectory] > 0.0, radar, settings)
    how = (
        f"strongest cell of paths by what their coefficients' mean over {radar.waveform.bandwidth / 1e9:g} GHz differs "
        "from the middle's, in size, at incidence of 0 to 45 deg"
    )
    return Entry(float(db(max(level, 1e-40) / weakest)), "estimate", how)


def _changes(facets: Facets, radar: Radar) -> tuple[Floats, Floats]:
    """Return by what share of the middle's each material's (m,) mean coefficient over the band differs from it, in
    size: reflected and passed."""
    m, wave = facets.materials, radar.waveform
    band = wave.carrier + wave.bandwidth * np.arange(_STEPS) / (_STEPS - 1)
    which = np.repeat(np.arange(len(m.kind)), len(_COSINES))
    cosine = np.tile(_COSINES, len(m.kind))
    columns = m.kind[which], m.eps[which], m.thickness[which], m.roughness[which], cosine
    mean = np.mean([np.abs(coefficients_array(*columns, 2.0 * np.pi * f / C0)) for f in band], axis=0)
    middle = np.abs(coefficients_array(*columns, 2.0 * np.pi * wave.middle / C0))
    off = np.where(middle > _FADED, np.abs(mean - middle) / np.maximum(middle, _FADED), 0.0)
    most = off.reshape(len(m.kind), -1, 2, 2).max(axis=(1, 3))
    return most[:, 0], most[:, 1]
