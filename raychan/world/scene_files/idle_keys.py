"""Keys of a scene without effect beside others, that redefine what is built in, or that make of a pane a block: said,
as most often a slip."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from raychan.records import HALF_SPACE
from raychan.world.body import Body
from raychan.world.material import Material, material, names
from raychan.world.meshes.mesh import CREASE_DEG, Mesh
from raychan.world.scene_files.schema import RadarTable

_OF_MESHES = {"unit": "m", "up": None, "forward": None, "scale": 1.0, "crease_deg": CREASE_DEG}
"""Keys that say how a mesh file or a trimesh is read, and their defaults."""
_ANY = 77e9  # Hz: whether a built-in material has a thickness does not depend on it


def idle_keys(bodies: Iterable[Body], materials: Mapping[str, Material], radar: RadarTable | None) -> list[str]:
    """Return a line for each table of a scene that has keys without effect, each set to another value than its
    default, that redefines a built-in material, or that is of air; and for plates that are opaque dielectrics."""
    said = [] if radar is None or radar.noise else _told("radar", _noise(radar), "with noise = false")
    for name, made in materials.items():
        law = made.diffuse
        if name in names():
            said.append(f"materials.{name}: redefines the built-in material of that name, of which nothing is kept")
        if not made.pec and law is None and made.eps_r == 1.0 and made.sigma == 0.0:
            said.append(f"materials.{name}: eps_r = 1 and sigma = 0 are those of air, which reflects nothing")
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
        said += _opaque(body, materials)
    return said


def _opaque(body: Body, materials: Mapping[str, Material]) -> list[str]:
    """Return a line on a plate of a dielectric without thickness: a pane is what is mostly meant."""
    if body.shape != "plate" or body.rcs_dbsm is not None:
        return []
    name = body.part_materials()[0]
    made = name if isinstance(name, Material) else materials.get(name) or material(name, _ANY)
    if made.kind != HALF_SPACE or made.eps_r == 1.0:
        return []
    what = made.name or (name if isinstance(name, str) else "its material")
    return [
        f"bodies.{body.name}: of {what}, which has no thickness: a half space, through which nothing passes (a pane is "
        "of car_glass or windscreen, or of a material with thickness_mm)"
    ]


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
