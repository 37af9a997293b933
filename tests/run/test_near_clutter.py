"""The mean return of rough surfaces near the radar is that of the radar equation, integrated over the surface, however
steep the law of scattering."""

import numpy as np
import pytest

import raychan as rc
from raychan.channel.diffuse import mean_sigma0
from raychan.em.diffuse import Diffuse
from raychan.run.clutter import laws_of, patch_size, share_of_distance
from raychan.tracing.diffuse_patches import visible_patches
from raychan.world.geometry import geometry_of

WAVE = rc.Waveform(carrier=24e9, bandwidth=150e6, chirp_duration=30e-6, n_chirps=8, n_samples=32)
LAWS = [Diffuse("constant", -15.0), Diffuse("lambert", -10.0), Diffuse("lobe", -10.0), Diffuse("lobe", -10.0, 10)]


def patches_of(body, end):
    """Return the patches of a body that a radar sees from a point, and the mean sigma-nought of each over R^4."""
    radar = rc.Radar(WAVE, position=end, antenna=rc.IsotropicAntenna(front=False))
    geometry = geometry_of(rc.Scene(bodies=[body], radar=radar))
    laws, which = laws_of(geometry.facets), np.array([True] * len(geometry.facets.materials.kind))
    patches = visible_patches(geometry, np.array(end), which, patch_size(radar, share_of_distance(laws, which)))
    look = patches.point - end
    away = np.linalg.norm(look, axis=1)
    cosine = np.abs(np.einsum("ij,ij->i", look, geometry.normal[patches.facet])) / away
    material = geometry.facets.material[patches.facet]
    return patches, away, mean_sigma0(geometry.facets, material, cosine, 24e9, laws) / away**4


@pytest.mark.parametrize("law", LAWS, ids=lambda law: f"{law.law}-{law.exponent}")
def test_the_mean_return_of_near_ground_is_the_integral_over_it(law):
    ground = rc.Body(name="ground", shape="ground", params={"size": 30.0}, material=rc.Material(eps_r=3.2, diffuse=law))
    patches, away, level = patches_of(ground, (0.0, 0.0, 1.0))
    for low, high in ((1.0, 2.0), (3.0, 6.0), (6.0, 12.0)):
        # From edge to edge of rings; half of a ring's area lies on either side of its middle.
        middle, first = np.unique(away.round(9), return_index=True)
        sectors = np.isclose(away[:, None], middle[None, :5]).sum(axis=0).max()
        edges = np.sqrt(1.0 + np.append(0.0, np.cumsum(patches.area[first] * sectors)) / np.pi)
        near, far = edges[np.searchsorted(edges, [low, high])]
        r = np.linspace(near, far, 20_001)
        sigma = law.sigma0(1.0 / r, 1.0 / r, 2.0 / r**2 - 1.0)
        asked = np.trapezoid(2.0 * np.pi * sigma / r**3, r)
        got = (level * patches.area)[(away > near) & (away < far)].sum()
        assert 10.0 * np.log10(got / asked) == pytest.approx(0.0, abs=0.06)


def test_the_mean_return_of_a_near_wall_is_the_integral_over_it():
    law = Diffuse("lobe", -10.0, 10)
    stone = rc.Material(eps_r=5.0, diffuse=law)
    size = {"length": 0.2, "width": 6.0, "height": 4.0}
    wall = rc.Body(name="wall", shape="box", params=size, position=(0.85, 0.0, 0.0), material=stone)
    patches, _, level = patches_of(wall, (0.0, 0.0, 2.0))
    y, z = np.meshgrid(np.linspace(-3.0, 3.0, 601), np.linspace(-2.0, 2.0, 401), indexing="ij")
    r = np.sqrt(0.75**2 + y**2 + z**2)
    asked = np.trapezoid(
        np.trapezoid(law.sigma0(0.75 / r, 0.75 / r, 1.125 / r**2 - 1.0) / r**4, dx=0.01, axis=1), dx=0.01
    )
    assert 10.0 * np.log10((level * patches.area).sum() / asked) == pytest.approx(0.0, abs=0.06)
