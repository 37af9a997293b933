"""Single values as Python's own: what stands for a number, a truth value or a word in arguments, fields and tables."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from typing import Any

_DEEPEST = 8  # levels of tables and lists: no table of a scene goes deeper
_LARGEST = 1000  # bits of a whole number: larger ones are no floats
_LONGEST, _CUT = 80, 60  # characters of a value as messages show it


def plain(value: Any) -> Any:
    """Return Python's own number, truth value or text for a scalar of NumPy, alone or in an array without axes, and a
    float for another kind of number (a fraction, a decimal one); anything else as it is."""
    if getattr(value, "shape", None) == () and hasattr(value, "item"):
        value = value.item()
    if isinstance(value, bool | int | float | str) or not hasattr(value, "__float__") or getattr(value, "shape", None):
        return value
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        return value


def is_number(value: object) -> bool:
    """Return whether a value is a single real number, which a text, true or false, and None are not."""
    value = plain(value)
    if isinstance(value, bool):
        return False
    return isinstance(value, float) or (isinstance(value, int) and value.bit_length() <= _LARGEST)


def tabled(value: Any, levels: int = _DEEPEST) -> Any:
    """Return a value as a table holds it: lists for arrays, and Python's own numbers, in it and in what it holds."""
    value = plain(value)
    if hasattr(value, "tolist"):
        value = value.tolist()
    if not levels:
        return value
    if isinstance(value, Mapping):
        return {name: tabled(one, levels - 1) for name, one in value.items()}
    if type(value) in (list, tuple):
        return type(value)(tabled(one, levels - 1) for one in value)
    return value


def is_one_of(value: object, words: Iterable[str]) -> bool:
    """Return whether a value is one of some words; an array or another type is none."""
    return isinstance(value, str) and value in tuple(words)


def as_text(name: object) -> str:
    """Return the name of a file as text that can be written: bytes of it that are no text stand with backslashes."""
    return str(name).encode("utf-8", "backslashreplace").decode("utf-8")


def is_text(given: str) -> bool:
    """Return whether a text can be written as UTF-8: bytes that are no text, as a command line may hold, cannot."""
    return given.isascii() or as_text(given) == given


def meant(value: object, words: Iterable[str]) -> str:
    """Return " (did you mean 'music'?)" where a text is one of some words but for capitals or a slip, else ''."""
    if not isinstance(value, str):
        return ""
    known = {word.lower(): word for word in words}
    close = get_close_matches(value.lower(), known, n=1)
    return f" (did you mean {known[close[0]]!r}?)" if close else ""


def shown(value: Any) -> str:
    """Return a value as messages show it, on one line, cut where it is long."""
    try:
        text = repr(value)
    except ValueError:  # Python writes no whole number of more than 4300 digits
        return "a number of thousands of digits"
    if hasattr(value, "isoformat"):
        text = value.isoformat()  # a date, as it stands in a file
    if hasattr(value, "shape"):
        text = " ".join(text.split())
    return text if len(text) <= _LONGEST else f"{text[:_CUT]}... ({len(text)} characters)"
