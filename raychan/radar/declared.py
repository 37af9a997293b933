"""The types of arguments, and of the fields of waveforms, radars and impairments, checked in one place."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import cache
from os import PathLike
from types import UnionType
from typing import Any, SupportsFloat, get_args, get_type_hints

import numpy as np
from numpy.typing import NDArray


def finite(name: str, value: object) -> float:
    """Return a number. Raises: ValueError that names the argument, for another type or a number not finite."""
    if not (is_number(value) and math.isfinite(float(value))):  # type: ignore[arg-type]
        raise ValueError(f"{name} = {value!r}: must be finite, a number")
    return float(value)  # type: ignore[arg-type]


def reals(name: str, given: object) -> NDArray[np.float64]:
    """Return numbers as an array. Raises: ValueError that names the argument, where one is a text, true or None."""
    if isinstance(given, np.ndarray) and given.dtype.kind in "iuf":
        return given.astype(np.float64)
    try:
        held = np.array(given, object)
        if all(map(is_number, held.flat)):
            return held.astype(np.float64)
    except (TypeError, ValueError, OverflowError):
        pass
    raise ValueError(f"{name} = {given!r}: numbers are wanted")


def check_type(name: str, value: object, *wanted: type[Any], or_none: bool = False) -> None:
    """Raise ValueError that names the argument unless a value is of a type: float a finite number, int a whole one."""
    if value is None and or_none:
        return
    if wanted == (float,):
        finite(name, value)
    elif len(wanted) == 1 and wanted[0] in _ALLOWED:
        says, allows = _ALLOWED[wanted[0]]
        if not allows(value):
            raise ValueError(f"{name} = {value!r}: {says}")
    elif not isinstance(value, wanted):
        names = [_CALLED.get(x, x.__name__) for x in wanted]
        kinds = " or ".join(f"{'an' if x[0] in 'AEIOU' else 'a'} {x}" for x in names)
        text = " ".join(repr(value).split())
        text = text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."
        raise ValueError(f"{name} = {text}: {kinds} is wanted{', or None' if or_none else ''}")


def check_declared(kind: Any, given: Mapping[str, object]) -> None:
    """Check values by the types that fields of a class declare: numbers finite, whole numbers, true or false, objects.

    Args: kind, the class; given, the values by field. Arrays, tuples and texts are left to checks of their own.
    Raises: ValueError that names the field.
    """
    for name, (wanted, may_be_none) in _declared(kind).items():
        check_type(f"{kind.__name__}.{name}", given[name], wanted, or_none=may_be_none)


def is_number(value: object) -> bool:
    """Return whether a value is a single real number, which a text, true or false, and None are not."""
    if isinstance(value, int) and value.bit_length() > _LARGEST:
        return False
    return isinstance(value, SupportsFloat) and not isinstance(value, bool | np.bool_) and np.ndim(value) == 0  # type: ignore[arg-type]


def is_whole(value: object) -> bool:
    """Return whether a value is a whole number, which a float may be."""
    return is_number(value) and float(value).is_integer()  # type: ignore[arg-type]


_LARGEST = 1000  # bits of a whole number: larger ones are no floats
_LONGEST = 80  # characters of an object as messages show it
_CALLED: dict[Any, str] = {str: "text", PathLike: "path", Callable: "function"}
_ALLOWED: dict[type[Any], tuple[str, Callable[[object], bool]]] = {
    int: ("must be a whole number", is_whole),
    str: ("must be a text", lambda value: isinstance(value, str)),
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
