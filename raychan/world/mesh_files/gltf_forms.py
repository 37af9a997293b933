"""Legal forms of glTF 2.0 that its reader takes for another body, refused by name: it reads no triangle fans, sparse or
normalised corners, instances, morph targets and skins, and knows few extensions.

Source: Khronos Group, glTF 2.0 Specification (2021), sections 3.6.2 (accessors), 3.7.2 (meshes), 3.7.3 (skins).
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib.util import find_spec
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from raychan.world.errors import SceneError, shown
from raychan.world.mesh_files.gltf_damage import Found, damaged, header_of
from raychan.world.mesh_files.gltf_skins import at_rest, placed

_LOOKS = ("KHR_materials_", "KHR_texture_", "EXT_texture_", "MSFT_texture_", "KHR_xmp", "KHR_animation_")
_READ = ("KHR_mesh_quantization", "KHR_draco_mesh_compression", "KHR_lights_punctual", "KHR_node_visibility")
_TRIANGLES, _FAN, _CHUNK = 4, 6, 8  # modes of a primitive; bytes of the head of a chunk of a GLB


def understood(file: Path) -> None:
    """Raise SceneError for a glTF that is damaged, or of a form that its reader takes for another body."""
    tree, rest = header_of(file.read_bytes(), file)
    try:
        with np.errstate(all="ignore"):  # places at infinity are told by the reader
            found = next(chain(damaged(tree, rest, file), _misread(tree, rest[_CHUNK:], file)), None)
    except (LookupError, TypeError, AttributeError, ValueError, ArithmeticError, RecursionError):
        return  # it is damaged, of which its reader tells
    if found is not None:
        raise SceneError(found[0], file=file, allowed=found[1])


def _misread(tree: Mapping[str, Any], binary: bytes, file: Path) -> Found:
    """Yield what a reader would take for something else, in the scene that it reads."""
    for name in tree.get("extensionsRequired", ()):
        if name not in _READ and not name.startswith(_LOOKS):
            yield f"needs the glTF extension '{name}', which is not read", "a file exported without it"
    places = placed(tree)
    for i in places:
        node = tree["nodes"][i]
        yield from _of_node(node, f"node '{node.get('name', i)}'")
        if "camera" in node and _has_mesh(tree, i):
            problem = f"node '{node.get('name', i)}' is a camera with a mesh or children that have one"
            yield f"{problem}, which are not read", "cameras at nodes of their own"
        if "mesh" not in node:
            continue
        mesh = tree["meshes"][node["mesh"]]
        where = f"mesh '{mesh.get('name', node['mesh'])}'"
        morphed = any("targets" in p for p in mesh["primitives"])
        if morphed and any(node.get("weights", mesh.get("weights", ()))):
            yield (
                f"{where} has morph targets of weights other than 0, which are not read",
                "the shape applied to the mesh",
            )
        if "skin" in node and not at_rest(tree, i, places, binary, file):
            problem = f"{where} has a skin in another pose than its mesh was drawn in, which is not read"
            yield problem, "the pose applied to the mesh, exported without a skin"
        for primitive in mesh["primitives"]:
            yield from _of_primitive(tree, primitive, where)


def _has_mesh(tree: Mapping[str, Any], node: int) -> bool:
    """Return whether a node or one below it has a mesh."""
    left, seen = [node], set[int]()
    while left:
        i = left.pop()
        if "mesh" in tree["nodes"][i]:
            return True
        seen.add(i)
        left += [child for child in tree["nodes"][i].get("children", ()) if child not in seen]
    return False


def _of_node(node: Mapping[str, Any], where: str) -> Found:
    extensions = node.get("extensions", {})
    if "mesh" in node and "EXT_mesh_gpu_instancing" in extensions:
        yield f"{where} repeats its mesh by EXT_mesh_gpu_instancing, which is not read", "a node for each instance"
    if not extensions.get("KHR_node_visibility", {}).get("visible", True):
        yield f"{where} is hidden by KHR_node_visibility, which is not read", "a file without hidden nodes"


def _of_primitive(tree: Mapping[str, Any], primitive: Mapping[str, Any], where: str) -> Found:
    """Yield what is misread of one primitive of a mesh; lines and points are no surfaces."""
    mode, position = primitive.get("mode", _TRIANGLES), primitive["attributes"].get("POSITION")
    if mode < _TRIANGLES or position is None:
        return
    if mode == _FAN:
        yield f"{where} has triangle fans (mode 6), which are not read", "triangles (mode 4)"
    corners = tree["accessors"][position]
    indices = tree["accessors"][primitive["indices"]] if "indices" in primitive else {}
    count = indices.get("count", corners["count"])
    if mode == _TRIANGLES and count % 3:
        yield f"{where} has {count} corners of triangles (mode {_TRIANGLES})", "three corners a triangle"
    if corners["type"] != "VEC3":
        yield f"{where} has corners of type {shown(corners['type'])}", "VEC3"
    for what, accessor in (("corners", corners), ("indices", indices)):
        if "sparse" in accessor:
            yield f"{where} has {what} of a sparse accessor, which is not read", "accessors that are not sparse"
    if corners.get("normalized"):
        problem = f"{where} has normalised integers as corners (KHR_mesh_quantization), which are not read"
        yield problem, "corners as floats, exported without quantization"
    packed = "KHR_draco_mesh_compression" in primitive.get("extensions", {}) and "bufferView" not in corners
    if packed and find_spec("DracoPy") is None:
        yield f"{where} is compressed by Draco, which is not read", "a file exported without compression"
