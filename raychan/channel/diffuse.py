"""Paths of diffuse scattering: what patches of rough surfaces return, as speckle.

Each patch returns a complex Gaussian amplitude of variance sigma-nought times its area, so that the samples of any
number of patches have the statistics of a surface of many more scatterers (Rayleigh); a texture makes them K.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.channel.ends import RadarEnds, at_start, paths_record, rx_fields
from raychan.em.diffuse import Diffuse, texture
from raychan.em.fresnel import coefficients_array
from raychan.geometry.patches import Patches
from raychan.poses import theta_phi
from raychan.records import DIFFUSE, Facets, Paths
from raychan.units import C0

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


def diffuse_paths(
    patches: Patches,
    facets: Facets,
    normal: Floats,
    radar: RadarEnds,
    frequency: float,
    laws: Sequence[Diffuse | None],
    rng: np.random.Generator,
) -> Paths:
    """Return the returns of patches to a monostatic radar: a path each, straight there and back.

    Args: normal (f, 3) of all facets; frequency [Hz]; laws of each material, None for Lambert's law with the share that
    its roughness takes from the mirror; rng of speckle and texture.
    """
    end = np.asarray(radar.position, float)
    way = patches.point - end
    distance = np.linalg.norm(way, axis=1)
    look = way / np.maximum(distance, 1e-9)[:, None]
    cosine = np.abs(np.einsum("ij,ij->i", look, normal[patches.facet]))
    material = facets.material[patches.facet] if len(patches.facet) else np.zeros(0, np.int32)
    sigma, cross = mean_sigma0(facets, material, cosine, frequency, laws), np.zeros(len(cosine))
    for row in np.unique(material):
        some, law = material == row, laws[row]
        if law is None:
            continue
        squares = np.floor(patches.point[some] / law.texture_m).astype(np.int64)
        sigma[some] *= texture(law.k_shape, squares, rng)
        cross[some] = 0.0 if law.cross_db is None else 10.0 ** (-0.1 * law.cross_db)
    speckle = rng.standard_normal((len(cosine), 2, 2)) @ np.array([1.0, 1.0j]) * np.sqrt(0.5)
    air = np.exp(-2.0 * facets.attenuation * distance) if facets.attenuation else 1.0
    size = C0 / frequency * np.sqrt(sigma * patches.area) / ((4.0 * np.pi) ** 1.5 * np.maximum(distance, 1e-9) ** 2)
    body = facets.body[patches.facet] if len(patches.facet) else np.zeros(0, np.int32)
    arm = patches.point - facets.origin[body]
    moves = facets.velocity[body] + np.cross(facets.spin[body], arm) - np.asarray(radar.velocity, float)
    received = {
        name: size * (_coupled(radar, rx_field, look, speckle, np.sqrt(cross)) * air)
        for name, rx_field in zip(("amplitude", "cross"), rx_fields(radar), strict=False)
    }
    rate = 2.0 * np.einsum("ij,ij->i", moves, look)
    return paths_record(radar).of(
        **at_start(facets, radar, {"length": 2.0 * distance, **received, "length_rate": rate}),
        departure=look,
        arrival=look,
        body=body[:, None].astype(np.int16),
        part=(facets.part[patches.facet] if len(body) else body)[:, None].astype(np.int16),
        kind=np.full((len(body), 1), DIFFUSE, np.int8),
        vertices=patches.point[:, None].astype(np.float32),
        body_names=facets.body_names,
        part_names=facets.part_names,
        tx=end,
        rx=end,
    )


def mean_sigma0(
    facets: Facets, material: NDArray[np.int32], cosine: Floats, frequency: float, laws: Sequence[Diffuse | None]
) -> Floats:
    """Return the mean sigma-nought (n,) [m^2/m^2] of surfaces back to a monostatic radar.

    Args: material (n,) of each surface; cosine (n,) of its incidence angle; frequency [Hz]; laws of each material, None
    for Lambert's law with the share that its roughness takes from the mirror.
    """
    sigma = np.zeros(len(cosine))
    for row in np.unique(material):
        some, law = material == row, laws[row]
        if law is None:
            sigma[some] = _lambert_of_roughness(facets, row, cosine[some], frequency)
        else:
            # Back to the radar the scattered wave is 180 deg minus twice the incidence angle off the mirrored one.
            sigma[some] = law.sigma0(cosine[some], cosine[some], 2.0 * cosine[some] ** 2 - 1.0)
    return sigma


def _lambert_of_roughness(facets: Facets, row: int, cosine: Floats, frequency: float) -> Floats:
    """Return sigma-nought (n,) by Lambert's law of the power that roughness takes from the mirrored wave.

    Source: coherent loss exp(-4 (k s cos)^2), Ament, Proc. IRE 41, 1953.
    """
    m, k = facets.materials, 2.0 * np.pi * frequency / C0
    one = np.full(len(cosine), row)
    smooth = coefficients_array(m.kind[one], m.eps[one], m.thickness[one], 0.0 * cosine, cosine, k)[:, :2]
    lost = 1.0 - np.exp(-4.0 * (k * m.roughness[one] * cosine) ** 2)
    return np.asarray(4.0 * (np.abs(smooth) ** 2).mean(axis=1) * lost * cosine**2)


def _coupled(radar: RadarEnds, rx_field: Any, look: Floats, speckle: Complexes, cross: Floats) -> Complexes:
    """Return what a patch couples (n,) from the transmitting to a receiving antenna in directions (n, 3).

    Args: rx_field of the receiving antenna; speckle (n, 2) of the co- and the cross-polarised return; cross (n,)
    amplitude of the latter over the former.
    """
    theta, phi = theta_phi(look)
    sent, heard = (np.asarray(f(look)) for f in (radar.tx_field, rx_field))
    v_in, h_in, v_out, h_out = (np.einsum("ij,ij->i", e, axis) for e in (sent, heard) for axis in (theta, phi))
    same = v_in * v_out + h_in * h_out
    other = cross * (v_in * h_out + h_in * v_out)
    return np.asarray(speckle[:, 0] * same + speckle[:, 1] * other)
