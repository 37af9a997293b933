"""Mesh files as trimesh reads them right: it fails over names that are no text. Of an OBJ with indents, tabs, comments
within lines, a byte-order mark, and faces that count vertices backwards it loses or misreads faces; names of parts it
loses with all but the simplest libraries, and makes up where there is none."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

from raychan.scalars import is_text
from raychan.world.mesh_files.beside import files_beside
from raychan.world.mesh_files.gltf_parts import with_parts
from raychan.world.mesh_files.obj_lines import MARK, checked_lines, refused, usual_numbers

_ODD = re.compile(rb"^ +(?:f|v|vn|vt|o|g|usemtl|mtllib) |\t|^f .*[-#]|^v.*#|\r(?!\n)|\\\r?$", re.M)
_OBJECT, _GROUP, _PAINT = (re.compile(rb"^" + word + rb" +(.*)", re.M) for word in (b"o", b"g", b"usemtl"))
_LIBRARY, _NAMES = re.compile(rb"^mtllib +(.*)", re.M), re.compile(rb"^(?:#|usemtl\b|mtllib\b|f[^ \r\n]).*", re.M)
_MORE = re.compile(rb"^(v(?: +[^\s]+){3})[ \t].*", re.M)  # weight or colour behind a vertex
_KINDS = (b"v", b"vt", b"vn")  # what the numbers of one corner of a face, v/vt/vn, count


def read_by(file: Path) -> dict[str, Any]:
    """Return the arguments of `trimesh.load_scene` for a file. Parts of an OBJ are its materials where it has several
    and its library is there, else, and of faces before the first material, its objects.

    Raises: SceneError for a line of an OBJ that is no vertex or face, or names a vertex before the first.
    """
    beside = files_beside(file)
    kind = file.suffix.lower().removeprefix(".")
    if kind in ("glb", "gltf"):
        return {"file_obj": io.BytesIO(with_parts(file)), "file_type": kind, "resolver": beside}
    if kind != "obj":
        if is_text(file.name):
            return {"file_obj": str(file), "resolver": beside}
        return {"file_obj": io.BytesIO(file.read_bytes()), "file_type": kind, "resolver": beside}
    text = plain_text(file)
    checked_lines(text, file)
    text = usual_numbers(text)
    text = _MORE.sub(rb"\1", _parts(text, file))
    split = len(_OBJECT.findall(text)) > 1
    return {"file_obj": io.BytesIO(text), "file_type": kind, "resolver": beside, "split_objects": split}


def _parts(text: bytes, file: Path) -> bytes:
    """Return the text of an OBJ whose objects are its parts: the reader takes names of these as they are."""
    paints = list(_PAINT.finditer(text))
    if len({x[1].strip() for x in paints}) > 1 and any(_is_there(said, file) for said in _LIBRARY.findall(text)):
        # Faces before the first material have but the names of their objects, or of their groups.
        bare, painted = text[: paints[0].start()], text[paints[0].start() :]
        bare = bare if _OBJECT.search(bare) else _GROUP.sub(rb"o \1", bare)
        text = bare + _PAINT.sub(rb"o \1", _OBJECT.sub(b"", painted))
    return _NAMES.sub(b"", text)  # and words that the reader takes for faces, as `free`


def _is_there(said: bytes, file: Path) -> bool:
    """Return whether a library, or one of several on a line, is there; the name of one may have blanks."""
    names = [x.decode("latin-1").strip() for x in (said, *said.split())]
    return any(name and (file.parent / name).is_file() for name in names)


def plain_text(file: Path) -> bytes:
    """Return the text of an OBJ without indents and tabs, all vertices counted from the file's begin, on its lines.

    Raises: SceneError for a face that names a vertex before the first.
    """
    data = file.read_bytes().removeprefix(MARK)
    if not _ODD.search(data):
        return data
    lines = data.splitlines()
    for i in range(len(lines) - 2, -1, -1):
        if lines[i].endswith(b"\\") and not lines[i].lstrip().startswith(b"#"):
            lines[i], lines[i + 1] = lines[i][:-1] + b" " + lines[i + 1], b""
    count = dict.fromkeys(_KINDS, 0)
    for i, line in enumerate(b" ".join(x.split()) for x in lines):
        word, _, rest = line.partition(b" ")
        lines[i] = line
        if word in count:
            count[word] += 1
            lines[i] = line.split(b"#")[0]
        elif word == b"f":
            corners = rest.split(b"#")[0].split()
            lines[i] = b" ".join([word, *(_forwards(corner, count, line, i + 1, file) for corner in corners)])
    return b"\n".join(lines) + b"\n"


def _forwards(corner: bytes, count: dict[bytes, int], line: bytes, at: int, file: Path) -> bytes:
    """Return one corner of a face with its numbers counted from the file's begin."""
    numbers = corner.split(b"/")
    for i, (kind, number) in enumerate(zip(_KINDS, numbers, strict=False)):
        if number.startswith(b"-") and number[1:].isdigit() and int(number):
            found = count[kind] + 1 + int(number)
            if found < 1:
                there = f"'{kind.decode()}' lines before it"
                problem = f"names {kind.decode()} {int(number)}, but {count[kind]} {there}"
                raise refused(line, problem, f"-{count[kind]} to -1, or from 1 on", at, file)
            numbers[i] = b"%d" % found
    return b"/".join(numbers)
