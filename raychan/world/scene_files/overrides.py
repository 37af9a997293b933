"""Scene tables read from TOML text, and single keys of them overridden, as `--set` does."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from copy import deepcopy
from pathlib import Path
from typing import Any

from raychan.scalars import is_text
from raychan.world.errors import SceneError, nearest, shown
from raychan.world.mesh_files.mesh_io import SUFFIXES

LATER = "# later by [s]: "
"""Begins the line in a scene's text that says at which later time the scene is taken."""

XYZ = ("x", "y", "z")
VECTORS = ("position", "velocity_mps", "rx_position", "rx_velocity_mps", "rcs_point", "spin_dps")
"""Keys of three numbers, of which each goes by its letter."""


def refuse_mesh(file: Path) -> None:
    """Raise SceneError for the name of a mesh where a scene is wanted."""
    if file.suffix.lower() in SUFFIXES:
        takes = "a scene file (.toml), in which a body names the mesh; `info` and `rcs` take meshes themselves"
        raise SceneError("is a mesh, not a scene", file=file, allowed=takes)


def no_toml(reason: object, file: Any, line: int = 0) -> SceneError:
    """Return the error for a file that is no TOML; another ending than .toml may be that of a mesh that is not read."""
    if isinstance(reason, UnicodeDecodeError):
        line = reason.object[: reason.start].count(b"\n") + 1
        reason = f"byte 0x{reason.object[reason.start]:02x} is no text in UTF-8"
    if file is None or Path(file).suffix.lower() in ("", ".toml"):
        return SceneError(f"not valid TOML: {reason}", file=file, line=line, allowed="a text in TOML 1.0")
    allowed = f"a scene file (.toml), in which a body may name a mesh; meshes are {', '.join(SUFFIXES)}"
    return SceneError(f"neither a text in TOML nor a mesh that can be read ({reason})", file=file, allowed=allowed)


def parsed(text: str, file: Any = None) -> dict[str, Any]:
    """Return the tables of TOML text; SceneError with the line where it is broken."""
    if not isinstance(text, str):
        raise SceneError(f"{shown(text)} is not possible", file=file, value=text, allowed="the text of a scene file")
    if not is_text(text):
        raise SceneError("holds bytes that are no text", file=file, allowed="a text in UTF-8")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as e:
        found = re.search(r"line (\d+)", str(e))
        line = int(found[1]) if found else len(text.splitlines())
        raise no_toml(_twice(text, line) if "Cannot overwrite" in str(e) else e, file, line) from None
    except ValueError as e:  # a number of too many digits, a date that is none
        raise no_toml(e, file) from None
    except RecursionError:
        raise SceneError("tables or lists nested too deep", file=file, allowed="a few levels") from None


def _twice(text: str, line: int) -> str:
    """Return the words for a key that stands in a line of a text and before it."""
    key = text.splitlines()[line - 1].partition("=")[0].strip()
    return f"'{key}' is given twice, or is a value and a table"


def listed(changes: Any) -> list[str]:
    """Return changes as a list of texts. Raises: SceneError for anything else, one text alone among it."""
    found = None if isinstance(changes, str) or not isinstance(changes, Iterable) else list(changes)
    if found is None or not all(isinstance(change, str) for change in found):
        allowed = "a list of texts, as ['radar.power_dbm=10']"
        raise SceneError(f"{shown(changes)} is not possible", key="changes", value=changes, allowed=allowed)
    return found


def changed(data: Mapping[str, Any], changes: Sequence[str], file: Any = None) -> dict[str, Any]:
    """Return a copy of a scene's tables with keys set, each change written 'dotted.key=value'; bodies go by name, the
    numbers of a vector by x, y, z."""
    out = deepcopy(dict(data))
    for change in changes:
        key, found, value = change.partition("=")
        if not is_text(change):
            raise SceneError(f"{shown(change)} is not possible", file=file, value=change, allowed="a text in UTF-8")
        words = key.strip().split(".")
        if not found or not all(words):
            raise SceneError(f"'{change}' is no change", file=file, key=key, allowed="dotted.key=value")
        at: Any = out
        for i, word in enumerate(words[:-1]):
            at = _step(at, word, ".".join(words[: i + 1]), file)
        if _is_vector(at):
            if words[-1] not in XYZ:
                raise SceneError(f"no number '{words[-1]}'", file=file, key=key, value=at, allowed="one of x, y, z")
            at[XYZ.index(words[-1])] = _value(value.strip())
            continue
        if words[-2:-1] and words[-2] in VECTORS:
            where, allowed = ".".join(words[:-1]), "all three numbers, as [0, 0, 0.5]; then each by its letter"
            raise SceneError("is not set", file=file, key=where, allowed=allowed)
        if isinstance(at, list) and any(isinstance(one, dict) for one in at):
            _step(at, words[-1], key.strip(), file)  # says which bodies there are
            allowed = f"one of its keys, as {key.strip()}.position=[0, 0, 0.5]"
            raise SceneError("is a whole table", file=file, key=key.strip(), allowed=allowed)
        if not isinstance(at, dict):
            raise SceneError("holds no keys", file=file, key=".".join(words[:-1]), value=at, allowed="a table")
        at[words[-1]] = _value(value.strip())
    return out


def _is_vector(at: Any) -> bool:
    return isinstance(at, list) and len(at) == 3 and not any(isinstance(x, dict | list) for x in at)


def _step(at: Any, word: str, key: str, file: Any) -> Any:
    if isinstance(at, list) and not _is_vector(at):
        names = [b.get("name") for b in at if isinstance(b, dict)]
        if word not in names:
            raise SceneError(
                f"no body '{word}'", file=file, key=key, value=word, allowed=nearest(word, map(str, names))
            )
        return at[names.index(word)]
    if isinstance(at, dict):
        if isinstance(at.get(word), str):
            raise SceneError("holds no keys", file=file, key=key, value=at[word], allowed="a table")
        return at.setdefault(word, {})
    raise SceneError("holds no keys", file=file, key=key, value=at, allowed="a table")


def _value(text: str) -> Any:
    """Return the TOML value of a text; the text itself where it is none."""
    try:
        return tomllib.loads(f"x = {text}")["x"]
    except (ValueError, RecursionError):
        return text
