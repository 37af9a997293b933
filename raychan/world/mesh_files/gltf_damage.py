"""The header of a glTF file, and what is damaged in it: its reader tells of that in words of its parser, or not.

Source: Khronos Group, glTF 2.0 Specification (2021), sections 3.5.2 (nodes are strict trees), 3.6 (buffers, accessors),
4.4 (GLB).
"""

from __future__ import annotations

import json
from base64 import b64decode
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from raychan.world.errors import SceneError, shown
from raychan.world.mesh_files.beside import read_beside
from raychan.world.mesh_files.obj_lines import MARK

GLB = b"glTF"
_HEAD, _CHUNK = 12, 8  # bytes of the head of a GLB and of each chunk in it
_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}  # of a component
_NUMBERS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_TABLES = {
    "scenes": "scene", "nodes": "node", "meshes": "mesh", "accessors": "accessor", "bufferViews": "bufferView",
    "buffers": "buffer", "materials": "material",
}  # fmt: skip

Found = Iterator[tuple[str, str]]
"""What was found in a file, and what can be done."""


def header_of(data: bytes, file: Path) -> tuple[dict[str, Any], bytes]:
    """Return the header of a glTF, and what follows it in a GLB: its other chunks, each with its head.

    Raises: SceneError where there is none.
    """
    text, rest = data.removeprefix(MARK), b""
    if file.suffix.lower() == ".glb":
        if not data.startswith(GLB):
            raise SceneError(f"does not begin with {GLB.decode()}", file=file, allowed="a valid .glb")
        text, rest = _chunk(data, _HEAD, file)
        if len(rest) >= _CHUNK:
            _chunk(rest, 0, file)
    try:
        tree = json.loads(text.decode("utf-8", "replace"))
    except json.JSONDecodeError as e:
        problem = f"is cut short or damaged: its header is no JSON from character {e.pos} on ({e.msg})"
        raise SceneError(problem, file=file, allowed="a whole " + file.suffix) from e
    except (ValueError, RecursionError) as e:  # numbers of thousands of digits, tables thousands deep
        raise SceneError(f"has a header that cannot be read ({e})", file=file, allowed="a valid " + file.suffix) from e
    if not isinstance(tree, dict):
        raise SceneError("its header is no table", file=file, allowed="a valid " + file.suffix)
    return tree, rest


def _chunk(data: bytes, start: int, file: Path) -> tuple[bytes, bytes]:
    """Return the chunk of a GLB whose head starts at a byte, and what follows it. Raises: SceneError if it is cut."""
    first = start + _CHUNK
    size = int.from_bytes(data[start : start + 4], "little")
    if len(data) < first + size:
        there = max(len(data) - first, 0)
        raise SceneError(f"is cut short: {there} bytes of a chunk of {size} there", file=file, allowed="a whole .glb")
    return data[first : first + size], data[first + size :]


def roots(tree: Mapping[str, Any]) -> Sequence[int]:
    """Return the nodes of a glTF that are shown: those of its scene, of the first where none is named, and all that are
    no children where there are no scenes."""
    scenes, nodes = tree.get("scenes", ()), tree.get("nodes", ())
    if scenes:
        found: Sequence[int] = scenes[tree.get("scene", 0)].get("nodes", ())
        return found
    below = {child for node in nodes for child in node.get("children", ())}
    return [i for i in range(len(nodes)) if i not in below]


def damaged(tree: Mapping[str, Any], rest: bytes, file: Path) -> Found:
    """Yield what is wrong with the header of a glTF, or its buffers."""
    yield from _missing(tree)
    if tree.get("meshes") and not tree.get("scenes") and not tree.get("nodes"):
        yield "has meshes, but no scene and no node that places them", "a file with a scene"
    yield from _no_tree(tree)
    yield from _short(tree, rest, file)


def _missing(tree: Mapping[str, Any]) -> Found:
    """Yield what a header names that is not in it."""
    named = [("the file", "scenes", [tree["scene"]] if "scene" in tree and tree.get("scenes") else [])]
    named += [(f"scene {i}", "nodes", x.get("nodes", ())) for i, x in enumerate(tree.get("scenes", ()))]
    for i, node in enumerate(tree.get("nodes", ())):
        named.append((f"node '{node.get('name', i)}'", "nodes", node.get("children", ())))
        named.append((f"node '{node.get('name', i)}'", "meshes", [node[x] for x in ("mesh",) if x in node]))
    for i, mesh in enumerate(tree.get("meshes", ())):
        for p in mesh["primitives"]:
            where = f"mesh '{mesh.get('name', i)}'"
            own = [*p["attributes"].values(), *(p[x] for x in ("indices",) if x in p)]
            named.append((where, "accessors", own))
            named.append((where, "materials", [p[x] for x in ("material",) if x in p]))
    for table, key, other in (("accessors", "bufferView", "bufferViews"), ("bufferViews", "buffer", "buffers")):
        named += [(f"{_TABLES[table]} {i}", other, [x[key]]) for i, x in enumerate(tree.get(table, ())) if key in x]
    for where, table, numbers in named:
        count = len(tree.get(table, ()))
        for number in numbers:
            if type(number) is not int or not 0 <= number < count:
                allowed = f"0 to {count - 1}" if count else f"a file with {table}"
                yield f"{where} names {_TABLES[table]} {shown(number)}, which is not there", allowed


def _no_tree(tree: Mapping[str, Any]) -> Found:
    """Yield nodes of the scene that are below themselves, or in two places."""
    left, parent = [(i, -1) for i in roots(tree)], dict[int, int]()
    while left:
        i, above = left.pop()
        if i in parent:
            name = shown(str(tree["nodes"][i].get("name", i)))
            while above not in (i, -1):
                above = parent[above]
            where = "is below itself" if above == i else "is a root of the scene or a child more than once"
            yield f"node {name} {where}", "nodes that are a tree"
            return
        parent[i] = above
        left += [(child, i) for child in tree["nodes"][i].get("children", ())]


def _short(tree: Mapping[str, Any], rest: bytes, file: Path) -> Found:
    """Yield views that end beyond their buffer, and accessors that end beyond their view."""
    sizes: dict[int, int | None] = {}
    views = tree.get("bufferViews", ())
    for i, view in enumerate(views):
        buffer = view["buffer"]
        if buffer not in sizes:
            sizes[buffer] = _size(tree["buffers"][buffer], rest if buffer == 0 else b"", file)
        size, start = sizes[buffer], view.get("byteOffset", 0)
        end = start + view["byteLength"]
        if size is not None and not 0 <= start <= end <= size:
            problem = f"bufferView {i} is bytes {start} to {end} of buffer {buffer}, which has {size}"
            yield problem, "a whole buffer"
    for i, accessor in enumerate(tree.get("accessors", ())):
        kind, shape, count = accessor["componentType"], accessor["type"], accessor["count"]
        if kind not in _BYTES or shape not in _NUMBERS:
            what = f"componentType {shown(kind)} and type {shown(shape)}"
            yield f"accessor {i} has {what}", f"one of {', '.join(map(str, _BYTES))}; {', '.join(_NUMBERS)}"
        if "bufferView" not in accessor:
            continue
        view, row = views[accessor["bufferView"]], _BYTES[kind] * _NUMBERS[shape]
        start = accessor.get("byteOffset", 0)
        end = start + (count - 1) * view.get("byteStride", row) + row
        if not 0 <= start <= end <= view["byteLength"]:
            where = f"bufferView {accessor['bufferView']}, which has {view['byteLength']}"
            yield f"accessor {i} of {count} rows is bytes {start} to {end} of {where}", "as many rows as are there"


def _size(buffer: Mapping[str, Any], rest: bytes, file: Path) -> int | None:
    """Return how many bytes a buffer has, or None where they are not there, of which the reader tells.

    Args: rest of a GLB behind its header, begins with the chunk of its first buffer.
    """
    uri = buffer.get("uri")
    if uri is None:
        return int.from_bytes(rest[:4], "little") if rest else None
    try:
        return len(b64decode(uri.partition("base64,")[2]) if "base64," in uri else read_beside(file, uri))
    except OSError:
        return None
