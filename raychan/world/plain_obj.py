"""Mesh files as trimesh reads them right: it fails over names that are no text. Of indented lines, tabs, comments
within lines, a byte-order mark, and faces that count vertices backwards in an OBJ it loses or misreads faces; of
several objects it takes the first one's name for all."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

from raychan.scalars import as_text, is_text
from raychan.world.errors import SceneError, shown

_ODD = re.compile(
    rb"^[ \t]+(?:f|v|vn|vt|o|g|usemtl|mtllib)[ \t]|^(?:f|v|vn|vt|o|g)\t|^f .*[-#]|^v.*#|\r(?!\n)|\\\r?$", re.M
)
_MARK = b"\xef\xbb\xbf"  # of byte order
_OBJECT, _PAINT = re.compile(rb"^o ", re.M), re.compile(rb"^usemtl (.*)", re.M)
_LIBRARY = re.compile(rb"^mtllib (.*)", re.M)
_KINDS = (b"v", b"vt", b"vn")  # what the numbers of one corner of a face, v/vt/vn, count


def read_by(file: Path) -> dict[str, Any]:
    """Return the arguments of `trimesh.load_scene` for a file. Parts of an OBJ are its materials where it has several,
    else its objects.

    Raises: SceneError for a face of an OBJ that names a vertex before the first.
    """
    from trimesh.resolvers import FilePathResolver

    # The reader calls parts by the file, whose name must be a text.
    beside = FilePathResolver(str(file.with_name(as_text(file.name))))
    kind = file.suffix.lower().removeprefix(".")
    if kind != "obj":
        if is_text(file.name):
            return {"file_obj": str(file)}
        return {"file_obj": io.BytesIO(file.read_bytes()), "file_type": kind, "resolver": beside}
    text = _plain(file.read_bytes(), file)
    libraries = [file.parent / name.decode("latin-1").strip() for name in _LIBRARY.findall(text)]
    paints = len(set(_PAINT.findall(text))) if any(x.is_file() for x in libraries) else 0
    split = paints < 2 and len(_OBJECT.findall(text)) > 1
    return {"file_obj": io.BytesIO(text), "file_type": kind, "resolver": beside, "split_objects": split}


def _plain(data: bytes, file: Path) -> bytes:
    """Return the text of an OBJ without indents and tabs, all vertices counted from the file's begin."""
    data = data.removeprefix(_MARK)
    if not _ODD.search(data):
        return data
    lines = [b" ".join(x.split()) for x in re.sub(rb"\\\r?\n", b" ", data).splitlines()]
    count = dict.fromkeys(_KINDS, 0)
    for i, line in enumerate(lines):
        word, _, rest = line.partition(b" ")
        if word in count:
            count[word] += 1
            lines[i] = line.split(b"#")[0]
        elif word == b"f":
            corners = rest.split(b"#")[0].split()
            lines[i] = b" ".join([word, *(_forwards(corner, count, line, file) for corner in corners)])
    return b"\n".join(lines) + b"\n"


def _forwards(corner: bytes, count: dict[bytes, int], line: bytes, file: Path) -> bytes:
    """Return one corner of a face with its numbers counted from the file's begin."""
    numbers = corner.split(b"/")
    for at, (kind, number) in enumerate(zip(_KINDS, numbers, strict=False)):
        if number.startswith(b"-") and number[1:].isdigit():
            found = count[kind] + 1 + int(number)
            if found < 1:
                text, there = line.decode("latin-1"), f"'{kind.decode()}' lines before it"
                problem = f"{shown(text)} names {kind.decode()} {int(number)}, but {count[kind]} {there}"
                raise SceneError(problem, file=file, value=text, allowed=f"-{count[kind]} to -1, or from 1 on")
            numbers[at] = b"%d" % found
    return b"/".join(numbers)
