"""The registry of measures: what of ours stands beside a printed figure, by the name that the data files use."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from raychan.study.validation.bench import Bench
from raychan.world.errors import SceneError, nearest

Seen = bool | int | float | str | None
"""What a measure returns; None where the thing was not detected."""

MEASURES: dict[str, Callable[..., Seen]] = {}


def measure(function: Callable[..., Seen]) -> Callable[..., Seen]:
    """Put a function into the registry under its own name; its first argument is the bench."""
    MEASURES[function.__name__] = function
    return function


def measured(bench: Bench, wanted: list[Any], key: str) -> Seen:
    """Return what the measure [name, arguments...] of the figure `key` gives.

    Raises: SceneError where the data name no measure, or give it arguments that it does not take.
    """
    name, *arguments = wanted
    if name not in MEASURES:
        raise SceneError(f"no measure '{name}'", key=key, value=name, allowed=nearest(str(name), MEASURES))
    taken = MEASURES[name].__code__.co_argcount - 1
    least = taken - len(MEASURES[name].__defaults__ or ())
    if not least <= len(arguments) <= taken:
        raise SceneError(f"{len(arguments)} arguments for '{name}'", key=key, value=arguments, allowed=str(taken))
    return MEASURES[name](bench, *arguments)
