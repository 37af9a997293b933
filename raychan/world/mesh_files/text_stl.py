"""STL files of text: whether a file is one, whether it is whole, and its triangles. trimesh takes words in the names of
solids for facets, and needs lines that end in a line feed."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from raychan.world.errors import SceneError, shown
from raychan.world.meshes.mesh import Floats

_HEAD, _FACET = 84, 50  # bytes of a binary STL: its head, and each triangle
_MARK = b"\xef\xbb\xbf"  # of byte order
_NUMBER = rb"[ \t]+[-+]?(?:(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|nan|inf(?:inity)?)"
_REST = rb"(?!(?:" + _NUMBER + rb"){3}(?:\s*$|[ \t]+[a-z])).*"  # of a line, other than three numbers
_SOLID = re.compile(rb"^[ \t]*(end)?solid\b(.*)", re.I | re.M)
_LINE = re.compile(rb"^[ \t]*(?:facet|endsolid)\b", re.I | re.M)
_VERTEX = re.compile(rb"vertex((?:" + _NUMBER + rb"){3})", re.I)
_ODD_VERTEX = re.compile(rb"^[ \t]*vertex\b" + _REST, re.I | re.M)
_ODD_NORMAL = re.compile(rb"^[ \t]*facet\b(?:[ \t]+normal\b)?+" + _REST, re.I | re.M)


def text_of(file: Path) -> bytes | None:
    """Return the text of an STL, its lines ended by line feeds; None where it is binary."""
    with file.open("rb") as stream:
        head = stream.read(_HEAD)
        # Heads of binary files may begin with "solid", too.
        if file.stat().st_size == _HEAD + _FACET * int.from_bytes(head[80:], "little"):
            return None
        if not head.removeprefix(_MARK).lstrip().lower().startswith(b"solid"):
            return None
        data = head + stream.read()
    text = data.removeprefix(_MARK).replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    # A binary file that is cut short has neither, but for one all on one line.
    return text if _LINE.search(text) or (b"facet" in text.lower() and text.isascii()) else None


def checked_text(text: bytes, file: Path) -> int:
    """Return how many normals of an STL of text are no three numbers.

    Raises: SceneError where it is cut short, and where a facet has no three vertices of three numbers.
    """
    if b"\n" not in text.strip():
        raise SceneError("is all on one line", file=file, allowed="an STL of text with a line for each vertex")
    ends = [bool(line[1]) for line in _SOLID.finditer(text)]
    body = _SOLID.sub(b"", text).lower()  # without names
    vertices, closed = body.count(b"vertex"), body.count(b"endfacet")
    facets = body.count(b"facet") - closed
    if closed < facets or 2 * sum(ends) < len(ends):
        lost = "endfacet" if closed < facets else "endsolid"
        problem = f"is cut short: {facets} facets begin, and an '{lost}' is missing"
        raise SceneError(problem, file=file, value=facets, allowed="a whole STL")
    if odd := _ODD_VERTEX.search(text):
        line = odd[0].decode("latin-1").strip()
        number, problem = text.count(b"\n", 0, odd.start()) + 1, f"{shown(line)} is no vertex of three numbers"
        raise SceneError(problem, file=file, value=line, allowed="'vertex' and three numbers", line=number)
    if not vertices == 3 * facets == len(_VERTEX.findall(body)):
        problem = f"is damaged: {vertices} vertices for {facets} facets, {3 * facets} expected"
        raise SceneError(problem, file=file, value=vertices, allowed="three vertices a facet")
    return sum(1 for _ in _ODD_NORMAL.finditer(text))


def solids(text: bytes) -> list[tuple[str, Floats]]:
    """Return the name of each solid of a text that was checked, and the corners (3 f, 3) of its triangles in turn."""
    found, name = [], ""
    lines = list(_SOLID.finditer(text))
    for line, after in zip(lines, [line.start() for line in lines[1:]] + [len(text)], strict=True):
        if not line[1]:
            name = _decoded(line[2].strip())
        words = b" ".join(_VERTEX.findall(text, line.end(), after)).split()
        if words:
            found.append((name, np.array(list(map(float, words))).reshape(-1, 3)))
    return found


def _decoded(name: bytes) -> str:
    try:
        return name.decode()
    except UnicodeDecodeError:
        return name.decode("latin-1")
