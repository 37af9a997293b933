"""Built-in parametric bodies, made of named parts with materials: SHAPES by name."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

from raychan.scalars import plain
from raychan.world.errors import SceneError, nearest, shown_in_table
from raychan.world.limits import HOOPS, LENGTH, PHASE, SAG, WALK
from raychan.world.meshes.mesh import Mesh
from raychan.world.shapes.basic import box, cylinder, dihedral, ground, plate, sphere, trihedral
from raychan.world.shapes.cyclist import Cyclist
from raychan.world.shapes.pedestrian import pedestrian
from raychan.world.shapes.prism import prism
from raychan.world.shapes.skeleton import Skeleton, at_once
from raychan.world.shapes.street import bench, bike_rack, guard_rail, lamp_post, trash_bin, wall
from raychan.world.shapes.truck import truck
from raychan.world.shapes.vehicle import car, suv, van
from raychan.world.shapes.walker import Walker

_ALL = (
    plate, sphere, cylinder, box, prism, dihedral, trihedral, ground, car, suv, van, truck, pedestrian,
    lamp_post, guard_rail, wall, bench, trash_bin, bike_rack,
)  # fmt: skip
SKELETONS: dict[str, Callable[..., Skeleton]] = {"walker": Walker, "cyclist": Cyclist}
"""Shapes with limbs that move in themselves."""
RIGID: dict[str, Callable[..., Mesh]] = {make.__name__: make for make in _ALL}
"""Shapes in one piece."""
SHAPES: dict[str, Callable[..., Mesh | Skeleton]] = {**RIGID, **SKELETONS}
_LIMITS = {"max_sag": SAG, "hoops": HOOPS, "speed": WALK, "phase": PHASE}
_THINNEST = 1e-8  # of a shape's largest size: corners nearer than 1e-9 of it to each other are one (pieces of surface)
_WANTED: dict[type, str] = {bool: "true or false", str: "a text", list: "a list"}


def build(name: str, params: dict[str, Any] | None = None) -> Mesh:
    """Return a built-in shape by name with its parameters; one with limbs as it stands at time 0.

    Raises: SceneError for an unknown shape or parameter (with the nearest name), a size that is not positive, or sizes
    for which the shape cannot be built.
    """
    made = _made(name, params)
    return made if isinstance(made, Mesh) else at_once(made)


def skeleton(name: str | None, params: dict[str, Any]) -> Skeleton | None:
    """Return the limbs of a built-in shape that moves in itself, None of any other; errors as of `build`."""
    made = _made(name, params) if name in SKELETONS else None
    return None if isinstance(made, Mesh) else made


def _made(name: str, params: dict[str, Any] | None) -> Mesh | Skeleton:
    """Return what a shape makes of its parameters, once they are checked."""
    if name not in SHAPES:
        raise SceneError(f"unknown shape '{name}'", key="shape", value=name, allowed=nearest(name, SHAPES))
    make, given = SHAPES[name], {key: plain(value) for key, value in (params or {}).items()}
    known = inspect.signature(make).parameters
    for key, value in given.items():
        if key not in known:
            raise SceneError(f"unknown parameter of '{name}'", key=key, value=value, allowed=nearest(key, known))
        default, limit = known[key].default, _LIMITS.get(key, LENGTH)
        number = (isinstance(default, (int, float)) and not isinstance(default, bool)) or default is None
        if number and (isinstance(value, bool) or not isinstance(value, (int, float))):
            raise SceneError(
                f"{shown_in_table(value)} is not a number",
                key=key,
                value=value,
                allowed=f"a number [{limit.unit or 1}]",
            )
        may_be_none = value == 0.0 and (default == 0.0 or key == "arm")
        if number and not may_be_none and not limit.allows(value):
            allowed = f"a positive number, {limit.allowed}"
            raise SceneError(f"{shown_in_table(value)} is not possible", key=key, value=value, allowed=allowed)
        if isinstance(default, int) and not isinstance(default, bool) and not isinstance(value, int):
            raise SceneError(f"{shown_in_table(value)} is not possible", key=key, value=value, allowed="a whole number")
        if not number and not isinstance(value, type(default)):
            allowed = _WANTED[type(default)]
            raise SceneError(f"{shown_in_table(value)} is not possible", key=key, value=value, allowed=allowed)
    _check_sizes({key: given.get(key, p.default) for key, p in known.items()}, given)
    try:
        return make(**given)
    except SceneError:
        raise
    except (ValueError, TypeError, ArithmeticError, IndexError, StopIteration) as e:
        raise SceneError(f"'{name}' cannot be built with these sizes ({e})", key="shape", value=given) from e


def _check_sizes(sizes: dict[str, Any], given: dict[str, Any]) -> None:
    """Raise SceneError where a size given [m] is next to nothing beside the largest: its faces would have no area."""
    lengths = {k: v for k, v in sizes.items() if k not in _LIMITS and isinstance(v, float | int) and v > 0.0}
    largest = max(lengths, key=lambda key: lengths[key], default="")
    for key in lengths.keys() & given.keys():
        if lengths[key] < _THINNEST * lengths[largest]:
            allowed = f"at least {_THINNEST * lengths[largest]:g} m, {_THINNEST:g} of its {largest}"
            raise SceneError(
                f"{shown_in_table(given[key])} is not possible", key=key, value=given[key], allowed=allowed
            )


__all__ = ["RIGID", "SHAPES", "SKELETONS", "build", "skeleton"]
