"""The ledger of unmodelled effects: an estimate or bound of each against the weakest detection, or 'unknown'."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.channel.diffuse import mean_sigma0
from raychan.parallel import parallel_map
from raychan.radar.radar import Radar
from raychan.records import Facets, Paths, Points
from raychan.run.clutter import laws_of, scatters_diffusely, share_of_distance
from raychan.run.explanation.labels import alike
from raychan.run.ledger.coming_back import coming_back
from raychan.run.ledger.going_on import going_on, shorter
from raychan.run.ledger.intra_frame import intra_frame
from raychan.run.ledger.tessellation import coarsest, strongest_bend
from raychan.run.ledger.waves import creeping_waves, over_band
from raychan.run.ledger_entry import NOTHING, SEEN, UNKNOWN, Entry
from raychan.run.mechanisms import interactions, layers, layers_at_once, least_detection, peak
from raychan.run.solver import paths_over_wedges
from raychan.tracing.diffuse_patches import PatchSize, visible_patches
from raychan.tracing.legs import mirrors_left_out
from raychan.units import C0, db
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
    carried: NDArray[np.bool_] | None = None,
) -> dict[str, Entry]:
    """Return the unmodelled effects by name, each against the weakest detection's power [W]; where nothing was detected
    (0), further bounces against that of the weakest detection possible, and the others as unknown.

    Args: settings, the scene's processing; model, what was modelled; bodies of the scene; which of them (b,) are
    carried on over the frame.
    """
    if not weakest > 0.0 or not len(geometry.facets.vertices):
        why = "the scene has no bodies" if weakest > 0.0 else "nothing was detected"
        found = {name: Entry(UNKNOWN, "none", why) for name in _NAMES}
        if weakest > 0.0:
            # A receiver elsewhere hears the transmitter all the same.
            found["intra-frame motion"] = intra_frame(paths, geometry.facets, radar, carried)
        if len(geometry.facets.vertices):
            # A corner whose last bounce is left out may be all that a scene has.
            least = least_detection(radar, settings)
            found["further bounces"] = _further(paths, geometry, radar, settings, model, least)
        return found
    # Those that take longest first: at the end threads wait for the last one.
    entries: dict[str, Callable[[], Entry]] = {
        "further bounces": lambda: _further(paths, geometry, radar, settings, model, weakest),
        "transmission": lambda: _transmission(paths, geometry.facets, radar, settings, model, weakest),
        "diffraction to point targets": lambda: _around(geometry, points, radar, settings, model, weakest),
        "diffuse scattering": lambda: _diffuse(geometry, radar, model, weakest),
        "creeping waves": lambda: creeping_waves(paths, geometry, points, radar, settings, weakest),
        "change over the band": lambda: over_band(paths, geometry, radar, settings, weakest),
        "tessellation": lambda: _tessellation(paths, geometry, bodies, radar, settings, weakest),
        "intra-frame motion": lambda: intra_frame(paths, geometry.facets, radar, carried),
        "diffraction": lambda: _diffraction(geometry, radar, weakest),
        "further mirrors": lambda: _mirrors(geometry, radar, model),
        "range migration": lambda: Entry(NOTHING, "exact", "kept in the cube to better than -100 dB of its peak"),
    }
    found = dict(zip(entries, parallel_map(lambda entry: entry(), list(entries.values())), strict=True))
    if radar.rx_position is not None:
        aside = Entry(UNKNOWN, "none", "not estimated for receivers elsewhere than the transmitter")
        found |= dict.fromkeys(_MONOSTATIC, aside)
    return {name: found[name] for name in _NAMES}


# Sectors [rad] and rings of rough ground: finer against 36,000 rays at most, about 0.1 s (not measured by a command).
_SECTOR, _RINGS = np.radians(5.0), 500
_CUBIC = 0.01  # rad (rms) that facets lie off a smoother surface: from there on it is told
_NEAR = 80.0  # m: the strongest range cell of rough ground lies nearer, by 1 / r^3 (not measured)
_FOLDED = 2.0  # unambiguous ranges: what is farther adds at most an eighth, by 1 / r^3
_NAMES = (
    "further bounces",
    "further mirrors",
    "transmission",
    "diffraction",
    "diffraction to point targets",
    "diffuse scattering",
    "creeping waves",
    "change over the band",
    "tessellation",
    "range migration",
    "intra-frame motion",
)


_MONOSTATIC = (
    "diffraction",
    "diffraction to point targets",
    "diffuse scattering",
)
"""Effects whose estimates take the way back to be the way out."""


def _further(paths: Paths, geometry: Geometry, radar: Radar, settings: Any, model: Any, weakest: float) -> Entry:
    """Return the entry of further bounces, extrapolated by the ratio of the last two orders; where that tells of
    nothing above the weakest detection, but waves come back just then, of unknown level."""
    found = _by_ratio(paths, geometry, radar, settings, model.max_bounces, weakest)
    if isinstance(found.level_db, float) and found.level_db > 0.0:
        return found
    return _returning(paths, geometry, radar, model) or found


def _returning(paths: Paths, geometry: Geometry, radar: Radar, model: Any) -> Entry | None:
    """Return the entry of waves that come back by one bounce more than is modelled; None where there are none."""
    over = coming_back(paths, geometry, model.max_bounces, C0 / radar.waveform.middle)
    how = f"waves over {' > '.join(over)} come back by {model.max_bounces + 1} interactions (model.max_bounces)"
    return Entry(UNKNOWN, SEEN, how) if over else None


def _by_ratio(paths: Paths, geometry: Geometry, radar: Radar, settings: Any, bounces: int, weakest: float) -> Entry:
    met, chains = interactions(paths), alike(paths)
    goes = going_on(paths, geometry, met == bounces, chains)
    if not goes.any():
        return Entry(UNKNOWN, "none", f"no wave of {bounces} interactions meets a surface more")
    if bounces == 1:
        how = "waves meet a second surface, but one bounce is modelled (model.max_bounces): nothing to extrapolate from"
        return Entry(UNKNOWN, SEEN, how)
    last, before = (peak(paths, rows, radar, settings) for rows in (goes, shorter(paths, goes, chains)))
    if before == 0.0:
        how = f"no path has {bounces - 1} interactions over the same bodies: nothing to extrapolate from"
        return Entry(UNKNOWN, "none", how)
    if not weakest > 0.0:
        return Entry(UNKNOWN, "none", "nothing was detected, and without noise nothing says what may be")
    ratio = min(last / before, 1.0)
    how = (
        f"strongest cell of waves of {bounces} interactions that meet a surface more ({db(last / weakest):.0f} dB) "
        f"times their ratio to those of {bounces - 1} over the same bodies ({db(ratio):.0f} dB)"
    )
    return Entry(float(db(last * ratio / weakest)), "estimate", how)


def _mirrors(geometry: Geometry, radar: Radar, model: Any) -> Entry:
    """Return the entry of plane faces that might be mirrors but are not taken as such, seen from either end."""
    ends = [end for end in (radar.position, radar.rx_position) if end is not None]
    left, every = max(mirrors_left_out(geometry, np.asarray(end, float), model.max_bounces - 1) for end in ends)
    if not left:
        return Entry(NOTHING, "exact", "no plane face that might be a mirror is taken as none")
    how = f"{left} of {every} large plane faces, those that look smallest from the radar, mirror no wave as a whole"
    return Entry(UNKNOWN, SEEN, how)


def _transmission(paths: Paths, facets: Facets, radar: Radar, settings: Any, model: Any, weakest: float) -> Entry:
    """Return the entry of transmissions through further layers, extrapolated by the ratio of the last two orders."""
    passes = layers(paths)
    most = int(passes.max(initial=0))
    # What "auto" leaves out stands in the ledger's "model".
    closed = model.max_transmissions == 0 and model.mode != "auto"
    if closed and (facets.materials.thickness[facets.material] > 0.0).any():
        return Entry(UNKNOWN, "none", "model.max_transmissions is 0: what stands behind thin layers is not traced")
    if most == 0:
        return Entry(NOTHING, "exact", "no path passes a thin layer")
    at_once = int(layers_at_once(paths).max())
    if at_once < model.max_transmissions:
        how = f"no stretch of a path passes more than {at_once} of the {model.max_transmissions} layers that it may"
        return Entry(NOTHING, "exact", how)
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
    wavelength = C0 / radar.waveform.middle
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
    """Return the entry of diffuse scattering, of the strongest range cell: the mean return of rough surfaces that are
    not modelled so, and of those modelled, what lies beyond the unambiguous range, folded into it."""
    f, wave = geometry.facets, radar.waveform
    modelled, laws = scatters_diffusely(f, model), laws_of(f)
    rough = modelled | (f.materials.roughness > 0.0) | np.array([law is not None for law in laws], bool)
    if not rough[f.material].any():
        return Entry(UNKNOWN, "none", "no material states a roughness")
    cell, reach = wave.range_resolution, wave.unambiguous_range
    eye = np.asarray(radar.position, float)
    farthest = _FOLDED * reach if modelled.any() else min(reach, _NEAR)
    step = max(cell, farthest / _RINGS)
    patches = visible_patches(geometry, eye, rough, PatchSize(step, _SECTOR, farthest, share_of_distance(laws, rough)))
    look, r, gain = _gain(radar, patches.point)
    row = f.material[patches.facet]
    left = ~modelled[row] | (r > reach)
    if not left.any():
        how = "modelled: what" if modelled.any() else "nothing that"
        return Entry(NOTHING, "exact", f"{how} the radar sees directly of rough surfaces")
    cosine = np.abs(np.einsum("ij,ij->i", look, geometry.normal[patches.facet]))
    sigma = mean_sigma0(f, row, cosine, wave.middle, laws) * patches.area * np.exp(-4.0 * f.attenuation * r)
    power = radar.power * gain * (C0 / wave.middle) ** 2 * sigma / ((4 * np.pi) ** 3 * r**4)
    summed = np.bincount((r[left] % reach / step).astype(int), power[left]) * (cell / step)
    best = int(np.argmax(summed))
    far = f" of what lies beyond the unambiguous range of {reach:.4g} m," if (r[left] > reach).all() else ""
    how = f"mean diffuse return of rough surfaces,{far} in the strongest range cell ({best * step:.1f} m), all rates"
    return Entry(float(db(max(summed[best], 1e-40) / weakest)), "estimate", how)


def _tessellation(
    paths: Paths, geometry: Geometry, bodies: Collection[Body], radar: Radar, settings: Any, weakest: float
) -> Entry:
    """Return the entry of facets: the change of the strongest echo of smoothed ones if they are flat; where all normals
    are known, unknown if cubic facets differ from them."""
    known = {b.name: b.geometry for b in bodies if b.geometry.crease_deg is None}
    estimated = {b.name: b.geometry for b in bodies if b.name not in known}
    coarse, off = coarsest(known, radar)
    other = f"facets of {coarse} lie {off:.2g} rad (rms) off a smoother surface of the same corners and normals"
    name, phase, changed = strongest_bend(paths, geometry, estimated, radar, settings)
    if name:
        more = f"; {other}, not estimated" if off > _CUBIC else ""
        how = f"facets of {name} are taken as smooth: {phase:.2g} rad (rms) from flat ones, of its strongest cell{more}"
        return Entry(float(db(changed / weakest)), "estimate", how)
    if off > _CUBIC:
        return Entry(UNKNOWN, "none", f"{other}: what a finer mesh would change is not estimated")
    return Entry(
        NOTHING, "exact", "no echo comes from smoothed facets" if estimated else "no body has estimated normals"
    )
