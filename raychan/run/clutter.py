"""Clutter of a run: the diffuse returns of rough surfaces, drawn anew for each seed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.channel.diffuse import diffuse_paths
from raychan.channel.paths import nothing
from raychan.em.diffuse import Diffuse
from raychan.radar.pattern import characteristics
from raychan.radar.radar import Radar
from raychan.records import Facets, Paths
from raychan.tracing.diffuse_patches import Apart, PatchSize, visible_patches
from raychan.units import C0, undb
from raychan.world.errors import SceneError
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]

_RANGE_CELLS = 0.5  # side of a patch in range cells: a share of sinc^2(0.25), 0.9 dB, is smeared (not measured)
_RATE_CELLS = 0.5  # the same of what motion spreads over a patch
_ARRAY_CELLS = 0.25  # wavelengths by which the ways from its ends to those of the array differ (not measured)
_WIDEST = math.radians(2.0)  # across the range, before motion, array and beam ask for less (not measured)
_MIDDLE_DB = 0.05  # of a patch's mean return: by so much it may differ from that by law and distance at its middle
_LEAST_SHARE = 0.02  # of the distance: without it ground of a lobe of exponent 50 has 400,000 patches, not 100,000
_OF_ROUGHNESS = 4  # power of the cosine in the law of a slight roughness: of Lambert's law, and of the share lost
_TOLD = 1.1  # times as large as asked for: of patches so large a line tells (not measured)
_BEYOND = 1.0  # of the unambiguous range: what lies farther folds, and is left out; the ledger says with what level


def scatters_diffusely(facets: Facets, model: Any) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Return which materials (m,) are modelled as scattering diffusely, by the scene's `model.diffuse`."""
    m = facets.materials
    count = len(m.kind)
    if model.diffuse == "off":
        return np.zeros(count, bool)
    stated = np.array([law is not None for law in laws_of(facets)], bool)
    return stated | (m.roughness > 0.0) if model.diffuse == "rough" else stated


def laws_of(facets: Facets) -> tuple[Diffuse | None, ...]:
    """Return the law of each material, None where none is stated."""
    stated = facets.materials.diffuse or (None,) * len(facets.materials.kind)
    return tuple(law if isinstance(law, Diffuse) else None for law in stated)


def clutter_of(geometry: Geometry, radar: Radar, model: Any, rng: np.random.Generator) -> tuple[Paths, tuple[str, ...]]:
    """Return the diffuse returns of a scene for a monostatic radar, none where no material scatters diffusely, and
    lines on patches that are too large.

    Only what the radar sees directly returns: no wave reaches a rough surface over a mirror or through a layer.
    Raises: SceneError for receivers elsewhere.
    """
    which = scatters_diffusely(geometry.facets, model)
    if not which.any():
        return nothing(geometry.facets, radar), ()
    if radar.rx_position is not None:
        raise SceneError(
            "diffuse returns to receivers elsewhere",
            key="model.diffuse",
            value=model.diffuse,
            allowed="'off' where radar.rx_position is given",
        )
    laws = laws_of(geometry.facets)
    size = patch_size(radar, share_of_distance(laws, which))
    patches = visible_patches(geometry, np.asarray(radar.position, float), which, size)
    paths = diffuse_paths(patches, geometry.facets, geometry.normal, radar, radar.waveform.middle, laws, rng)
    if patches.grown < _TOLD:
        return paths, ()
    line = (
        f"clutter: too many patches; some are {patches.grown:.2g} times as large as range cell, rate, array and beam "
        "ask for, and single cells may be off (radar.waveform, radar.antenna)"
    )
    return paths, (line,)


def share_of_distance(laws: Sequence[Diffuse | None], which: np.ndarray[Any, np.dtype[np.bool_]]) -> float:
    """Return over which share of their distance patches may extend along the range, by the steepest law of the
    materials `which` (m,) scatter.

    The cosine of incidence on a plane is its distance over R, and the area grows with R^2: a return of the form
    (R^2)^-k differs from its mean over a share x of R by k (k + 1) x^2 / 6, the second term of its series: at the
    least share by 0.1 dB of a lobe of exponent 15, and 0.7 dB of one of 50.
    """
    steepest = max(_OF_ROUGHNESS if law is None else law.power for law, some in zip(laws, which, strict=True) if some)
    k = 0.5 * (4 + steepest)
    return max(float(np.sqrt(6.0 * (undb(_MIDDLE_DB) - 1.0) / (k * (k + 1.0)))), _LEAST_SHARE)


def patch_size(radar: Radar, share: float) -> PatchSize:
    """Return the size of patches that a radar does not resolve: by range, by rate where it or they move, by its array,
    and over which its gain is even; share of their distance that they extend over at most."""
    wave, span = radar.waveform, np.ptp(radar.virtual_elements, axis=0)
    cosines = np.divide(_ARRAY_CELLS * C0 / wave.carrier, span, out=np.full(3, np.inf), where=span > 0.0)
    velocity = np.asarray(radar.velocity, float)
    apart = Apart(radar.axes, velocity, _RATE_CELLS * wave.rate_resolution, cosines, even_gain(radar))
    return PatchSize(_RANGE_CELLS * wave.range_resolution, _WIDEST, _BEYOND * wave.unambiguous_range, share, apart)


def even_gain(radar: Radar) -> Floats:
    """Return over which angles (2,) [rad], along theta and phi of the antenna, patches may extend for its gain.

    A beam of half-power width b is about exp(-4 ln 2 x^2 / b^2): the product g of both antennas' has at its peak
    g" / g = 8 ln 2 (1 / b_t^2 + 1 / b_r^2), and its mean over x differs from its middle by g" x^2 / 24.
    """
    known = radar.kept.setdefault(even_gain, [])
    if not known:
        beams = [characteristics(antenna) for antenna in {id(x): x for x in (radar.tx, radar.rx)}.values()]
        widths = np.radians([[beam.hpbw_v_deg, beam.hpbw_h_deg] for beam in (beams[0], beams[-1])])
        known.append(np.sqrt(3.0 * (undb(_MIDDLE_DB) - 1.0) / np.log(2.0) / (widths**-2.0).sum(axis=0)))
    return np.asarray(known[0])
