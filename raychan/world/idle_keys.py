"""Keys of a scene without effect beside others, or that redefine what is built in: said, as most often a slip."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from raychan.world.body import Body
from raychan.world.material import Material, names
from raychan.world.mesh import CREASE_DEG, Mesh
from raychan.world.schema import RadarTable

_OF_MESHES = {"unit": "m", "up": None, "forward": None, "scale": 1.0, "crease_deg": CREASE_DEG}
"""Keys that say how a mesh file or a trimesh is read, and their defaults."""


def idle_keys(bodies: Iterable[Body], materials: Mapping[str, Material], radar: RadarTable | None) -> list[str]:
    """Return a line for each table of a scene that has keys without effect, each set to another value than its
    default, or that redefines a built-in material."""
    said = [] if radar is None or radar.noise else _told("radar", _noise(radar), "with noise = false")
    for name, made in materials.items():
        law = made.diffuse
        if name in names():
            said.append(f"materials.{name}: redefines the built-in material of that name")
        if made.pec and made.diffuse is None:
            idle = [key for key, value in (("eps_r", made.eps_r - 1.0), ("sigma", made.sigma)) if value]
            said += _told(f"materials.{name}", idle, "with pec = true")
        if law is not None and law.law != "lobe" and law.exponent != 4:
            said += _told(f"materials.{name}.diffuse", ["exponent"], f"with law = '{law.law}'")
        if law is not None and law.k_shape is None and law.texture_m != 1.0:
            said += _told(f"materials.{name}.diffuse", ["texture_m"], "without k_shape")
    for body in bodies:
        if body.rcs_dbsm is None and body.rcs_point is not None:
            said += _told(f"bodies.{body.name}", ["rcs_point"], "without rcs_dbsm")
        if body.shape is not None:
            said += _told(f"bodies.{body.name}", _of_meshes(body), f"with shape = '{body.shape}'")
        elif body.params:
            said += _told(f"bodies.{body.name}", ["params"], "with a mesh")
        if isinstance(body.mesh, Mesh):
            said += _told(f"bodies.{body.name}", _of_meshes(body), "with a Mesh, which is in metres")
    return said


def _of_meshes(body: Body) -> list[str]:
    return [key for key, default in _OF_MESHES.items() if getattr(body, key) != default]


def _noise(radar: RadarTable) -> Iterator[str]:
    for key in ("noise_figure_db", "noise_temperature_k"):
        if getattr(radar, key) != RadarTable.model_fields[key].default:
            yield key


def _told(table: str, idle: Iterable[str], beside: str) -> list[str]:
    keys = list(idle)
    verb = "has" if len(keys) == 1 else "have"
    return [f"{table}: {' and '.join(keys)} {verb} no effect {beside}"] if keys else []
