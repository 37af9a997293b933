"""The ledger of unmodelled effects: an estimate or bound of each against the weakest detection, or 'unknown'."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.em.fresnel import coefficients_array
from raychan.radar.radar import Radar
from raychan.records import MIRROR, Facets, Paths, Points
from raychan.run.clutter import scatters_diffusely
from raychan.run.ledger import NOTHING, UNKNOWN, Entry
from raychan.run.mechanisms import interactions, layers, peak
from raychan.run.solver import paths_over_wedges
from raychan.run.tessellation import strongest_bend
from raychan.units import db
from raychan.world.body import Body
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]


def ledger(
    paths: Paths,
    geometry: Geometry,
    points: Points,
    radar: Radar,
    settings: Any,
    model: Any,
    weakest: float,
    bodies: Collection[Body] = (),
) -> dict[str, Entry]:
    """Return the unmodelled effects by name, each against the weakest detection's power [W].

    Args: settings, the scene's processing; model, what was modelled; bodies of the scene.
    """
    if not weakest > 0.0 or not len(geometry.facets.vertices):
        return {name: Entry(UNKNOWN, "none", "nothing was detected") for name in _NAMES}
    found: dict[str, Entry] = {
        "further bounces": _further(paths, radar, settings, model.max_bounces, weakest),
        "transmission": _transmission(paths, radar, settings, weakest),
        "diffraction": _diffraction(geometry, radar, weakest),
        "diffraction to point targets": _around(geometry, points, radar, settings, model, weakest),
        "diffuse scattering": _diffuse(geometry, radar, model, weakest),
        "tessellation": _tessellation(paths, geometry, bodies, radar, settings, weakest),
        "range migration": Entry(NOTHING, "exact", "kept in the cube to better than -100 dB of its peak"),
        "intra-frame motion": _motion(paths, geometry.facets, radar),
    }
    if radar.rx_position is not None:
        aside = Entry(UNKNOWN, "none", "not estimated for receivers elsewhere than the transmitter")
        found |= dict.fromkeys(_MONOSTATIC, aside)
    return {name: found[name] for name in _NAMES}


_NAMES = (
    "further bounces",
    "transmission",
    "diffraction",
    "diffraction to point targets",
    "diffuse scattering",
    "tessellation",
    "range migration",
    "intra-frame motion",
)


_MONOSTATIC = "diffraction", "diffraction to point targets", "diffuse scattering", "intra-frame motion"
"""Effects whose estimates take the way back to be the way out."""


def _further(paths: Paths, radar: Radar, settings: Any, bounces: int, weakest: float) -> Entry:
    """Return the entry of further bounces, extrapolated by the ratio of the last two orders."""
    met = interactions(paths)
    last, before = (peak(paths, met == n, radar, settings) for n in (bounces, bounces - 1))
    if last == 0.0 or before == 0.0:
        return Entry(UNKNOWN, "none", f"no path has {bounces} interactions: nothing to extrapolate from")
    ratio = min(last / before, 1.0)
    how = f"strongest cell of {bounces} interactions ({db(last / weakest):.0f} dB) times its ratio to {bounces - 1}"
    return Entry(float(db(last * ratio / weakest)), "estimate", how)


def _transmission(paths: Paths, radar: Radar, settings: Any, weakest: float) -> Entry:
    """Return the entry of transmissions through further layers, extrapolated by the ratio of the last two orders."""
    passes = layers(paths)
    most = int(passes.max(initial=0))
    if most == 0:
        return Entry(NOTHING, "exact", "no path passes a thin layer")
    last = peak(paths, passes == most, radar, settings)
    loss = peak(paths, passes == max(most - 1, 0), radar, settings)
    ratio = min(last / loss, 1.0) if loss > 0.0 else 1.0
    how = f"strongest cell through {most} layers times its ratio to {most - 1}: one layer more"
    return Entry(float(db(max(last * ratio, 1e-40) / weakest)), "estimate", how)


def _gain(radar: Radar, points: Floats) -> tuple[Floats, Floats, Floats]:
    """Return directions, distances [m] and the product of both antennas' gains towards points (n, 3)."""
    d = points - np.asarray(radar.position)
    r = np.linalg.norm(d, axis=1)
    look = d / r[:, None]
    both = [np.linalg.norm(f(look), axis=1) ** 2 for f in (radar.tx_field, radar.rx_field)]
    return look, r, both[0] * both[1]


def _diffraction(geometry: Geometry, radar: Radar, weakest: float) -> Entry:
    """Return the entry of fringe currents of edges: an edge of length L seen broadside has an RCS of at most L^2 / pi
    (Ross, IEEE Trans. AP 14(3), 1966; Knott, Shaeffer, Tuley 2004)."""
    edges = geometry.plane_edges
    if not len(edges):
        return Entry(NOTHING, "exact", "no surface has an edge")
    middle = edges.mean(axis=1)
    look, r, gain = _gain(radar, middle)
    span = edges[:, 1] - edges[:, 0]
    wavelength = radar.waveform.wavelength
    # Only one Fresnel zone of a long edge adds in phase; off broadside a pattern sinc^2 remains.
    length = np.linalg.norm(span, axis=1)
    zone = np.minimum(length, np.sqrt(0.5 * wavelength * r))
    along = np.einsum("ij,ij->i", span, look) * zone / np.where(length > 0, length, 1.0)
    sigma = zone**2 / np.pi * np.sinc(2.0 * along / wavelength) ** 2
    power = radar.power * gain * wavelength**2 * sigma / ((4 * np.pi) ** 3 * r**4)
    at = int(np.argmax(power))
    name = geometry.facets.body_names[geometry.facets.body[geometry.plane_edge_facet[at]]]
    how = f"fringe field of the strongest edge, L^2/pi broadside, without occlusion: on {name} at {r[at]:.1f} m"
    return Entry(float(db(power[at] / weakest)), "bound", how)


def _around(geometry: Geometry, points: Points, radar: Radar, settings: Any, model: Any, weakest: float) -> Entry:
    """Return the entry of diffraction at single wedges on the way to targets given by their RCS."""
    if not len(points.body):
        return Entry(NOTHING, "exact", "no target is given by its RCS")
    if model.diffraction:
        return Entry(NOTHING, "exact", "modelled: single wedges, UTD")
    found = paths_over_wedges(geometry, points, radar, radar.waveform.carrier)
    if not len(found.delay):
        return Entry(NOTHING, "estimate", "no wedge stands near the way to a target")
    level = peak(found, np.ones(len(found.delay), bool), radar, settings)
    return Entry(float(db(max(level, 1e-40) / weakest)), "estimate", "strongest cell of the diffracted returns (UTD)")


def _diffuse(geometry: Geometry, radar: Radar, model: Any, weakest: float) -> Entry:
    """Return the entry of diffuse scattering, of the strongest range cell: the power that roughness takes from the
    specular reflection (Ament, Proc. IRE 41, 1953), scattered by Lambert's law."""
    f = geometry.facets
    m = f.materials
    modelled = scatters_diffusely(f, model)
    rough = ((m.roughness > 0.0) & ~modelled)[f.material]
    if modelled.any() and not rough.any():
        return Entry(NOTHING, "exact", "modelled: what the radar sees directly of rough surfaces")
    if not rough.any():
        return Entry(UNKNOWN, "none", "no material states a roughness")
    rng = np.random.default_rng(0)
    rows = np.flatnonzero(rough)
    points, facet, weight = _samples(geometry, rows, np.asarray(radar.position), rng)
    look, r, gain = _gain(radar, points)
    cosine = np.abs(np.einsum("ij,ij->i", look, geometry.normal[facet]))
    row = f.material[facet]
    k = 2.0 * np.pi / radar.waveform.wavelength
    flat = np.abs(coefficients_array(m.kind[row], m.eps[row], m.thickness[row], 0.0 * cosine, cosine, k)[:, :2]) ** 2
    lost = 1.0 - np.exp(-4.0 * (k * m.roughness[row] * cosine) ** 2)
    sigma = 4.0 * flat.mean(axis=1) * lost * cosine**2 * weight
    power = radar.power * gain * radar.waveform.wavelength**2 * sigma / ((4 * np.pi) ** 3 * r**4)
    cell = np.floor(r / radar.waveform.range_resolution).astype(int)
    summed = np.bincount(cell, power)
    best = int(np.argmax(summed))
    where = best * radar.waveform.range_resolution
    how = f"power lost by roughness, scattered by Lambert's law, in the strongest range cell ({where:.1f} m), all rates"
    return Entry(float(db(max(summed[best], 1e-40) / weakest)), "estimate", how)


def _samples(
    geometry: Geometry, rows: NDArray[np.int64], eye: Floats, rng: np.random.Generator
) -> tuple[Floats, NDArray[np.int64], Floats]:
    """Return points on facets, their facets and the area [m^2] that each represents; the ground is sampled in rings
    about the radar, denser nearby."""
    f = geometry.facets
    ground = np.isin(f.body[rows], np.flatnonzero(f.role == MIRROR))
    points, facet, weight = [], [], []
    if (~ground).any():
        some = rng.choice(rows[~ground], size=4000, p=geometry.area[rows[~ground]] / geometry.area[rows[~ground]].sum())
        bary = rng.dirichlet(np.ones(3), size=len(some))
        points.append(np.einsum("ni,nij->nj", bary, f.vertices[some]))
        facet.append(some)
        weight.append(np.full(len(some), geometry.area[rows[~ground]].sum() / len(some)))
    if ground.any():
        one = rows[ground][0]
        radius = np.geomspace(0.2, 80.0, 400)
        angle = np.radians(np.arange(-180.0, 180.0, 3.0))
        step = np.gradient(radius)
        x, y = (np.outer(radius, g(angle)).ravel() for g in (np.cos, np.sin))
        z = np.full(x.size, float(geometry.first[one, 2]))
        points.append(np.column_stack([eye[0] + x, eye[1] + y, z]))
        facet.append(np.full(x.size, one))
        weight.append(np.repeat(radius * step, len(angle)) * np.radians(3.0))
    return np.concatenate(points), np.concatenate(facet), np.concatenate(weight)


def _tessellation(
    paths: Paths, geometry: Geometry, bodies: Collection[Body], radar: Radar, settings: Any, weakest: float
) -> Entry:
    """Return the entry of smoothed facets: the change of the strongest echo if they are flat."""
    estimated = {b.name: b.geometry for b in bodies if b.geometry.crease_deg is not None}
    if not estimated:
        return Entry(NOTHING, "exact", "no body has estimated normals")
    name, phase, changed = strongest_bend(paths, geometry, estimated, radar, settings)
    if not name:
        return Entry(NOTHING, "exact", "no echo comes from smoothed facets")
    how = f"facets of {name} are taken as smooth: {phase:.2g} rad (rms) from flat ones, of its strongest cell"
    return Entry(float(db(changed / weakest)), "estimate", how)


def _motion(paths: Paths, facets: Facets, radar: Radar) -> Entry:
    """Return the entry of changes of rate within a frame: for crossing and turning bodies the phase deviates by at most
    k a T^2 / 4, a being the radial acceleration."""
    frame = radar.waveform.frame_duration
    if not len(paths.delay):
        return Entry(NOTHING, "exact", "no path")
    size = np.abs(paths.amplitude)
    strong = np.flatnonzero(size > 1e-3 * size.max())
    nearest = np.full(len(paths.trajectories.kind), np.inf)
    np.minimum.at(nearest, paths.trajectory[strong], np.maximum(0.5 * paths.length[strong], 0.5))
    taken = np.flatnonzero(np.isfinite(nearest))
    body, away = paths.trajectories.body[taken], paths.trajectories.departure[taken].astype(float)
    used = body >= 0
    body = np.maximum(body, 0)
    used &= facets.role[body] != MIRROR
    relative = facets.velocity[body] - np.asarray(radar.velocity)
    along = np.einsum("ndi,ni->nd", relative, away)
    across = np.einsum("ndi,ndi->nd", relative, relative) - along**2
    turning = np.linalg.norm(facets.spin, axis=1)[body]
    # Lever arm of turning bodies: 2.5 m, of a vehicle (not measured).
    bend = np.where(used, across / nearest[taken, None] + turning**2 * 2.5, 0.0).max(axis=1)
    phase = 2.0 * np.pi / radar.waveform.wavelength * bend * frame**2 / 4.0
    worst = float(phase.max(initial=0.0))
    how = f"at most {worst:.2g} rad of unmodelled phase over the frame; level relative to the echo that has it"
    return Entry(float(db(max(worst, 1e-15) ** 2)), "bound", how)
