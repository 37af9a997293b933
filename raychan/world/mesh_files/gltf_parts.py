"""Parts of a glTF file by names that tell them apart: its reader gives all that nodes make of a mesh one name, and
surfaces of several materials numbers."""

from __future__ import annotations

import json
from collections import Counter, defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from raychan.world.mesh_files.gltf_damage import GLB, header_of, roots

_NAMELESS = "GLTF"  # a mesh without a name
_SURFACES = 4  # mode of a primitive: lower ones are points and lines


class _Piece(NamedTuple):
    """A surface that a node places: `name` of its mesh or material, `alone` in its mesh or not."""

    node: int
    primitive: Mapping[str, Any]
    name: str
    alone: bool


def with_parts(file: Path) -> bytes:
    """Return a glTF with a mesh of its own for each surface that is shown, by the name of its part, and with a scene.

    A part has the name of its mesh, or of its material where the mesh has surfaces of several; where several nodes make
    parts of one name, that of the node (and a dot and the material). What is then still alike is numbered.
    Raises: SceneError for a file without a header.
    """
    data = file.read_bytes()
    tree, rest = header_of(data, file)
    tree["scenes"], tree["scene"] = [{"nodes": list(roots(tree))}], 0
    nodes, pieces = tree.get("nodes", []), _pieces(tree)
    meshes: list[dict[str, Any]] = []
    for node in nodes:
        node.pop("mesh", None)
    # The reader takes the last child first.
    for piece, name in reversed(list(zip(pieces, _names(pieces, nodes), strict=True))):
        own = nodes[piece.node]
        if not piece.alone:
            own = {"name": name}
            nodes[piece.node].setdefault("children", []).append(len(nodes))
            nodes.append(own)
        own["mesh"] = len(meshes)
        meshes.append({"name": name, "primitives": [piece.primitive]})
    tree["meshes"] = meshes
    text = json.dumps(tree).encode()
    if not data.startswith(GLB):
        return text
    text += b" " * (-len(text) % 4)
    sizes = [(20 + len(text) + len(rest)).to_bytes(4, "little"), len(text).to_bytes(4, "little")]
    return b"".join([data[:8], sizes[0], sizes[1], b"JSON", text, rest])


def _pieces(tree: Mapping[str, Any]) -> list[_Piece]:
    """Return the surfaces of the nodes that are shown, in the order of the nodes."""
    shown, left = set[int](), list(roots(tree))
    while left:
        i = left.pop()
        shown.add(i)
        left += tree["nodes"][i].get("children", ())
    found = []
    for i in sorted(shown):
        if "mesh" not in tree["nodes"][i]:
            continue
        mesh = tree["meshes"][tree["nodes"][i]["mesh"]]
        surfaces = [p for p in mesh["primitives"] if p.get("mode", _SURFACES) >= _SURFACES]
        paints = [tree["materials"][p["material"]].get("name") if "material" in p else None for p in surfaces]
        own = str(mesh.get("name") or tree["nodes"][i].get("name") or _NAMELESS)
        several = len(set(paints)) > 1
        for p, paint in zip(surfaces, paints, strict=True):
            found.append(_Piece(i, p, str(paint) if several and paint else own, len(surfaces) == 1))
    return found


def _names(pieces: list[_Piece], nodes: list[dict[str, Any]]) -> list[str]:
    """Return a name for each piece, no two alike."""
    by_name = defaultdict(set)
    for piece in pieces:
        by_name[piece.name].add(piece.node)
    wanted = []
    for piece in pieces:
        own = str(nodes[piece.node].get("name") or "")
        if len(by_name[piece.name]) > 1 and own:
            wanted.append(own if piece.alone else f"{own}.{piece.name}")
        else:
            wanted.append(piece.name)
    given, count, taken = [], Counter[str](), set(wanted)
    for name in wanted:
        new, count[name] = name, count[name] + 1
        while count[name] > 1 and (new := f"{name}_{count[name] - 1}") in taken:
            count[name] += 1
        taken.add(new)
        given.append(new)
    return given
