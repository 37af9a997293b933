"""Objects that stay as they were made."""

from __future__ import annotations

from typing import Any


class Fixed:
    """An object whose public fields are not set again: what was derived from them would go on being used."""

    def __setattr__(self, name: str, value: Any) -> None:
        if not name.startswith("_") and (name in self.__dict__ or hasattr(type(self), name)):
            kind = type(self).__name__
            other = f"make another {kind}, as by {kind.lower()}.override([...])"
            raise AttributeError(f"{kind}.{name} cannot be set again: {other}")
        super().__setattr__(name, value)
