"""Mesh files that are cut short, damaged or of a form, in a way that their readers do not tell."""

from __future__ import annotations

from pathlib import Path

from raychan.world.errors import SceneError
from raychan.world.mesh_files.gltf_forms import understood
from raychan.world.mesh_files.text_stl import checked_text, text_of

_STL_HEAD, _STL_FACET = 84, 50  # bytes
_PACKED = {b"\x1f\x8b\x08": "gzip", b"PK\x03\x04": "zip", b"BZh": "bzip2", b"\xfd7zXZ\0": "xz"}
"""First bytes of files packed by a program. Source: file formats of RFC 1952, APPNOTE 4.3.7, bzip2, xz."""


def checked(file: Path) -> int:
    """Return how many normals of a mesh file are no three numbers (STL of text only).

    Raises: SceneError for a file that is packed, cut short, damaged, or of a form that would be misread.
    """
    kind = file.suffix.lower()
    with file.open("rb") as stream:
        start = stream.read(max(map(len, _PACKED)))
    for mark, packer in _PACKED.items():
        if start.startswith(mark):
            raise SceneError(f"is packed by {packer}", file=file, allowed=f"the {kind} file that is in it, unpacked")
    if kind in (".glb", ".gltf"):
        understood(file)
    elif kind == ".stl":
        text = text_of(file)
        if text is not None:
            return checked_text(text, file)
        _whole_binary_stl(file)
    return 0


def _whole_binary_stl(file: Path) -> None:
    """Raise SceneError for a binary STL of another size than its head says: 84 bytes, then 50 a triangle."""
    with file.open("rb") as stream:
        head = stream.read(_STL_HEAD)
    there = file.stat().st_size
    count = int.from_bytes(head[80:84], "little") if there >= _STL_HEAD else 0
    expected = _STL_HEAD + _STL_FACET * count
    if there < expected:
        least = "" if there >= _STL_HEAD else "at least "
        problem = f"is cut short, or no STL: {there} bytes there, {least}{expected} expected ({count} triangles)"
        raise SceneError(problem, file=file, value=there, allowed="a whole STL")
    if there > expected:
        problem = f"does not end with its {count} triangles: {there} bytes there, {expected} expected"
        raise SceneError(problem, file=file, value=there, allowed="an STL without other bytes at its end")
