"""The facets of all bodies, and the targets given by their RCS, posed in the world at an instant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.geometry.triangles import pose
from raychan.records import LAYER, MIRROR, Facets, Points
from raychan.world.body import Body
from raychan.world.errors import SceneError, nearest
from raychan.world.material import Material, material, names, resolve
from raychan.world.meshes.mesh import Floats
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


def index_of(bodies: Sequence[Body], chosen: Sequence[Sequence[Material]]) -> Index:
    """Return all materials, all part names, and for each body the material and the part number of its parts.

    Args: chosen, for each body the materials of its parts.
    """
    materials: dict[Material, int] = {}
    parts: dict[str, int] = {}
    rows = []
    for body, own in zip(bodies, chosen, strict=True):
        mesh = body.geometry
        lone = len(mesh.part_names) == 1
        part = [parts.setdefault("" if lone and p == "body" else p, len(parts)) for p in mesh.part_names]
        kind = [materials.setdefault(m, len(materials)) for m in own]
        rows.append((np.array(kind, np.int32), np.array(part, np.int32)))
    return list(materials), list(parts), rows


def materials_chosen(body: Body, known: Mapping[str, Material], frequency: float) -> list[Material]:
    """Return the materials of a body's parts at a frequency [Hz]: those `known` to the scene first, then the built-in
    ones."""
    found = []
    for part, m in zip(body.geometry.part_names, body.part_materials(), strict=True):
        if isinstance(m, str) and m not in known and m not in names():
            key = f"{body.name}.materials.{part}" if part in body.materials else f"{body.name}.material"
            raise SceneError(f"unknown material '{m}'", key=key, value=m, allowed=nearest(m, [*known, *names()]))
        found.append((known.get(m) or material(m, frequency)) if isinstance(m, str) else m)
    return found


def spheres_inside(
    bodies: Sequence[Body], chosen: Sequence[Sequence[Material]]
) -> tuple[Floats, Floats, NDArray[np.int32]]:
    """Return centres (k, 3) [m], radii (k,) [m] and bodies (k,) of spheres inside bodies at time 0; args as
    `index_of`."""
    found = []
    for i, (b, own) in enumerate(zip(bodies, chosen, strict=True)):
        if b.resolved_role != MIRROR:
            centre, radius = b.geometry.inner_spheres(tuple(m.kind != LAYER for m in own))
            found.append((b.motion.to_world(centre), radius, np.full(len(radius), i, np.int32)))
    centres, radii, owners = zip(*found, strict=True) if found else ((), (), ())
    return stack(list(centres), (3,), float), stack(list(radii), (), float), stack(list(owners), (), np.int32)


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
        role=np.array([b.resolved_role for b in bodies], np.int8),
        origin=origins,
        velocity=np.array([b.motion.velocity_of_origin(time) for b in bodies], float).reshape(-1, 3),
        spin=np.array([b.motion.spin(time) for b in bodies]).reshape(-1, 3),
        materials=resolve(materials, frequency),
        body_names=tuple(b.name for b in bodies),
        part_names=tuple(parts),
    )


def points_of(bodies: Sequence[Body], time: float = 0.0) -> Points:
    """Return the targets given by their RCS among bodies at a time [s]; all tables on the finest table's azimuths."""
    rows = [(i, b) for i, b in enumerate(bodies) if b.rcs_dbsm is not None]
    tables = [b.target() for _, b in rows]
    knots = max((t[0] for t in tables), key=len, default=np.array([-np.pi, np.pi]))
    place: list[Floats] = [b.motion.to_world(b.target_point(), time) for _, b in rows]
    velocity = [b.motion.velocity_at(p, time) for (_, b), p in zip(rows, place, strict=True)]
    return Points(
        position=np.array(place).reshape(-1, 3),
        velocity=np.array(velocity).reshape(-1, 3),
        body=np.array([i for i, _ in rows], np.int32),
        azimuth=knots,
        sigma=np.array([np.interp(knots, *t) for t in tables]).reshape(-1, len(knots)),
        heading=np.array([b.motion.heading(time) for _, b in rows], float),
    )


def stack(pieces: list[Any], shape: tuple[int, ...], dtype: Any) -> Any:
    """Return arrays joined along their first axis; an empty one of this shape and type where there are none."""
    return np.concatenate(pieces) if pieces else np.zeros((0, *shape), dtype)
