"""PLY files, of text or binary: corners and faces of any number of corners, cut into a fan of triangles each.

Source: G. Turk, The PLY Polygon File Format (1994).
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from raychan.world.errors import SceneError, nearest, shown
from raychan.world.mesh_files.obj_lines import MARK
from raychan.world.mesh_files.ply_rows import Column, Element, Property, binary_rows, text_rows
from raychan.world.meshes.mesh import Floats, Ints

_KINDS = {
    "char": "i1",
    "short": "i2",
    "int": "i4",
    "uchar": "u1",
    "ushort": "u2",
    "uint": "u4",
    "float": "f4",
    **{f"int{8 * n}": f"i{n}" for n in (1, 2, 4, 8)},
    **{f"uint{8 * n}": f"u{n}" for n in (1, 2, 4, 8)},
    "double": "f8",
    "float16": "f2",
    "float32": "f4",
    "float64": "f8",
}
_FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_CORNERS = "vertex_indices", "vertex_index"  # names of the list of a face's corners
_COUNT = re.compile(r"\+?[0-9]{1,18}")
_END = re.compile(rb"^[ \t]*end_header[ \t]*\r?\n", re.M)


def read_ply(file: Path) -> tuple[Floats, Ints, bool]:
    """Return corners (v, 3) and triangles (f, 3) of a PLY, and whether faces had more than three corners.

    Raises: SceneError for a file that is cut short, damaged or no PLY.
    """
    data = file.read_bytes().removeprefix(MARK)
    order, elements, lines, start = _head(data, file)
    corners = _list_of_corners(elements, file)
    for name in "xyz":
        if not any(p.name == name and not p.count for e in elements if e.name == "vertex" for p in e.properties):
            problem = f"'{name}' is missing among the properties of its vertices"
            raise SceneError(problem, file=file, allowed="vertices of x, y and z")
    wanted = {"vertex": ("x", "y", "z"), "face": (corners,)}
    rows = binary_rows if order else text_rows
    tables = rows(data[start:], [Element(e.name, e.rows, e.properties, order) for e in elements], wanted, lines, file)
    empty = Column(np.zeros(0), np.zeros(0, np.int64))
    vertices = np.column_stack([tables["vertex"].get(name, empty).values.astype(float) for name in "xyz"])
    listed = tables["face"][corners]
    return vertices, _fans(_numbers(listed, len(vertices), file), listed.lengths), bool((listed.lengths > 3).any())


def _head(data: bytes, file: Path) -> tuple[str, list[Element], int, int]:
    """Return the byte order of a PLY, '' of text, its elements, and how many lines and bytes its header has."""
    if not data[:4].lower().startswith((b"ply\n", b"ply\r", b"ply ")):
        raise SceneError("cannot be read as a mesh: it does not begin with 'ply'", file=file, allowed="a valid .ply")
    end = _END.search(data)
    if end is None:
        raise SceneError("is cut short: its header has no 'end_header'", file=file, allowed="a whole PLY")
    order: str | None = None
    elements: list[Element] = []
    lines = data[: end.start()].decode("latin-1").split("\n")
    for number, line in enumerate(map(str.strip, lines), 1):
        word, *rest = line.split() or [""]
        if word == "format":
            if rest[:1] not in [[name] for name in _FORMATS]:
                raise _wrong(file, number, line, f"{shown(line)} is no format", ", ".join(_FORMATS))
            order = _FORMATS[rest[0]]
        elif word == "element":
            if len(rest) != 2 or rest[0] in [e.name for e in elements]:
                raise _wrong(file, number, line, f"{shown(line)} is no element", "'element NAME NUMBER', a name once")
            if not _COUNT.fullmatch(rest[1]):
                held = rest[1] if len(rest[1]) < 20 else shown(rest[1])
                problem = f"holds {held} of '{rest[0]}'"
                raise _wrong(file, number, rest[1], problem, "a number from 0 on, of 18 digits at most")
            elements.append(Element(rest[0], int(rest[1]), []))
        elif word == "property":
            if not elements:
                raise _wrong(file, number, line, f"{shown(line)} stands before any element", "properties of elements")
            elements[-1].properties.append(_property(line, rest, number, file))
    if order is None:
        raise SceneError("its header has no 'format'", file=file, allowed=", ".join(_FORMATS))
    return order, elements, len(lines), end.end()


def _property(line: str, rest: list[str], number: int, file: Path) -> Property:
    """Return the property that a line of a header declares."""
    listed = rest[:1] == ["list"]
    if len(rest) != (4 if listed else 2):
        allowed = "'property TYPE NAME' or 'property list TYPE TYPE NAME'"
        raise _wrong(file, number, line, f"{shown(line)} is no property", allowed)
    *kinds, name = rest[1:] if listed else rest
    for kind in kinds:
        if kind not in _KINDS:
            raise _wrong(file, number, line, f"unknown type '{kind}'", nearest(kind, _KINDS))
    if listed and _KINDS[kinds[0]].startswith("f"):
        raise _wrong(file, number, line, f"a list counted in '{kinds[0]}'", "lists counted in whole numbers")
    return Property(name, _KINDS[kinds[-1]], _KINDS[kinds[0]] if listed else "")


def _wrong(file: Path, number: int, line: str, problem: str, allowed: str) -> SceneError:
    return SceneError(problem, file=file, value=line, allowed=allowed, line=number)


def _list_of_corners(elements: list[Element], file: Path) -> str:
    """Return the name of the list of a face's corners."""
    lists = [p.name for e in elements if e.name == "face" and e.rows for p in e.properties if p.count]
    named = [name for name in _CORNERS if name in lists]
    if named or len(lists) == 1:
        return (named or lists)[0]
    if lists:
        allowed = "a list " + " or ".join(_CORNERS)
        raise SceneError(f"its faces have the lists {', '.join(lists)}", file=file, allowed=allowed)
    if any(e.name == "tristrips" and e.rows for e in elements):
        raise SceneError("holds triangle strips ('tristrips'), which are not read", file=file, allowed="faces")
    raise SceneError("mesh is empty: no triangles", file=file, allowed="at least one triangle")


def _numbers(listed: Column, vertices: int, file: Path) -> Ints:
    """Return the numbers of faces' corners; raise SceneError for the first that is none of so many vertices."""
    values = listed.values
    wrong = np.flatnonzero(~((values >= 0) & (values < vertices) & (values == np.rint(values))))
    if len(wrong):
        face = int(np.searchsorted(np.cumsum(listed.lengths), wrong[0], "right"))
        value = values[wrong[0]].item()
        problem = f"face {face + 1} names vertex {value:.12g}, which the file does not hold"
        line = listed.lines[face] if len(listed.lines) else 0
        raise SceneError(problem, file=file, value=value, allowed=f"whole numbers, 0 to {vertices - 1}", line=line)
    return values.astype(np.int64)


def _fans(corners: Ints, lengths: Ints) -> Ints:
    """Return the triangles (f, 3) of faces, in their order; of one or two corners a triangle without area."""
    count = np.where(lengths > 0, np.maximum(lengths - 2, 1), 0)
    first = np.repeat(np.cumsum(lengths) - lengths, count)
    last = np.repeat(lengths - 1, count)
    k = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return np.column_stack([corners[first + np.minimum(k + i, last) * (i > 0)] for i in range(3)])
