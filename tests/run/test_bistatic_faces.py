"""Bodies seen from two places at one bounce: faces that only one end lights count by half, from either end."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from truth import po

import raychan as rc
from raychan.poses import rotation
from raychan.units import C0

F = 24.1e9
K = 2.0 * np.pi * F / C0
WAVE = rc.Waveform(F, 1e4, 30e-6, n_chirps=8, n_samples=64)
PLACE = np.array([3.0, 0.5, 0.6])
TX = np.array([0.0, 0.0, 0.5])


def echo(mesh, turn, tx, rx, material="pec"):
    """Return what a body returns from one place to another, times both distances and 4 pi over the wavelength [m]."""
    body = rc.Body(
        name="body", mesh=mesh, material=material, position=PLACE, yaw_deg=turn[0], pitch_deg=turn[1],
        roll_deg=turn[2], crease_deg=1.0,
    )  # fmt: skip
    radar = rc.Radar(WAVE, position=tx, rx_position=rx, noise=False, power=1.0, antenna=rc.IsotropicAntenna())
    made = rc.Scene(bodies=[body], radar=radar, model={"max_bounces": 1, "tolerance_db": 0.02})
    found = rc.transfer(rc.trace(made), radar)
    of_body = (found.body == found.body_names.index("body")).any(axis=1)
    return found.amplitude[of_body].sum() * 2.0 * K * np.linalg.norm(tx - PLACE) * np.linalg.norm(rx - PLACE)


def summed(mesh, turn, tx, rx):
    """Return the same of a convex conductor, point by point, and the sum of what each face returns: the mean of the
    reflected wave of what either end lights, that goes on beyond the other's horizon until its obliquity ends."""
    ends = [((x - PLACE) / np.linalg.norm(x - PLACE), np.linalg.norm(x - PLACE)) for x in (tx, rx)]
    each = np.zeros(len(mesh.faces), complex)
    for i, v in enumerate(mesh.vertices[mesh.faces] @ rotation(*np.radians(turn)).T):
        normal = po.unit_normal(v)
        for points, weights in po.patch_nodes(v[0], v[1] - v[0], v[2] - v[0], K, ends, 1.0, True):
            there, back = (-po.wave(points, end)[0] @ normal for end in ends)
            share = 0.5 * ((there > 0.0) * 1.0 + (back > 0.0)) * (there + back > 0.0)
            each[i] += po.amplitude(points, normal, weights * share, K, *ends, form="reciprocal")[0, 0]
    return each.sum(), np.abs(each).sum()


def views(seed, count):
    """Give seeded turns of a body, and places of a receiver."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        turn = rng.uniform(-180.0, 180.0), *rng.uniform(-10.0, 10.0, 2)
        yield rng, turn, np.array([rng.uniform(-0.5, 4.0), rng.uniform(1.5, 4.0), rng.uniform(0.3, 1.0)])


def test_a_box_returns_the_mean_of_what_either_end_lights_summed_point_by_point():
    off = []
    for rng, turn, rx in views(3, 5):
        box = trimesh.creation.box(rng.uniform(0.06, 0.18, 3))
        true, size = summed(box, turn, TX, rx)
        off.append(abs(abs(echo(box, turn, TX, rx)) - abs(true)) / size)
    assert max(off) < 0.01


@pytest.mark.parametrize("material", ["pec", "glass"])
def test_a_hull_seen_the_other_way_round_returns_the_same(material):
    off = []
    for rng, turn, rx in views(4, 8):
        hull = trimesh.convex.convex_hull(rng.normal(size=(12, 3)) * 0.07)
        one, two = echo(hull, turn, TX, rx, material), echo(hull, turn, rx, TX, material)
        off.append(abs(one - two) / max(abs(one), abs(two)))
    assert max(off) < 0.03


def test_a_plate_between_the_ends_returns_the_same_both_ways():
    """Each end lights a side of its own, and the wave goes on beyond the other one's horizon from one of both only."""
    plate, off = trimesh.creation.box([1e-6, 0.3, 0.2]), []
    plate = trimesh.Trimesh(plate.vertices, plate.faces[plate.face_normals[:, 0] > 0.5], process=True)
    for yaw in (-15.0, 0.0, 10.0):
        turn, rx = (yaw, 3.0, 0.0), np.array([5.0, 3.0, 0.9])
        one, two = echo(plate, turn, TX, rx), echo(plate, turn, rx, TX)
        off.append(abs(one - two) / max(abs(one), abs(two)))
    assert max(off) < 0.03
