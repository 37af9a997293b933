"""Meshes from files (GLB, OBJ, PLY, STL) and from trimesh, turned to metres, x forward, z up."""

from __future__ import annotations

import logging
from collections import Counter
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from raychan.scalars import plain
from raychan.world.errors import SceneError, nearest, shown
from raychan.world.limits import CREASE, SCALE, WIDTH
from raychan.world.mesh_files.obj_lines import missing_vertex
from raychan.world.mesh_files.plain_obj import plain_text, read_by
from raychan.world.mesh_files.ply import read_ply
from raychan.world.mesh_files.polygons import folded, has_polygons
from raychan.world.mesh_files.text_stl import solids, text_of
from raychan.world.mesh_files.whole_files import checked
from raychan.world.meshes.mesh import CREASE_DEG, Floats, Mesh, make_mesh

_SIZES = 0.01, 150.0  # m: sizes outside are warned of
_USUAL = 3.0  # m: typical size, for guessing the unit
_FARTHEST = 1e12  # in the unit of the file: coordinates beyond are errors of the file or of its reader
UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "inch": 0.0254, "ft": 0.3048}
SUFFIXES = (".glb", ".gltf", ".obj", ".ply", ".stl")
_SILENT = logging.NullHandler()
_AXES = {s + a: (1.0 if s == "+" else -1.0) * np.eye(3)[i] for s in "+-" for i, a in enumerate("xyz")}


def load(
    path: str | Path,
    unit: str = "m",
    up: str | None = None,
    forward: str | None = None,
    scale: float = 1.0,
    crease_deg: float = CREASE_DEG,
) -> Mesh:
    """Return the mesh of a file in the body frame (x forward, y left, z up); geometries of a baked scene are parts.

    Args: unit m, cm, mm, inch or ft; up the file's axis that points up (default y for GLB, z else) and forward the one
    that points ahead (default z where y is up, else x), as 'z', '-x', '+y'; scale a further factor.
    Raises: SceneError for a file that is missing, unreadable or empty, and for options not allowed.
    """
    file = mesh_file(path)
    matrix = matrix_of(unit, up, forward, scale, file)
    check_crease(crease_deg)
    if not file.stat().st_size:
        raise SceneError("the file is empty: 0 bytes", file=file, allowed="a valid " + file.suffix)
    unread = checked(file)
    try:
        # Infinite coordinates are reported below, not as warnings of the reader.
        with np.errstate(all="ignore"):
            source, polygons = _read(file)
            meshes = getattr(source, "geometry", {"": source}).values()
            folds = folded(x for x in meshes if len(getattr(x, "faces", ()))) if polygons else 0
        mesh = from_trimesh(source, crease_deg, matrix)
    except SceneError as e:
        raise e.at(file=file) from None
    except IndexError as e:
        problem = "cannot be read as a mesh: a face names a vertex that the file does not hold"
        told = missing_vertex(plain_text(file), file) if file.suffix.lower() == ".obj" else None
        raise told or SceneError(f"{problem} ({e})", file=file, allowed="a valid " + file.suffix) from e
    except KeyError as e:
        problem = f"cannot be read as a mesh: {shown(str(e.args[0]))} is missing"
        raise SceneError(problem, file=file, allowed="a valid " + file.suffix) from e
    except Exception as e:  # trimesh's readers raise whatever their parsers do
        raise SceneError(f"cannot be read as a mesh ({e})", file=file, allowed="a valid " + file.suffix) from e
    if not unread and not folds:
        return mesh
    return replace(mesh, report=replace(mesh.report, unread_normals=unread, folded=folds))


def mesh_file(path: str | Path) -> Path:
    """Return the path of a mesh. Raises: SceneError where there is no file, or one of another kind by its name."""
    file = Path(path)
    if file.is_dir():
        raise SceneError("is a folder", file=file, value=str(file), allowed="a mesh file")
    if not file.is_file():
        raise SceneError("mesh file not found", file=file, value=str(file), allowed="a path to a file that exists")
    if file.suffix.lower() not in SUFFIXES:
        raise SceneError(f"unknown mesh format '{file.suffix}'", file=file, allowed=", ".join(SUFFIXES))
    return file


def _read(file: Path) -> tuple[Any, bool]:
    """Return what a file holds, a scene of trimesh or `vertices` and `faces`, and whether it may have polygons."""
    if file.suffix.lower() == ".ply":
        vertices, faces, polygons = read_ply(file)
        return SimpleNamespace(vertices=vertices, faces=faces), polygons
    import trimesh
    from trimesh.util import unique_name

    logging.getLogger("trimesh").addHandler(_SILENT)  # without one Python prints what it logs
    text = text_of(file) if file.suffix.lower() == ".stl" else None
    if text is not None:
        scene = trimesh.Scene()
        for name, corners in solids(text):
            faces = np.arange(len(corners)).reshape(-1, 3)
            scene.add_geometry(
                trimesh.Trimesh(corners, faces, process=False), geom_name=unique_name(name, scene.geometry)
            )
        return scene, False
    arguments = read_by(file)
    polygons = file.suffix.lower() == ".obj" and has_polygons(arguments["file_obj"].getvalue())
    return trimesh.load_scene(process=False, **arguments), polygons


def matrix_of(unit: str, up: str | None, forward: str | None, scale: float, file: Path | None = None) -> Floats:
    """Return the matrix (3, 3) that brings corners of a file, or of an object where there is none, to the body frame.

    Args: as of `load`.
    Raises: SceneError for options not allowed.
    """
    for key, word in (("unit", unit), ("up", up), ("forward", forward)):
        if not isinstance(word, str) and (word is not None or key == "unit"):
            raise SceneError(f"{shown(word)} is not possible", key=key, value=word, allowed="a text")
    if unit not in UNITS:
        raise SceneError(f"unknown unit '{unit}'", key="unit", value=unit, allowed=nearest(unit, UNITS))
    if SCALE.problem(scale):
        raise SceneError(f"{shown(scale)} is not possible", key="scale", value=scale, allowed=SCALE.allowed)
    taken, ahead = axes_taken(file or "", up, forward)
    return _turn(taken, ahead, forward is None) * (UNITS[unit] * plain(scale))


def check_crease(crease_deg: float) -> None:
    """Raise SceneError for a crease angle [deg] that is none."""
    if CREASE.problem(crease_deg):
        problem = f"{shown(crease_deg)} is not possible"
        raise SceneError(problem, key="crease_deg", value=crease_deg, allowed=f"a number {CREASE.allowed}")


def axes_taken(path: str | Path, up: str | None, forward: str | None) -> tuple[str, str]:
    """Return which of a file's axes are taken as up and as forward."""
    usual = "y" if Path(path).suffix.lower() in (".glb", ".gltf") else "z"
    taken = usual if up is None else up
    return taken, ("z" if taken.endswith("y") else "x") if forward is None else forward


def _unit_hint(size: float, unit: str, key: str) -> str:
    """Return the setting of the unit in which a body of a size [m], read in `unit`, would be a few metres large, or of
    its scale if there is none."""
    sizes = {name: size / UNITS[unit] * metres for name, metres in UNITS.items() if name != unit}
    best = min(sizes, key=lambda name: abs(np.log(sizes[name] / _USUAL)))
    fits = 0.1 <= sizes[best] / _USUAL <= 10.0
    return f"{_setting(key, 'unit', best)} makes it {sizes[best]:.3g} m" if fits else f"{key}scale"


def _setting(key: str, name: str, value: str) -> str:
    """Return how a setting is written in a scene file, or as an option where the key is '--'."""
    return f"--{name} {value}" if key == "--" else f'{key}{name} = "{value}"'


def oddities(mesh: Mesh, path: str | Path, unit: str = "m", up: str | None = None, key: str = "") -> list[str]:
    """Return a line each on unit and up axis, which files do not say, where the assumption looks wrong.

    Args: key, prefix of the names of the keys that correct it, as 'bodies.car.'.
    """
    said, size = [], max(mesh.report.size)
    if not _SIZES[0] <= size <= _SIZES[1]:
        said.append(f"{size:.4g} m across: check unit and scale ({_unit_hint(size, unit, key)})")
    if up is None:
        taken, ahead = axes_taken(path, up, None)
        low, extent = mesh.bounds[0], np.ptp(mesh.bounds, axis=0)
        stands = np.abs(low) <= 0.02 * extent
        length, width, height = extent
        facts = f"{length:.3g} x {width:.3g} x {height:.3g} m (x forward, y left, z up)"
        # A body that stands on a coordinate plane shows which axis is up.
        if not stands[2] and stands[:2].sum() == 1 and extent[stands].min() > 0.0:
            meant = (ahead, "xyz".replace(taken, "").replace(ahead, ""))[int(np.argmax(stands[:2]))]
            turns = f"{_setting(key, 'up', meant)} turns it"
            said.append(f"{taken} was taken as up, but it stands on {meant} = 0: {facts}; {turns}")
        elif taken == "y":
            said.append(f"{taken} was taken as up, as glTF has it: {facts}; {key}up says otherwise")
    return said


def from_trimesh(source: Any, crease_deg: float = CREASE_DEG, matrix: Floats | None = None) -> Mesh:
    """Return the Mesh of a trimesh.Trimesh or trimesh.Scene; each geometry of a scene is a part, by the name of its
    node where several nodes share it.

    Args: matrix (3, 3) applied to all vertices; a reflection turns the faces with it.
    """
    pieces = _pieces(source)
    m = np.eye(3) if matrix is None else np.asarray(matrix, float)
    vertices, faces, part, base = [], [], [], 0
    for i, (_, v, f) in enumerate(pieces):
        _possible(v)
        vertices.append(_turned(v, m))
        faces.append((f if np.linalg.det(m) > 0.0 else f[:, ::-1]) + base)
        part.append(np.full(len(f), i, np.int32))
        base += len(v)
    if not faces:
        raise SceneError("mesh is empty: no triangles", allowed="at least one triangle")
    names = tuple(name for name, _, _ in pieces)
    mesh = make_mesh(
        np.concatenate(vertices), np.concatenate(faces), np.concatenate(part), names, crease_deg=crease_deg
    )
    return _sized(mesh)


def _turned(v: Floats, matrix: Floats) -> Floats:
    """Return vertices (n, 3) times a matrix (3, 3); the same where it changes nothing, as numpy takes a second for four
    millions."""
    return v if np.array_equal(matrix, np.eye(3)) else v @ matrix.T


def _possible(v: Floats) -> None:
    """Raise SceneError where corners (n, 3), in the unit of the file, are not finite or far beyond any size."""
    wrong = int((~np.isfinite(v)).any(axis=1).sum())
    if wrong:
        raise SceneError(f"{wrong} vertices hold NaN or infinity", value=wrong, allowed="finite coordinates")
    far = float(np.abs(v).max(initial=0.0))
    if far > _FARTHEST:
        raise SceneError(f"a vertex at {far:.3g}", value=far, allowed=f"coordinates within +-{_FARTHEST:g}")


def _sized(mesh: Mesh) -> Mesh:
    """Return the mesh; raise SceneError where it is larger than a body can be."""
    size = max(mesh.report.size)
    if not WIDTH.allows(size):
        raise SceneError(f"the mesh is {size:.4g} m across", key="unit", value=size, allowed=WIDTH.allowed)
    return mesh


def _pieces(source: Any) -> list[tuple[str, Floats, Any]]:
    if hasattr(source, "faces"):
        return [("body", np.asarray(source.vertices, float), np.asarray(source.faces))]
    if not hasattr(source, "graph"):
        kind = type(source).__name__
        raise SceneError(f"{kind} is no mesh", value=kind, allowed="a file, Mesh, trimesh.Trimesh or trimesh.Scene")
    found: list[tuple[str, Floats, Any]] = []
    places = Counter(source.graph[node][1] for node in source.graph.nodes_geometry)
    for node in source.graph.nodes_geometry:
        transform, key = source.graph[node]
        geometry = source.geometry[key]
        if len(getattr(geometry, "faces", ())):
            own = np.asarray(geometry.vertices, float)
            _possible(own)
            v = _turned(own, transform[:3, :3]) + transform[:3, 3]
            f = np.asarray(geometry.faces)
            name = str(node if places[key] > 1 else key)
            found.append((name, v, f if np.linalg.det(transform[:3, :3]) > 0.0 else f[:, ::-1]))
    if len(found) == 1:
        found = [("body", *found[0][1:])]
    return found


def _turn(up: str, forward: str, usual: bool) -> Floats:
    """Return the rotation that brings the file's forward, which may be the usual one, to +x and its up to +z."""
    axes = []
    for key, word in (("up", up), ("forward", forward)):
        name = word if word[:1] in "+-" else "+" + word
        if name not in _AXES:
            raise SceneError(f"unknown axis '{word}'", key=key, value=word, allowed="x, y, z, -x, -y or -z")
        axes.append(_AXES[name])
    z, x = axes
    if abs(z @ x) > 0.5:
        # The one that is given is wrong, not what is usual beside it.
        key, word, other, across = ("up", up, "forward", forward) if usual else ("forward", forward, "up", up)
        allowed = f"an axis across {other} = '{across}'"
        raise SceneError(f"'{word}' lies along {other}", key=key, value=word, allowed=allowed)
    return np.stack([x, np.cross(z, x), z])
