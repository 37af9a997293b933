"""Scene files with something wrong in them: keys gone, doubled, misspelt, of the wrong type, out of all measure."""

from __future__ import annotations

import copy
import datetime
import json
import math
from typing import Any

NASTY: list[Any] = [
    0, 0.0, -0.0, -1, 1, 2, 3.7, -1e-30, 1e-30, 1e9, -1e9, 1e30, 1e308, -1e308, 10**30, 2**31, 2**63, 20_000,
    math.nan, math.inf, -math.inf, True, False, "", "x", "-1", "é\u202e\u0007", "../../etc/passwd", "a" * 5000, [], {},
    [0, 0], [1, 2, 3], [math.nan] * 3, [1e30, 0, 0], {"x": 1}, [[1, 2], [3, 4]], [[[]]], datetime.date(2024, 2, 29),
    "foo", "taylor(1e9)", "chebyshev(99999)", "taylor(3.3.3)", "blackman", "mm", "auto", "glass", "hann(3)",
]  # fmt: skip


def edited(tables: dict[str, Any], rng: Any) -> str:
    """Return the text of a scene file with one to three things changed."""
    data = copy.deepcopy(tables)
    for _ in range(int(rng.integers(1, 4))):
        _change(data, rng)
    text = dumped(data)
    return _scratched(text, rng) if rng.random() < 0.15 else text


def _leaves(at: Any, into: list[tuple[Any, Any]]) -> list[tuple[Any, Any]]:
    pairs = at.items() if isinstance(at, dict) else enumerate(at) if isinstance(at, list) else ()
    for key, value in pairs:
        into.append((at, key))
        _leaves(value, into)
    return into


def _change(data: dict[str, Any], rng: Any) -> None:
    places = _leaves(data, [])
    if not places:
        return
    at, key = places[int(rng.integers(len(places)))]
    kind = rng.integers(7)
    value = at[key]
    if kind == 0:
        del at[key]
    elif kind == 1 and isinstance(at, dict):
        at[key[:-1] + "y"] = at.pop(key)
    elif kind == 2 and isinstance(at, list):
        at.insert(key, copy.deepcopy(value))
    elif kind <= 4 and isinstance(value, int | float) and not isinstance(value, bool):
        # A wrong unit, or a digit too many.
        at[key] = value * 10.0 ** int(rng.integers(-12, 13)) * (1 if rng.random() < 0.8 else -1)
        if isinstance(value, int) and rng.random() < 0.5:
            at[key] = int(at[key])
    else:
        at[key] = copy.deepcopy(NASTY[int(rng.integers(len(NASTY)))])


def _scratched(text: str, rng: Any) -> str:
    """Return a text that is cut off, has a line twice, or holds what does not belong there."""
    kind, at = rng.integers(4), int(rng.integers(len(text)))
    if kind == 0:
        return text[:at]
    if kind == 1:
        lines = text.splitlines()
        line = int(rng.integers(len(lines)))
        return "\n".join([*lines[: line + 1], *lines[line:]])
    if kind == 2:
        return text[:at] + "\u2028☃\u0000"[int(rng.integers(3))] + text[at:]
    return text + "deep = " + "[" * 5000 + "]" * 5000 + "\nlong = " + "9" * 6000


def dumped(data: dict[str, Any]) -> str:
    """Return tables as TOML: all but lists of tables inline."""
    lines = []
    for key, value in data.items():
        if isinstance(value, dict):
            lines.append(f"[{_key(key)}]\n" + "".join(f"{_key(k)} = {_value(v)}\n" for k, v in value.items()))
        elif isinstance(value, list) and value and all(isinstance(v, dict) for v in value):
            for table in value:
                lines.append(f"[[{_key(key)}]]\n" + "".join(f"{_key(k)} = {_value(v)}\n" for k, v in table.items()))
        else:
            lines.insert(0, f"{_key(key)} = {_value(value)}\n")
    return "".join(lines)


def _key(key: Any) -> str:
    return json.dumps(str(key), ensure_ascii=False)


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else {math.inf: "inf", -math.inf: "-inf"}.get(value, "nan")
    if isinstance(value, int | datetime.date):
        return str(value)
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_value, value)) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(k)} = {_value(v)}" for k, v in value.items()) + "}"
    return json.dumps(str(value), ensure_ascii=False)
