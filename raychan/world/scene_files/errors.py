"""Tables checked by their schema, with pydantic's errors translated into the keys of a scene file."""

from __future__ import annotations

import re
from typing import Any

from pydantic import BaseModel, ValidationError

from raychan.scalars import meant, tabled
from raychan.world.errors import SceneError, nearest, shown_in_table
from raychan.world.scene_files.overrides import VECTORS, XYZ


def checked(kind: type[Any], data: Any, file: Any = None, key: str = "") -> Any:
    """Return `data` checked as a table of `kind`, which stands under a key; numbers of NumPy stand for Python's.

    Raises: SceneError for the first error.
    """
    data = tabled(data)
    try:
        return kind.model_validate(data)
    except ValidationError as e:
        raise _explained(kind, data, e, file).at(key=key) from None


_TYPES = {
    "string_type": "a text",
    "bool_type": "true or false",
    "list_type": "a list of tables",
    "dict_type": "a table",
    "model_type": "a table",
    "model_attributes_type": "a table",
    "string_pattern_mismatch": "a text without dots, spaces and control characters",
    "string_too_short": "a text of at least {min_length} character",
    "string_too_long": "a text of at most {max_length} characters",
}
"""What is allowed, by the type of pydantic's error; errors of other types say it themselves."""


def _explained(kind: type[BaseModel], data: Any, error: ValidationError, file: Any) -> SceneError:
    # Unknown keys first: a misspelt key also makes its right spelling missing.
    ranked = sorted(error.errors(), key=_weight)
    found = ranked[0]
    loc, value = found["loc"], found.get("input")
    key = _dotted(loc, data, found["type"] in ("missing", "extra_forbidden"))
    if found["type"] == "extra_forbidden":
        known = _table_at(kind, loc[:-1]).model_fields
        return SceneError(
            f"unknown key '{loc[-1]}'", file=file, key=key, value=value, allowed=nearest(str(loc[-1]), known)
        )
    if found["type"] == "missing":
        return SceneError("key is missing", file=file, key=key, allowed="a value")
    if found["type"] == "value_error" and not isinstance(value, dict):
        problem, _, allowed = _allowed(found).partition("; allowed: ")
        return SceneError(problem, file=file, key=key, value=value, allowed=allowed)
    if found["type"] == "value_error":
        return SceneError("keys do not fit together", file=file, key=key, value=value, allowed=_allowed(found))
    # A key that takes several types has an error for each.
    alike = [e for e in ranked if len(e["loc"]) == len(loc) and _dotted(e["loc"], data, False) == key]
    allowed = " or ".join(dict.fromkeys(map(_allowed, alike)))
    if len(alike) == 1 and found["type"] == "literal_error":
        allowed += meant(value, re.findall("'(.*?)'", found["ctx"]["expected"]))
    if len(alike) == 1 and found["type"] in ("model_type", "model_attributes_type"):
        allowed += f" with keys among {', '.join(sorted(_table_at(kind, loc).model_fields))}"
    return SceneError(f"{shown_in_table(value)} is not possible", file=file, key=key, value=value, allowed=allowed)


def _allowed(found: Any) -> str:
    """Return what is allowed where pydantic found an error."""
    text = _TYPES.get(found["type"])
    if text is not None:
        return text.format(**found.get("ctx", {}))
    return str(found["msg"]).removeprefix("Input should be ").removeprefix("Value error, ")


def _weight(found: Any) -> tuple[bool, bool, int]:
    # Of a union's branches, the one of the right type says more than that the other is of the wrong one.
    return found["type"] != "extra_forbidden", found["type"].endswith("_type"), -len(found["loc"])


def _table_at(kind: type[BaseModel], loc: tuple[Any, ...]) -> type[BaseModel]:
    at: type[BaseModel] = kind
    for step in loc:
        # Steps that are no field (indices, names of materials, branches of a union) stay in or lead to the table.
        if isinstance(step, str) and step in at.model_fields:
            inner = _tables_in(at.model_fields[step].annotation)
            at = inner[0] if inner else at
    return at


def _tables_in(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [t for part in getattr(annotation, "__args__", ()) for t in _tables_in(part)]


def _dotted(loc: tuple[Any, ...], data: Any, whole: bool) -> str:
    """Return the key as people write it: bodies by name, numbers of a vector by x, y, z, no branches of unions; `whole`
    if its end may be absent."""
    words: list[str] = []
    for step in loc:
        if isinstance(data, list) and isinstance(step, int) and step < len(data):
            data = data[step]
            name = data.get("name") if isinstance(data, dict) else None
            number = XYZ[step] if words and words[-1] in VECTORS and step < len(XYZ) else str(step)
            words.append(name if isinstance(name, str) and name and name.isprintable() else number)
        elif isinstance(data, dict) and (step in data or (whole and step == loc[-1])):
            data = data.get(step)
            words.append(str(step))
    return ".".join(words)
