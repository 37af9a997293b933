"""A mapping that does not change once it is made, and yet is a dict to all that copies, compares or writes it."""

from __future__ import annotations

from typing import Any, NoReturn


class ReadOnly(dict[str, object]):
    """A dict that raises TypeError where it is to be changed."""

    def _refuse(self, *_: object, **__: object) -> NoReturn:
        raise TypeError("this mapping is read-only: make a new body, with dataclasses.replace(body, params={...})")

    __setitem__ = __delitem__ = __ior__ = update = setdefault = pop = popitem = clear = _refuse  # type: ignore[assignment]

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (dict(self),)
