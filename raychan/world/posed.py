"""The facets of all bodies, posed in the world at an instant."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.geometry.triangles import pose
from raychan.records import Facets
from raychan.world.body import Body
from raychan.world.material import Material, resolve
from raychan.world.static_geometry import StaticGeometry

Index = tuple[list[Material], list[str], list[tuple[NDArray[np.int32], NDArray[np.int32]]]]


def posed(bodies: Sequence[Body], index: Index, frequency: float, time: float, static: StaticGeometry | None) -> Facets:
    """Return the facets of all bodies in the world at a time [s], bodies in order.

    Args: index all materials, all part names, and for each body the material and the part number of its parts;
    frequency [Hz] of the materials; static what is kept of bodies that do not move.
    """

    def every() -> Facets:
        return _posed(bodies, range(len(bodies)), index, frequency, time)

    if static is None or not static.shares:
        return every()
    base = static.computed_once("facets", lambda: _shared(every(), static))
    part = _posed(bodies, [int(b) for b in static.moving], index, frequency, time)
    vertices, normals = static.copies("facets", (part.vertices, part.normals))
    now: Facets = base.rebuilt(
        vertices=vertices, normals=normals, origin=part.origin, velocity=part.velocity, spin=part.spin
    )
    return now


def _shared(facets: Facets, static: StaticGeometry) -> Facets:
    """Return the same facets with corners and normals that are kept."""
    vertices, normals = static.keep("facets", (facets.vertices, facets.normals))
    kept: Facets = facets.rebuilt(vertices=vertices, normals=normals)
    return kept


def _posed(bodies: Sequence[Body], which: Sequence[int], index: Index, frequency: float, time: float) -> Facets:
    """Return a record of all bodies with the facets of those numbered `which` only."""
    materials, parts, numbers = index
    meshes = [bodies[b].geometry for b in which]
    turns = [bodies[b].motion.rotation(time) for b in which]
    origins = np.array([b.motion.origin(time) for b in bodies]).reshape(-1, 3)
    at = np.concatenate([[0], np.cumsum([len(m.faces) for m in meshes], dtype=np.int64)])
    vertices, normals = np.empty((at[-1], 3, 3)), np.empty((at[-1], 3, 3))
    for b, m, turn, i, j in zip(which, meshes, turns, at, at[1:], strict=False):
        pose(m.vertices, m.faces, m.normals, turn, origins[b], vertices[i:j], normals[i:j])
    return Facets(
        vertices=vertices,
        normals=normals,
        body=stack([np.full(len(m.faces), b, np.int32) for b, m in zip(which, meshes, strict=True)], (), np.int32),
        part=stack([numbers[b][1][m.part] for b, m in zip(which, meshes, strict=True)], (), np.int32),
        material=stack([numbers[b][0][m.part] for b, m in zip(which, meshes, strict=True)], (), np.int32),
        role=np.array([b.kind for b in bodies], np.int8),
        origin=origins,
        velocity=np.array([b.motion.velocity_of_origin(time) for b in bodies], float).reshape(-1, 3),
        spin=np.array([b.motion.spin(time) for b in bodies]).reshape(-1, 3),
        materials=resolve(materials, frequency),
        body_names=tuple(b.name for b in bodies),
        part_names=tuple(parts),
    )


def stack(pieces: list[Any], shape: tuple[int, ...], dtype: Any) -> Any:
    """Return arrays joined along their first axis; an empty one of this shape and type where there are none."""
    return np.concatenate(pieces) if pieces else np.zeros((0, *shape), dtype)
