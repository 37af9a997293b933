"""Entries of the ledger that come from the length of the waves: what creeps around bodies, and what changes over the
band of a ramp."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.channel.mesh_error import creeping
from raychan.channel.terminator_error import TERMINATOR
from raychan.em.fresnel import coefficients_array
from raychan.radar.dual_paths import scaled
from raychan.radar.radar import Radar
from raychan.records import REFLECT, SCATTERER, TRANSMIT, Facets, Paths, Points
from raychan.run.ledger_entry import NOTHING, UNKNOWN, Entry
from raychan.run.mechanisms import peak, slots_used
from raychan.units import C0, db
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

_THICK = 0.01  # of a body's echo: smaller creeping waves count by their absolute bound only
_STEADY = 1e-3  # of a coefficient: one whose mean over the band differs less from the middle's does not change
_STEPS = 17  # frequencies of a band: 0.25 GHz apart in 4 GHz, where a pane of 5 cm has resonances 1.2 GHz apart
_COSINES = 100  # of incidence, from grazing to square on
_OBLIQUE = 0.85  # cosine at which a wave is taken to meet a part that is not flat (estimate)
_FLAT = 1e-6  # of normals of a flat part, which may look to both sides
_FADED = 1e-9  # coefficients below this bring nothing even where the band's mean is 1


def creeping_waves(
    paths: Paths, geometry: Geometry, points: Points, radar: Radar, settings: Any, weakest: float
) -> Entry:
    """Return the entry of waves that creep around curved bodies, but for points, whose RCS is given, and of what
    currents bring that end abruptly where the light does: of the body where they may bring most.

    The bounds are those of `rcs`, by the smallest extents of its pieces: one absolute, for what faces the radar, and
    one against the body's own echo, which counts where physical optics does not hold.
    """
    f, wave = geometry.facets, radar.waveform
    k = 2.0 * np.pi * wave.middle / C0
    ends = np.array([radar.position, radar.position if radar.rx_position is None else radar.rx_position], float)
    best, which, left = 0.0, "", ""
    for body in np.setdiff1d(f.body[geometry.curved & (f.role[f.body] == SCATTERER)], points.body):
        rows = np.flatnonzero(f.body == body)
        if (geometry.curved & geometry.both_sides)[rows].any():
            left = left or f.body_names[body]
        away = f.vertices[rows].mean(axis=(0, 1)) - ends
        r = np.linalg.norm(away, axis=1)
        look = away / r[:, None]
        apart = float(np.arccos(np.clip(look[0] @ look[1], -1.0, 1.0)))
        around, share = creeping(geometry, k, rows, apart, TERMINATOR)
        if around == 0.0:
            continue
        fields = radar.tx_field(look[:1]), radar.rx_field(look[1:])
        gain = np.prod([(np.abs(x) ** 2).sum() / one**2 for x, one in zip(fields, r, strict=True)])
        power = radar.power * gain * (C0 / wave.middle) ** 2 * 4.0 * np.pi * around**2 / (4.0 * np.pi) ** 3
        if share > _THICK:
            own = (paths.trajectories.body == body).any(axis=1)[paths.trajectory]
            power = max(power, share**2 * peak(paths, own, radar, settings))
        if power > best:
            best, which = float(power), f.body_names[body]
    unknown = f"{left} is curved and open, for which no bound is known" if left else ""
    if best == 0.0:
        return Entry(UNKNOWN, "none", unknown) if left else Entry(NOTHING, "exact", "no body has a curved side")
    how = (
        "bound of spheres as wide as the body's pieces at their thinnest, without occlusion, and of currents that end "
        f"where the light does: around {which}"
    )
    return Entry(float(db(best / weakest)), "bound", f"{how}; {unknown}" if left else how)


def over_band(paths: Paths, geometry: Geometry, radar: Radar, settings: Any, weakest: float) -> Entry:
    """Return the entry of coefficients that change over the band of a ramp: paths have those of its middle."""
    f, way, parts = geometry.facets, paths.trajectories, len(geometry.facets.part_names)
    sizes = _sizes(f, radar)
    changing = np.abs(sizes.mean(axis=0) - 1.0).max(axis=(0, 3)) > _STEADY
    row = np.zeros((len(f.body_names), parts), np.int64)
    row[f.body, f.part] = f.material
    body, part, kind = (x[:, : slots_used(paths)] for x in (way.body, way.part, way.kind))
    met, passed = row[np.maximum(body, 0), np.maximum(part, 0)], (kind == TRANSMIT).astype(np.int64)
    slots = (body >= 0) & (kind > 0) & changing[passed, met]
    rows, slot = np.nonzero(slots)
    if not len(rows):
        how = "no path meets a material whose coefficients change by a thousandth over the band"
        return Entry(NOTHING, "estimate", how)
    at = np.clip(np.rint(_COSINES * _cosines(paths, rows, slot, geometry)).astype(np.int64) - 1, 0, _COSINES - 1)
    passed, met = passed[rows, slot], met[rows, slot]
    first = np.diff(rows, prepend=-1) > 0
    own, found = np.cumsum(first) - 1, np.zeros(np.count_nonzero(first))
    # Of what a path meets together: two layers whose peaks coincide pass more than the product of both means.
    for size in np.moveaxis(np.log(np.maximum(sizes, _FADED)), 1, 0):
        each = [np.exp(np.bincount(own, one[passed, met, at])) for one in size]
        found = np.maximum(found, np.abs(np.mean(each, axis=0) - 1.0))
    off = np.zeros(len(slots))
    off[rows[first]] = found
    brought = off[paths.trajectory]
    level = peak(scaled(paths, brought), brought > 0.0, radar, settings)
    how = (
        f"strongest cell of paths by what their coefficients' mean over {radar.waveform.bandwidth / 1e9:g} GHz differs "
        "from the middle's, in size"
    )
    return Entry(float(db(max(level, 1e-40) / weakest)), "estimate", how)


def _sizes(facets: Facets, radar: Radar) -> Floats:
    """Return the sizes of coefficients over those at the middle of the band, (f, 2, 2, m, c): at frequencies over the
    band, s and p, reflected and passed, of each material, at cosines of incidence in equal steps up to 1."""
    m, wave = facets.materials, radar.waveform
    band = wave.carrier + wave.bandwidth * np.arange(_STEPS) / (_STEPS - 1)
    which = np.repeat(np.arange(len(m.kind)), _COSINES)
    cosine = np.tile(np.arange(1, _COSINES + 1) / _COSINES, len(m.kind))
    columns = m.thickness[which], m.roughness[which], cosine

    def at(f: float) -> Floats:
        # A conductivity that stays the same over the band.
        eps = m.eps.real + 1j * m.eps.imag * (wave.middle / f)
        return np.abs(coefficients_array(m.kind[which], eps[which], *columns, 2.0 * np.pi * f / C0))

    every = np.array([at(f) for f in (*band, wave.middle)])
    held = np.maximum(every[-1], _FADED)
    sizes = np.where(every[-1] > _FADED, every[:-1] / held, 1.0)
    return np.asarray(sizes.reshape(_STEPS, len(m.kind), _COSINES, 2, 2).transpose(0, 4, 3, 1, 2))


def _cosines(paths: Paths, rows: Rows, slot: Rows, geometry: Geometry) -> Floats:
    """Return the cosines of incidence (s,) at vertices of trajectories, by their rows and slots (s,): on flat parts by
    the normal, at mirrors by the turn of the way, elsewhere by estimate."""
    f, way = geometry.facets, paths.trajectories
    kind, here = way.kind[rows, slot], way.vertices[rows, slot].astype(float)
    ahead, deep = np.minimum(slot + 1, way.kind.shape[1] - 1), way.kind.shape[1] - 1
    on = (slot < deep) & (way.kind[rows, ahead] > 0)
    after = np.where(on[:, None], way.vertices[rows, ahead], paths.rx)
    before = np.where(slot[:, None] > 0, way.vertices[rows, np.maximum(slot - 1, 0)], paths.tx)
    there, away = _unit(here - before), _unit(after - here)
    turned = np.sqrt(np.clip(0.5 * (1.0 - (there * away).sum(axis=1)), 0.0, 1.0))
    # Of each part the mean of n n^T over its facets: of a flat one its largest eigenvalue is 1.
    part, parts = f.body * np.int64(len(f.part_names)) + f.part, len(f.body_names) * len(f.part_names)
    both = (geometry.normal[:, :, None] * geometry.normal[:, None, :]).reshape(-1, 9)
    square = np.stack([np.bincount(part, x, parts) for x in both.T], axis=1).reshape(-1, 3, 3)
    size, axes = np.linalg.eigh(square / np.maximum(np.bincount(part, minlength=parts), 1)[:, None, None])
    met = way.body[rows, slot] * np.int64(len(f.part_names)) + way.part[rows, slot]
    upon = np.abs((there * axes[met, :, 2]).sum(axis=1))
    known = np.where(kind == TRANSMIT, _OBLIQUE, turned)
    return np.asarray(np.where((size[met, 2] > 1.0 - _FLAT) & (kind != REFLECT), upon, known))


def _unit(vector: Floats) -> Floats:
    """Return vectors (s, 3) of length 1."""
    return np.asarray(vector / np.maximum(np.linalg.norm(vector, axis=1), 1e-12)[:, None])
