"""Files that a mesh file names, beside it or in folders below: libraries, textures, buffers."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from urllib.parse import unquote

from raychan.scalars import as_text


def files_beside(file: Path) -> Any:
    """Return trimesh's resolver of the files that a mesh file names; it takes names as they are, glTF encodes blanks
    and other letters by percent signs."""
    from trimesh.resolvers import FilePathResolver

    class Decoded(FilePathResolver):
        def get(self, name: str) -> bytes:
            try:
                return bytes(super().get(name))
            except FileNotFoundError:
                return bytes(super().get(unquote(name)))

    # The reader calls parts by the file, whose name must be a text.
    return Decoded(str(file.with_name(as_text(file.name))))


def read_beside(file: Path, name: str) -> bytes:
    """Return the bytes of a file that a mesh file names. Raises: OSError where the reader would not find it."""
    try:
        return bytes(files_beside(file).get(name))
    except ValueError as e:  # out of the folder
        raise FileNotFoundError(name) from e
