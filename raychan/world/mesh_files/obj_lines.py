"""Lines of an OBJ that are no vertex or face, of which its reader tells in words of its parser, or not at all."""

from __future__ import annotations

import re
from pathlib import Path

from raychan.world.errors import SceneError, shown

MARK = b"\xef\xbb\xbf"  # of byte order
_NUMBER = rb"(?i: +[-+]?(?:(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|nan(?:\([^ )\r\n]*\))?|inf(?:inity)?)(?![^ \r\n]))"
_NAN, _KIND = re.compile(rb"^v[nt]? .*nan\(.*", re.M | re.I), re.compile(rb"(nan)\([^ )]*\)", re.I)
_INDEX = rb"[-+]?\d{1,18}"
_CORNER = rb" +" + _INDEX + rb"(?:/(?:" + _INDEX + rb")?){0,2}"
_ENDS = rb" *\r?$"
_MEANT = rb"^(?:fo *|f)[-+\d/]+(?: +[-+\d/]+){2,}" + _ENDS  # as 'f1 2 3'; other words that begin with f are no keywords
_FACE, _VERTEX = re.compile(rb"^f .*", re.M), re.compile(rb"^v ", re.M)
_WRONG = tuple(
    (re.compile(pattern, re.M), problem, allowed)
    for pattern, problem, allowed in (
        (rb"^v(?=[ \r\n]|\Z)(?!(?:" + _NUMBER + rb"){3}).*", "is no vertex of three numbers", "'v' and three numbers"),
        (rb"^vt(?= )(?!(?:" + _NUMBER + rb"){1,}" + _ENDS + rb").*", "is no texture of numbers", "'vt' and numbers"),
        (rb"^vn(?= )(?!(?:" + _NUMBER + rb"){1,}" + _ENDS + rb").*", "is no normal of numbers", "'vn' and numbers"),
        (
            rb"^f(?=[ \r\n]|\Z)(?!(?:" + _CORNER + rb")+" + _ENDS + rb").*|" + _MEANT,
            "is no face of numbered vertices",
            "'f' and corners such as 7, 7/1, 7//2 or 7/1/2",
        ),
        (rb"^f (?:.* )?[-+]?0+(?=[/ \r\n]|\Z).*", "names vertex 0", "vertices counted from 1"),
        (
            rb"^ *(?:surf|bzp|bsp)(?= ).*",
            "is a free-form surface, which is not read",
            "faces in its place: an export of the surface as a mesh",
        ),
        (rb"^ *call(?= ).*", "calls another file, which is not read", "an OBJ that holds all faces"),
    )
)


def checked_lines(text: bytes, file: Path) -> None:
    """Raise SceneError for the first line of an OBJ, without indents and tabs, that is no vertex or face, or a
    surface of another kind."""
    found = [(at.start(), at[0], told, wanted) for pattern, told, wanted in _WRONG if (at := pattern.search(text))]
    if found:
        start, line, problem, allowed = min(found)
        raise refused(line, problem, allowed, text.count(b"\n", 0, start) + 1, file)


def usual_numbers(text: bytes) -> bytes:
    """Return the text of an OBJ with plain `nan` for what C prints, as `-nan(ind)` (C11, 7.21.6.1), which its reader
    knows in some files only; it stands in normals and textures, which are not used."""
    return _NAN.sub(lambda line: _KIND.sub(rb"\1", line[0]), text) if b"(" in text else text


def missing_vertex(text: bytes, file: Path) -> SceneError | None:
    """Return the error of the first face of an OBJ that names a vertex which is not there, if any."""
    count = len(_VERTEX.findall(text))
    for line in _FACE.finditer(text):
        most = max(int(corner.split(b"/")[0]) for corner in line[0].split()[1:])
        if most > count:
            problem = f"names vertex {most}, which the file does not hold"
            return refused(line[0], problem, f"1 to {count}", text.count(b"\n", 0, line.start()) + 1, file)
    return None


def refused(line: bytes, problem: str, allowed: str, number: int, file: Path) -> SceneError:
    """Return the error of a line of a file."""
    text = line.decode("latin-1").strip()
    return SceneError(f"{shown(text)} {problem}", file=file, value=text, allowed=allowed, line=number)
