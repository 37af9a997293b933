"""Nodes of a glTF file, where they are, and whether a skin leaves its mesh as it was drawn.

Source: Khronos Group, glTF 2.0 Specification (2021), sections 3.5.3 (transformations), 3.7.3.3 (skinned meshes).
"""

from __future__ import annotations

from base64 import b64decode
from collections.abc import Mapping
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from raychan.world.mesh_files.beside import read_beside
from raychan.world.mesh_files.gltf_damage import roots
from raychan.world.meshes.mesh import Floats

_SAME = 1e-5  # of the mesh's size: files round matrices to float32, and joints multiply a few


def placed(tree: Mapping[str, Any]) -> dict[int, Floats]:
    """Return the nodes of the scene that is read, each with its matrix (4, 4) to the scene."""
    left = [(i, np.eye(4)) for i in roots(tree)]
    found: dict[int, Floats] = {}
    while left:
        i, above = left.pop()
        if i not in found:
            node = tree["nodes"][i]
            found[i] = above @ _matrix(node)
            left += [(child, found[i]) for child in node.get("children", ())]
    return found


def _matrix(node: Mapping[str, Any]) -> Floats:
    """Return the matrix (4, 4) of a node: its own, or translation times rotation times scale."""
    if "matrix" in node:
        return np.array(node["matrix"], float).reshape(4, 4).T
    x, y, z, w = np.array(node.get("rotation", (0, 0, 0, 1)), float)
    turn = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    norm = x * x + y * y + z * z + w * w
    made = np.eye(4)
    made[:3, :3] += 2.0 * (w * turn + turn @ turn) / norm if norm else 0.0
    made[:3, :3] *= np.array(node.get("scale", (1, 1, 1)), float)
    made[:3, 3] = node.get("translation", (0, 0, 0))
    return made


def at_rest(tree: Mapping[str, Any], node: int, places: Mapping[int, Floats], binary: bytes, file: Path) -> bool:
    """Return whether the skin of a node leaves its mesh where the node puts it, as a reader without skins does; True
    where the file with its matrices cannot be read, of which the reader tells."""
    try:
        skin, mesh = tree["skins"][tree["nodes"][node]["skin"]], tree["meshes"][tree["nodes"][node]["mesh"]]
        joints = np.array([places[joint] for joint in skin["joints"]])
        if "inverseBindMatrices" in skin:
            joints = joints @ _matrices(tree, skin["inverseBindMatrices"], binary, file)[: len(joints)]
        for primitive in mesh["primitives"]:
            box = tree["accessors"][primitive["attributes"]["POSITION"]]
            corners = np.array([[*c, 1.0] for c in product(*zip(box["min"], box["max"], strict=True))])
            plain = corners @ places[node].T
            off = np.abs(corners @ joints.swapaxes(1, 2) - plain).max()
            if not off <= _SAME * np.ptp(plain, axis=0).max():
                return False
    except OSError:
        return True
    except (LookupError, TypeError, AttributeError, ValueError, ArithmeticError):
        return False
    return True


def _matrices(tree: Mapping[str, Any], index: int, binary: bytes, file: Path) -> Floats:
    """Return matrices (n, 4, 4) of an accessor.

    Raises: LookupError, ValueError, OSError where there are none.
    """
    accessor = tree["accessors"][index]
    view = tree["bufferViews"][accessor["bufferView"]]
    uri = tree["buffers"][view["buffer"]].get("uri")
    if uri is not None:
        binary = b64decode(uri.partition("base64,")[2]) if "base64," in uri else read_beside(file, uri)
    start, step = view.get("byteOffset", 0) + accessor.get("byteOffset", 0), view.get("byteStride", 64)
    rows = [np.frombuffer(binary, "<f4", 16, start + k * step) for k in range(accessor["count"])]
    return np.array(rows, float).reshape(-1, 4, 4).swapaxes(1, 2)
