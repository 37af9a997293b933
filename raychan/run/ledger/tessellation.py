"""What facets are off the smooth surface that they stand for: an entry of the ledger of unmodelled effects."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from raychan.geometry.triangles import edge_curvatures
from raychan.radar.radar import Radar
from raychan.records import BLOCKER, Paths
from raychan.run.mechanisms import peak
from raychan.world.geometry import Geometry
from raychan.world.meshes.halving import cubic_off
from raychan.world.meshes.mesh import Mesh

_OPPOSED = 2.0  # of a field's amplitude: largest change by a phase, at pi


def strongest_bend(
    paths: Paths, geometry: Geometry, meshes: Mapping[str, Mesh], radar: Radar, settings: Any
) -> tuple[str, float, float]:
    """Return, among bodies given by name with their whole meshes, the one whose strongest cell changes most if its
    smoothed facets are flat: its name, the phase [rad] and the change [W]; '' where none is curved or returns an echo.

    A smooth facet deviates from the flat one by its sag, a quarter of the edge curvature, and the two-way phase by 2 k
    times that; the rms over the body's area is the relative error of the field of flat facets.
    """
    f, k = geometry.facets, 2.0 * np.pi / radar.waveform.wavelength
    found = ("", 0.0, 0.0)
    for body, name in enumerate(f.body_names):
        if name not in meshes or f.role[body] == BLOCKER:
            continue
        phase = 2.0 * k * _sag(meshes[name])
        if phase == 0.0:
            continue
        met = ((paths.trajectories.body == body) & (paths.trajectories.kind > 0)).any(axis=1)[paths.trajectory]
        changed = min(phase, _OPPOSED) ** 2 * peak(paths, met, radar, settings)
        if changed > found[2]:
            found = (name, phase, changed)
    return found


def coarsest(meshes: Mapping[str, Mesh], radar: Radar) -> tuple[str, float]:
    """Return, among bodies given by name with their meshes, the one whose curved facets lie farthest from those with
    cubic edges through the same corners and normals: its name and the two-way phase [rad], rms; '' without any."""
    off = {name: _beside_cubic(mesh) for name, mesh in meshes.items()}
    name = max(off, key=lambda body: off[body], default="")
    return name, 4.0 * np.pi / radar.waveform.wavelength * off.get(name, 0.0)


def _beside_cubic(mesh: Mesh) -> float:
    """Return the rms distance [m] of a body's curved facets from cubic ones, 0 where none is; kept with the mesh."""
    if "beside_cubic" not in mesh.memo:
        curvature, curved = edge_curvatures(mesh.corners, mesh.normals)
        off, area = cubic_off(mesh.corners[curved], mesh.normals[curved], curvature[curved]), mesh.areas[curved]
        mesh.memo["beside_cubic"] = float(np.sqrt(np.average(off**2, weights=area))) if len(area) else 0.0
    return float(mesh.memo["beside_cubic"])


def _sag(mesh: Mesh) -> float:
    """Return the rms sag [m] of a body's curved facets, 0 where none is: of its whole mesh, also where fewer are
    traced; kept with the mesh."""
    if "sag" not in mesh.memo:
        curvature, curved = edge_curvatures(mesh.corners, mesh.normals)
        sag, area = 0.25 * np.linalg.norm(curvature[curved], axis=2), mesh.areas[curved]
        mesh.memo["sag"] = float(np.sqrt(np.average((sag**2).mean(axis=1), weights=area))) if len(area) else 0.0
    return float(mesh.memo["sag"])
