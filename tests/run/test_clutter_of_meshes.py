"""Clutter of a plane is the same, and takes as few patches, as mesh of large triangles and as ground."""

import numpy as np
import pytest
import trimesh

import raychan as rc
from raychan.em.diffuse import Diffuse
from raychan.run.clutter import laws_of, patch_size, share_of_distance
from raychan.tracing.diffuse_patches import visible_patches
from raychan.world.geometry import geometry_of

HALF = 70.0
CORNERS = [[-HALF, -HALF, 0.0], [HALF, -HALF, 0.0], [HALF, HALF, 0.0], [-HALF, HALF, 0.0]]
LAW = Diffuse("gamma", -15.0)
STONE = rc.Material(eps_r=5.0, diffuse=LAW)
WAVE = rc.Waveform(carrier=77e9, bandwidth=150e6, chirp_duration=40e-6, n_chirps=2, n_samples=128)
GROUND = rc.Body("ground", shape="ground", params={"size": 2.0 * HALF}, material=STONE)


def plane(inner=()):
    """Return a mesh of the ground's square, of two triangles or about an inner point."""
    faces = [[i, (i + 1) % 4, 4] for i in range(4)] if inner else [[0, 1, 2], [0, 2, 3]]
    return rc.Body("plane", mesh=trimesh.Trimesh(CORNERS + [[*inner, 0.0]] * bool(inner), faces), material=STONE)


def returned(body, at, antenna):
    """Return distances (n,) [m] of patches that a radar at a place sees, and their mean returns but for constants."""
    radar = rc.Radar(WAVE, position=at, antenna=antenna)
    geometry = geometry_of(rc.Scene(bodies=[body], radar=radar))
    laws, which = laws_of(geometry.facets), np.array([True] * len(geometry.facets.materials.kind))
    patches = visible_patches(geometry, np.array(at), which, patch_size(radar, share_of_distance(laws, which)))
    assert patches.grown == 1.0
    way = patches.point - at
    away = np.linalg.norm(way, axis=1)
    gain = (np.abs(radar.tx_field(way / away[:, None])) ** 2).sum(axis=1) ** 2
    return away, gain * LAW.sigma0(at[2] / away, at[2] / away, 2.0 * (at[2] / away) ** 2 - 1.0) * patches.area / away**4


def cell(away, centre, width):
    """Return the weight of distances in a window about one [m]."""
    return np.where(np.abs(away - centre) < width, np.cos(0.5 * np.pi * (away - centre) / width) ** 2, 0.0)


@pytest.mark.parametrize("inner", [(), (20.0, -7.0)], ids=["two triangles", "four triangles"])
@pytest.mark.parametrize("at", [(0.0, 0.0, 1.0), (4.0, -9.0, 3.0)], ids=["foot on an edge", "foot inside"])
def test_the_mean_return_of_a_plane_mesh_is_the_integral_of_the_radar_equation_at_each_range(inner, at):
    away, power = returned(plane(inner), at, rc.IsotropicAntenna(front=False))
    for centre, width in ((1.6 * at[2], 0.6 * at[2]), (10.0, 2.0), (25.0, 2.0), (50.0, 2.0)):
        r = np.linspace(at[2], HALF, 40_001)
        sigma = LAW.sigma0(at[2] / r, at[2] / r, 2.0 * (at[2] / r) ** 2 - 1.0)
        asked = np.trapezoid(2.0 * np.pi * sigma * cell(r, centre, width) / r**3, r)
        assert 10.0 * np.log10((power * cell(away, centre, width)).sum() / asked) == pytest.approx(0.0, abs=0.06)


@pytest.mark.parametrize("antenna", [rc.CosineAntenna(80, 40), rc.CosineAntenna(20, 10)], ids=["wide", "narrow"])
def test_a_plane_of_two_triangles_takes_at_most_twice_the_patches_of_ground_and_returns_as_much(antenna):
    at = (0.0, 0.0, 1.0)
    (one, power), (other, asked) = (returned(body, at, antenna) for body in (plane(), GROUND))
    assert len(one) < 2 * len(other)
    for centre in (5.0, 15.0, 40.0):
        got, wanted = ((p * cell(r, centre, 2.0)).sum() for r, p in ((one, power), (other, asked)))
        assert 10.0 * np.log10(got / wanted) == pytest.approx(0.0, abs=0.06)
