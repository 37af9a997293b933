"""The error that scenes and meshes raise: what is wrong, where, and what is allowed."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path

from raychan.scalars import shown

__all__ = ["SceneError", "is_guess", "nearest", "shown", "shown_in_table"]


class SceneError(ValueError):
    """A scene or mesh that cannot be used; the message says what is wrong, where, and what is allowed.

    Attributes: file (path or None), key (dotted, '' where none applies), value (what was given), allowed (text).
    """

    def __init__(
        self, problem: str, *, file: str | Path | None = None, key: str = "", value: object = None, allowed: str = "",
        line: int = 0,
    ) -> None:  # fmt: skip
        self.problem, self.file, self.key = problem, file, key
        self.value, self.allowed, self.line = value, allowed, line
        where = f"{file}:{line}" if file and line else str(file or "")
        head = ": ".join(x for x in (where, key, problem) if x)
        hint = allowed if is_guess(allowed) else f"allowed: {allowed}"
        super().__init__(f"{head}; {hint}" if allowed else head)

    def at(self, *, file: str | Path | None = None, key: str = "") -> SceneError:
        """Return the same error with its file or the front of its key added."""
        path = ".".join(x for x in (key, self.key) if x)
        return SceneError(
            self.problem, file=self.file or file, key=path, value=self.value, allowed=self.allowed, line=self.line
        )

    def of_key(self, key: str) -> SceneError:
        """Return the same error as one of a scene's key that names the file, which moves into the text."""
        where = f"{self.file}:{self.line}" if self.line else self.file
        return SceneError(f"{where}: {self.problem}", key=key, value=self.value, allowed=self.allowed)


class _Word(str):
    """A text that shows without quotes."""

    __slots__ = ()
    __repr__ = str.__str__


def _with_words(value: object) -> object:
    if isinstance(value, bool):
        return _Word(str(value).lower())
    if isinstance(value, list):
        return [_with_words(one) for one in value]
    return {key: _with_words(one) for key, one in value.items()} if isinstance(value, dict) else value


def shown_in_table(value: object) -> str:
    """Return a value of a table as messages show it, true and false in TOML's letters."""
    return shown(_with_words(value))


def nearest(word: str, known: Iterable[str]) -> str:
    """Return a text that names the nearest known word, first one of the same letters, or lists all where none is
    near."""
    names = sorted(map(str, known))
    close = sorted(get_close_matches(word, names), key=lambda name: sorted(name) != sorted(word))
    return f"did you mean '{close[0]}'?" if close else "one of " + ", ".join(names)


def is_guess(allowed: str) -> bool:
    """Return whether a text is a guess of `nearest` or its like, not a list of what is allowed."""
    return allowed.startswith("did you mean ")
