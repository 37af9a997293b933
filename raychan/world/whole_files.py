"""Mesh files that are cut short, damaged or of a form, in a way that their readers do not tell."""

from __future__ import annotations

import re
from pathlib import Path

from raychan.world.errors import SceneError, shown
from raychan.world.gltf_forms import understood

_STL_HEAD, _STL_FACET = 84, 50  # bytes
_NUMBER = rb"[ \t]+[-+]?(?:(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|nan|inf(?:inity)?)"
_REST = rb"(?!(?:" + _NUMBER + rb"){3}(?:\s*$|[ \t]+[a-z])).*"  # of a line, other than three numbers
_SOLID = re.compile(rb"^[ \t]*(end)?solid\b.*", re.I | re.M)
_ODD_VERTEX = re.compile(rb"^[ \t]*vertex\b" + _REST, re.I | re.M)
_ODD_NORMAL = re.compile(rb"^[ \t]*facet\b(?:[ \t]+normal\b)?+" + _REST, re.I | re.M)


def checked(file: Path) -> int:
    """Return how many normals of a mesh file are no three numbers (STL of text only).

    Raises: SceneError for a file that is cut short, damaged, or of a form that would be misread.
    """
    kind = file.suffix.lower()
    if kind in (".glb", ".gltf"):
        understood(file)
    elif kind == ".stl":
        with file.open("rb") as stream:
            head = stream.read(1 << 10)
        if head.lstrip().lower().startswith(b"solid") and b"facet" in head.lower():
            return _whole_text_stl(file)
        _whole_binary_stl(file, head)
    return 0


def _whole_binary_stl(file: Path, head: bytes) -> None:
    """Raise SceneError for a binary STL of another size than its head says: 84 bytes, then 50 a triangle."""
    there = file.stat().st_size
    count = int.from_bytes(head[80:84], "little") if there >= _STL_HEAD else 0
    expected = _STL_HEAD + _STL_FACET * count
    if there < expected:
        least = "" if there >= _STL_HEAD else "at least "
        problem = f"is cut short: {there} bytes there, {least}{expected} expected ({count} triangles)"
        raise SceneError(problem, file=file, value=there, allowed="a whole STL")
    if there > expected:
        problem = f"does not end with its {count} triangles: {there} bytes there, {expected} expected"
        raise SceneError(problem, file=file, value=there, allowed="an STL without other bytes at its end")


def _whole_text_stl(file: Path) -> int:
    """Return how many normals of an STL of text are no three numbers.

    Raises: SceneError where it is cut short, and where a facet has no three vertices of three numbers.
    """
    data = file.read_bytes()
    if b"\n" not in data.strip():  # all on one line, which its reader refuses
        return 0
    ends = [bool(line[1]) for line in _SOLID.finditer(data)]
    body = _SOLID.sub(b"", data).lower()  # without names
    vertices, closed = body.count(b"vertex"), body.count(b"endfacet")
    facets = body.count(b"facet") - closed
    if closed < facets or 2 * sum(ends) < len(ends):
        lost = "endfacet" if closed < facets else "endsolid"
        problem = f"is cut short: {facets} facets begin, and an '{lost}' is missing"
        raise SceneError(problem, file=file, value=facets, allowed="a whole STL")
    if odd := _ODD_VERTEX.search(data):
        _refuse(file, data, odd, "is no vertex of three numbers", "'vertex' and three numbers")
    if vertices != 3 * facets:
        problem = f"is damaged: {vertices} vertices for {facets} facets, {3 * facets} expected"
        raise SceneError(problem, file=file, value=vertices, allowed="three vertices a facet")
    return sum(1 for _ in _ODD_NORMAL.finditer(data))


def _refuse(file: Path, data: bytes, line: re.Match[bytes], problem: str, allowed: str) -> None:
    """Raise SceneError for a line of a file."""
    text = line[0].decode("latin-1").strip()
    number = data.count(b"\n", 0, line.start()) + 1
    raise SceneError(f"{shown(text)} {problem}", file=file, value=text, allowed=allowed, line=number)
