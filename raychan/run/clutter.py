"""Clutter of a run: the diffuse returns of rough surfaces, drawn anew for each seed."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from raychan.channel.diffuse import diffuse_paths
from raychan.channel.paths import nothing
from raychan.em.diffuse import Diffuse
from raychan.radar.radar import Radar
from raychan.records import Facets, Paths
from raychan.tracing.diffuse_patches import PatchSize, visible_patches
from raychan.units import C0
from raychan.world.errors import SceneError
from raychan.world.geometry import Geometry

_RANGE_CELLS = 0.5  # side of a patch in range cells: a share of sinc^2(0.25), 0.9 dB, is smeared (not measured)
_RATE_CELLS = 0.5  # the same across, of what the radar's own motion spreads over a patch
_WIDEST = math.radians(2.0)  # of a patch seen from a radar at rest
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


def clutter_of(geometry: Geometry, radar: Radar, model: Any, rng: np.random.Generator) -> Paths:
    """Return the diffuse returns of a scene for a monostatic radar, none where no material scatters diffusely.

    Only what the radar sees directly returns: no wave reaches a rough surface over a mirror or through a layer.
    Raises: SceneError for receivers elsewhere.
    """
    which = scatters_diffusely(geometry.facets, model)
    if not which.any():
        return nothing(geometry.facets, radar)
    if radar.rx_position is not None:
        raise SceneError(
            "diffuse returns to receivers elsewhere",
            key="model.diffuse",
            value=model.diffuse,
            allowed="'off' where radar.rx_position is given",
        )
    patches = visible_patches(geometry, np.asarray(radar.position, float), which, patch_size(radar))
    return diffuse_paths(
        patches, geometry.facets, geometry.normal, radar, radar.waveform.middle, laws_of(geometry.facets), rng
    )


def patch_size(radar: Radar) -> PatchSize:
    """Return the size of patches that a radar does not resolve: by range, by rate when it moves, by its array."""
    wave = radar.waveform
    speed = float(np.linalg.norm(radar.velocity))
    angle = _WIDEST if speed == 0.0 else min(_WIDEST, _RATE_CELLS * wave.rate_resolution / speed)
    span = float(np.ptp(radar.virtual_elements, axis=0).max())
    if span > 0.0:
        angle = min(angle, 0.25 * C0 / wave.carrier / span)
    return PatchSize(_RANGE_CELLS * wave.range_resolution, max(angle, 1e-3), _BEYOND * wave.unambiguous_range)
