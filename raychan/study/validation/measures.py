"""The registry of measures: functions that simulate or compute a printed figure, by the names in the data files."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from raychan.study.validation.bench import Bench
from raychan.world.errors import SceneError, nearest

Seen = bool | int | float | str | None
"""What a measure returns; None where the target is not detected."""

MEASURES: dict[str, Callable[..., Seen]] = {}


def measure(function: Callable[..., Seen]) -> Callable[..., Seen]:
    """Register a function as a measure under its own name; its first argument is the bench."""
    MEASURES[function.__name__] = function
    return function


def measured(bench: Bench, wanted: list[Any], key: str) -> Seen:
    """Return the value of a measure [name, arguments...], for the figure `key`.

    Raises: SceneError where the data name no measure, or give it the wrong number of arguments.
    """
    name, *arguments = wanted
    if name not in MEASURES:
        raise SceneError(f"no measure '{name}'", key=key, value=name, allowed=nearest(str(name), MEASURES))
    taken = MEASURES[name].__code__.co_argcount - 1
    least = taken - len(MEASURES[name].__defaults__ or ())
    if not least <= len(arguments) <= taken:
        raise SceneError(f"{len(arguments)} arguments for '{name}'", key=key, value=arguments, allowed=str(taken))
    return MEASURES[name](bench, *arguments)
