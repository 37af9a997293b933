"""Cost of finely tessellated bodies: it shall follow the size of a body, not its tessellation."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import trimesh

import raychan as rc
from bench.measure import Row, alone, barred
from bench.size import RADAR, grown
from raychan.units import C0
from raychan.world.meshes.mesh import Mesh, make_mesh
from raychan.world.simplified import traced_mesh

_FREQUENCY = 77e9
_RAYS = 65_000


def fine(scenes: Path, repeats: int, quick: bool) -> Iterator[Row]:
    """RCS of one sphere at ever finer tessellation, and frames with a body of 1.3e6 facets in view."""
    for n in (6, 7) if quick else (6, 7, 8):
        ball = _ball(n, 0.5)
        start = perf_counter()
        coarse = traced_mesh(ball, 2.0 * np.pi * _FREQUENCY / C0, 0.5)
        took = perf_counter() - start
        found: list[rc.Rcs] = []
        name = f"sphere of {len(ball.faces):,} facets, 0.05 dB"
        row = alone("fine", name, _rcs(ball, found), repeats)
        row.more |= {
            "rays": int(found[-1].rays),
            "off_db": float(10.0 * np.log10(found[-1].sigma / (np.pi * 0.25))),
            "stated_db": float(found[-1].error_db),
            "seconds to simplify, 0.5 dB": took,
            "facets": len(coarse.mesh.faces) if coarse else len(ball.faces),
        }
        yield barred(row, f"<= {_RAYS:,} rays", row.more["rays"] <= _RAYS)
    some = trimesh.creation.uv_sphere(radius=1.0, count=[51, 51])
    few = make_mesh(some.vertices, some.faces, normals=np.asarray(some.vertices)[some.faces])
    bodies = few, _ball(7 if quick else 8, 1.0)
    yield from grown("facets in view", [_seen(b) for b in bodies], repeats, bar=3.0)


def _ball(subdivisions: int, radius: float) -> Mesh:
    """Return a sphere that knows its normals."""
    raw = trimesh.creation.icosphere(subdivisions=subdivisions)
    unit = np.asarray(raw.vertices) / np.linalg.norm(raw.vertices, axis=1, keepdims=True)
    return make_mesh(radius * unit, raw.faces, normals=unit[raw.faces])


def _rcs(ball: Mesh, found: list[rc.Rcs]) -> Callable[[], None]:
    """Return a call that computes the RCS of a sphere from one angle."""
    return lambda: found.append(rc.rcs(ball, _FREQUENCY, 10.0, 5.0, tolerance_db=0.05))


def _seen(ball: Mesh) -> tuple[str, Callable[[], rc.Scene], dict[str, Any]]:
    """Return a job: a ball before a plate."""
    bodies = [
        rc.Body(name="ball", mesh=ball, position=(8, 0, 1.5)),
        rc.Body(name="wall", shape="plate", params={"width": 3.0, "height": 3.0}, position=(12, 0, 1.5), yaw_deg=180.0),
    ]
    scene = rc.Scene(bodies=bodies, radar=RADAR, model={"max_bounces": 1, "tolerance_db": 0.5})
    return f"{len(ball.faces):,} facets", lambda: scene, {}
