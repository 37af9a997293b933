"""Normals across the seams of bodies: a curved surface drawn as several bodies is smoothed as one surface."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np

from raychan.records import MIRROR
from raychan.world.body import Body
from raychan.world.meshes import degenerate_faces
from raychan.world.meshes.mesh import Floats, Ints, opposed_pairs, smooth_normals


def over_seams(bodies: Sequence[Body]) -> tuple[Body, ...]:
    """Return bodies with their estimated normals smoothed over the edges that they share.

    Bodies that move as one and share edges that fold by less than the crease angle get the normals that one mesh of
    them all would have. Bodies with known normals stay as they are."""
    groups: dict[Any, list[int]] = {}
    for i, body in enumerate(bodies):
        mesh = body.geometry
        if mesh.crease_deg and mesh.report.open_edges and body.resolved_role != MIRROR:
            groups.setdefault((_moves(body), mesh.crease_deg), []).append(i)
    out = list(bodies)
    for (_, crease), members in groups.items():
        if len(members) < 2:
            continue
        owner, vertices, faces = _together([bodies[i] for i in members])
        one, other = opposed_pairs(faces)
        across = owner[one] != owner[other]
        touching = np.unique(np.concatenate([owner[one[across]], owner[other[across]]]))
        if not len(touching):
            continue
        normals = smooth_normals(vertices, faces, crease)
        for k in touching:
            out[members[k]] = _with(bodies[members[k]], normals[owner == k])
    return tuple(out)


def _moves(body: Body) -> tuple[Any, ...]:
    """Return the motion parameters that are equal for bodies that move as one."""
    m = body.motion
    turns = bool(m.turn_rate) or any(m.own_spin)
    return (*m.velocity, m.turn_rate, *m.own_spin, *((m.position, m.yaw, m.pitch, m.roll) if turns else ()))


def _together(bodies: Sequence[Body]) -> tuple[Ints, Floats, Ints]:
    """Return the body (f,) of each face, and vertices (v, 3) [m] and faces (f, 3) of all bodies in the world."""
    meshes = [b.geometry for b in bodies]
    begin = np.cumsum([0, *(len(m.vertices) for m in meshes)])
    faces = np.concatenate([m.faces + b for m, b in zip(meshes, begin, strict=False)]).astype(np.int64)
    vertices = np.concatenate([b.motion.to_world(b.geometry.vertices) for b in bodies])
    owner = np.repeat(np.arange(len(meshes)), [len(m.faces) for m in meshes])
    return owner, *degenerate_faces.weld(vertices, faces)


def _with(body: Body, normals: Floats) -> Body:
    """Return a body with other normals (f, 3, 3), given in the world."""
    new = copy(body)
    new.__dict__["geometry"] = replace(body.geometry, normals=normals @ body.motion.rotation())
    return new
