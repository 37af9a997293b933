"""A vehicle and its mirror image return the same, whichever way its facets were cut, and what a finer mesh does."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import raychan as rc
from raychan.world.shapes import build

WAVE = rc.Waveform(77e9, 0.8e9, 40e-6, n_chirps=16, n_samples=256)
TX, NEAR, ASIDE, AT = (0.0, 0.0, 0.9), (0.0, 1.0, 0.9), (0.0, 1.959, 1.095), (7.085, -1.686, 0.0)


def image(mesh):
    """Return the same surface of a body that is its own mirror image in y = 0, by its facets mirrored."""
    flip = np.array([1.0, -1.0, 1.0])
    return dataclasses.replace(
        mesh, vertices=mesh.vertices * flip, faces=mesh.faces[:, ::-1].copy(), normals=(mesh.normals * flip)[:, ::-1]
    )


def strongest(mesh, yaw_deg, rx):
    """Return level and stated error [dB] of the strongest echo of a body, seen bistatically."""
    body = rc.Body(name="it", mesh=mesh, position=AT, yaw_deg=yaw_deg)
    radar = rc.Radar(WAVE, position=TX, rx_position=rx, antenna=rc.IsotropicAntenna(), noise=False)
    model = {"max_bounces": 1, "tolerance_db": 0.3, "max_rays": 2_000_000}
    found = rc.simulate(rc.Scene(bodies=[body], radar=radar, model=model)).detections
    far = found.range > 0.5 * np.linalg.norm(np.subtract(rx, TX)) + 1.0
    best = np.flatnonzero(far)[np.argmax(found.power[far])]
    return 10.0 * np.log10(found.power[best]), found.error_db[best]


@pytest.mark.parametrize(
    ("name", "yaw_deg", "rx"),
    [("car", -107.655, ASIDE), ("car", 80.0, ASIDE), ("van", -102.5, NEAR)],
)
def test_facets_mirrored_return_the_same(name, yaw_deg, rx):
    mesh = build(name)
    (own, error), (mirrored, other) = strongest(mesh, yaw_deg, rx), strongest(image(mesh), yaw_deg, rx)
    assert abs(own - mirrored) < error + other


@pytest.mark.parametrize("yaw_deg", [72.345, -107.655])
def test_doors_return_what_those_of_a_finer_mesh_do(yaw_deg):
    """Flanks of 0.6 and of 0.1 mm sag: within 0.3 dB beside the errors stated."""
    meshes = (build("car", {"max_sag": sag}) for sag in (0.6e-3, 0.1e-3))
    (own, error), (fine, other) = (strongest(mesh, yaw_deg, ASIDE) for mesh in meshes)
    assert abs(own - fine) < error + other + 0.3
