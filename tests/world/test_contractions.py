"""Cells of vertices are contracted at once, and what is left is the surface of a mesh still."""

from __future__ import annotations

import numpy as np
import pytest
from support.fine_surfaces import ball, ellipsoid, half_ball, torus

from raychan.geometry.collapses import UPRIGHT, Limits
from raychan.geometry.contractions import contract
from raychan.geometry.half_edges import followed
from raychan.world.meshes.simplify import _net

LIMITS = Limits(deviation=1e-4, normal=0.1, sag=2e-3, turn=0.3)


def slabs(net):
    """Return two slabs of a net."""
    slab = (net.v[:, 0] > 0.1).astype(np.int8)
    order = np.argsort(slab, kind="stable")
    rows = order[~net.locked[order]]
    return slab, rows, np.searchsorted(slab[rows], np.arange(3))


@pytest.mark.parametrize("most", [1, 2])
@pytest.mark.parametrize(
    "mesh", [ball(), torus(), ellipsoid(), half_ball()], ids=["ball", "torus", "ellipsoid", "half"]
)
def test_what_is_left_is_closed_upright_and_within_the_limits(mesh, most):
    whole, _ = _net(mesh, np.zeros(len(mesh.faces), bool))
    net = whole.copied()
    went = contract(net, LIMITS, most, 1, slabs(net))
    live = np.flatnonzero(net.faces[:, 0] >= 0)
    assert went > 0.5 * len(whole.v)
    # Of a closed surface facets go in pairs with vertices (Euler); edges of the body stay as they are.
    assert len(whole.faces) - len(live) == 2 * went == 2 * net.gone.sum()
    assert not (net.gone & net.locked).any()
    faces = net.faces[live]
    assert not net.gone[faces].any()
    own = (3 * live[:, None] + np.arange(3)).ravel()
    mate, start, end = net.mate[own], faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    edges = {*zip(start.tolist(), end.tolist(), strict=True)}
    assert len(edges) == len(start)
    assert all((b, a) in edges for a, b in edges)
    inside = mate >= 0
    other = mate[inside]
    assert np.array_equal(net.mate[other], own[inside])
    assert np.array_equal(net.faces[other // 3, other % 3], end[inside])
    # Each vertex that stays has a half edge of its own, and each facet an heir that stays.
    stays = np.flatnonzero(~net.gone)
    assert np.array_equal(net.faces[net.half[stays] // 3, net.half[stays] % 3], stays)
    assert (net.faces[followed(net.heir), 0] >= 0).all()
    v, n = net.v[faces], net.n[net.corner[live]]
    side = np.roll(v, -1, axis=1) - v
    normal = np.cross(side[:, 0], side[:, 1])
    new = (net.corner[live] != 3 * live[:, None] + np.arange(3)).any(axis=1)
    cosine = np.einsum("fk,fck->fc", normal / np.linalg.norm(normal, axis=1)[:, None], n)
    assert cosine[new].min() >= UPRIGHT
    turn = np.roll(n, -1, axis=1) - n
    assert np.abs(np.einsum("fck,fck->fc", side, turn))[new].max() <= 8.0 * LIMITS.sag


def test_edges_no_longer_than_those_there_are_leave_a_mesh_as_it_is():
    mesh = torus()
    net, _ = _net(mesh, np.zeros(len(mesh.faces), bool))
    net.reach[:] = 1e-6
    before = net.copied()
    assert contract(net, LIMITS, 2, 1, slabs(net)) == 0
    assert np.array_equal(net.faces, before.faces)
    assert np.array_equal(net.mate, before.mate)
