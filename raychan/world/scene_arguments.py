"""What a scene is given as objects in Python, checked by the rules of scene files: bodies and materials."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from raychan.scalars import plain
from raychan.world.body import Body
from raychan.world.errors import SceneError, shown
from raychan.world.limbs import LimbMotion
from raychan.world.material import Material
from raychan.world.scene_files.errors import checked
from raychan.world.scene_files.schema import BodyTable

_KEYS = (
    "params", "unit", "up", "forward", "scale", "crease_deg", "materials", "rcs_dbsm", "rcs_point",
)  # fmt: skip
"""Fields of a body that its table limits; those of its motion have checks of their own."""
_NAMES = {"shape": (str, "a text"), "role": (str, "a text"), "material": (str | Material, "a name or a Material")}
"""Fields whose checks propose names, with the types they take."""


def bodies_of(given: Any, file: Path | None) -> tuple[tuple[Body, ...], tuple[Body, ...]]:
    """Return the bodies that a scene is given, and these with limbs for those that have any.

    Raises: SceneError that names the scene's file where one is none, or has a field that cannot be.
    """
    try:
        bodies = _bodies(given)
        return bodies, tuple(limb for body in bodies for limb in body.limbs)
    except SceneError as e:
        raise e.at(file=file) from None


def _bodies(given: Any) -> tuple[Body, ...]:
    if isinstance(given, str | Body) or not isinstance(plain(given), Iterable):
        raise _refused(given, "bodies", "a list of Body")
    bodies = tuple(given)
    for number, body in enumerate(bodies):
        if not isinstance(body, Body):
            raise _refused(body, f"bodies.{number}", "a Body")
        # Limbs come from a scene, where the whole was checked.
        if not isinstance(body.__dict__.get("motion"), LimbMotion):
            _check(body, number)
    return bodies


def materials_of(given: Any) -> dict[str, Material]:
    """Return the materials that a scene is given, by name. Raises: SceneError where one is none."""
    if not isinstance(given, Mapping):
        raise _refused(given, "materials", "a dict of Material by name")
    for name, one in given.items():
        if not isinstance(one, Material):
            raise _refused(one, f"materials.{name}", "a Material")
    return dict(given)


def check_texts(**given: Any) -> None:
    """Raise SceneError unless title and text of a scene are texts, and its path and folder paths or None."""
    for name, value in given.items():
        kind, allowed = (str, "a text") if name in ("title", "text") else (Path | None, "a Path, or None")
        if not isinstance(value, kind):
            raise _refused(value, name, allowed)


def _check(body: Body, number: int) -> None:
    """Raise SceneError where a field of a body could not stand in its table."""
    try:
        checked(BodyTable, {"name": body.name, "shape": ""})
    except SceneError as e:
        raise e.at(key=f"bodies.{number}") from None
    try:
        checked(BodyTable, {"name": "body", "shape": ""} | {key: _plain(getattr(body, key)) for key in _KEYS})
    except SceneError as e:
        raise e.at(key=f"bodies.{body.name}") from None
    for name, (kind, allowed) in _NAMES.items():
        value = getattr(body, name)
        if not isinstance(value, kind | None):
            raise _refused(value, f"bodies.{body.name}.{name}", allowed)


def _plain(value: Any) -> Any:
    """Return a value as a table holds it: lists for arrays and tuples, names for materials."""
    if isinstance(value, Material):
        return value.name
    if isinstance(value, Mapping):
        return {name: _plain(one) for name, one in value.items()}
    return [_plain(one) for one in value] if isinstance(value, list | tuple) else value


def _refused(value: Any, key: str, allowed: str) -> SceneError:
    return SceneError(f"{shown(value)} is not possible", key=key, value=value, allowed=allowed)
