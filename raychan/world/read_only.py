"""Values that do not change once they are taken over: what a body is given stays the caller's, and may change later."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NoReturn

from raychan.scalars import tabled


class ReadOnly(dict[str, Any]):
    """A dict that raises TypeError where it is to be changed, and yet is one to all that copies or compares it."""

    def _refuse(self, *_: object, **__: object) -> NoReturn:
        raise TypeError("this mapping is read-only: make a new body, with dataclasses.replace(body, params={...})")

    __setitem__ = __delitem__ = __ior__ = update = setdefault = pop = popitem = clear = _refuse  # type: ignore[assignment]

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (dict(self),)


def kept(value: Any) -> Any:
    """Return a value as it stays: tuples for lists and arrays, read-only mappings for mappings, in it and in what it
    holds, with Python's own numbers; anything else as it is."""
    return _fixed(tabled(value))


def _fixed(value: Any) -> Any:
    if isinstance(value, Mapping):
        return ReadOnly({name: _fixed(one) for name, one in value.items()})
    return tuple(_fixed(one) for one in value) if isinstance(value, list | tuple) else value


def listed(value: Any) -> Any:
    """Return a kept value as a table holds it: lists for tuples, dicts for mappings."""
    if isinstance(value, Mapping):
        return {name: listed(one) for name, one in value.items()}
    return [listed(one) for one in value] if isinstance(value, tuple) else value
