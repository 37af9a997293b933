"""The types that the fields of waveforms, radars and impairments declare, checked in one place."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import cache
from types import UnionType
from typing import Any, SupportsFloat, get_args, get_type_hints

import numpy as np


def finite(name: str, value: object) -> float:
    """Return a number. Raises: ValueError that names the argument, for another type or a number not finite."""
    if not (_is_number(value) and math.isfinite(float(value))):  # type: ignore[arg-type]
        raise ValueError(f"{name} = {value!r}: must be finite, a number")
    return float(value)  # type: ignore[arg-type]


def check_declared(kind: Any, given: Mapping[str, object]) -> None:
    """Check values by the types that fields of a class declare: numbers finite, whole numbers, true or false, objects.

    Args: kind, the class; given, the values by field. Arrays, tuples and texts are left to checks of their own.
    Raises: ValueError that names the field.
    """
    for name, (wanted, may_be_none) in _declared(kind).items():
        value, where = given[name], f"{kind.__name__}.{name}"
        if value is None and may_be_none:
            continue
        if wanted is float:
            finite(where, value)
        elif wanted in _ALLOWED:
            says, allows = _ALLOWED[wanted]
            if not allows(value):
                raise ValueError(f"{where} = {value!r}: {says}")
        elif not isinstance(value, wanted):
            article = "an" if wanted.__name__[0] in "AEIOU" else "a"
            also = ", or None" if may_be_none else ""
            raise ValueError(f"{where} = {value!r}: {article} {wanted.__name__} is wanted{also}")


def _is_number(value: object) -> bool:
    return isinstance(value, SupportsFloat) and not isinstance(value, bool) and np.ndim(value) == 0  # type: ignore[arg-type]


def _is_whole(value: object) -> bool:
    return _is_number(value) and float(value).is_integer()  # type: ignore[arg-type]


_ALLOWED: dict[type[Any], tuple[str, Callable[[object], bool]]] = {
    int: ("must be a whole number", _is_whole),
    bool: ("must be true or false", lambda value: isinstance(value, bool | np.bool_)),
}


@cache
def _declared(kind: Any) -> dict[str, tuple[type[Any], bool]]:
    """Return the fields of a class that declare one type of number or object, and whether each may be None."""
    found = {}
    for name, hint in get_type_hints(kind).items():
        members = get_args(hint) if isinstance(hint, UnionType) else (hint,)
        types = [m for m in members if m is not type(None)]
        if len(types) == 1 and isinstance(types[0], type) and types[0] not in (str, tuple):
            may_be_none = len(types) < len(members) or getattr(kind, name, 0) is None
            found[name] = (types[0], may_be_none)
    return found
