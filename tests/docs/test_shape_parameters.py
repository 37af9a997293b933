"""The list of built-in shapes in docs/scene_files.md is the one that the shapes' signatures make.

`python tests/docs/test_shape_parameters.py` prints it.
"""

import inspect
from pathlib import Path

from raychan.world.shapes import SHAPES

TEXT = Path(__file__).parents[2] / "docs" / "scene_files.md"


def shown(value):
    """Return a default as a scene file writes it."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(shown, value))}]"
    return f'"{value}"' if isinstance(value, str) else f"{value:g}"


def told(parameter):
    """Return a parameter with its default; None follows from other sizes."""
    name, default = parameter.name, parameter.default
    return f"`{name}` (by the other sizes)" if default is None else f"`{name} = {shown(default)}`"


def parameters():
    """Return the list, a line a shape: each parameter with its default."""
    rows = ["| shape | `params` and their defaults |", "| --- | --- |"]
    for name, make in SHAPES.items():
        known = inspect.signature(make).parameters.values()
        rows.append(f"| `{name}` | {', '.join(map(told, known))} |")
    return "\n".join(rows) + "\n"


def test_the_list_of_shapes_and_their_parameters_is_that_of_the_program():
    assert parameters() in TEXT.read_text(encoding="utf-8")


if __name__ == "__main__":
    print(parameters(), end="")
