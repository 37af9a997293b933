"""The lists of built-in shapes and materials in docs/scene_files.md are those that the program makes.

`python tests/docs/test_built_in_lists.py` prints them.
"""

import inspect
from pathlib import Path

from raychan.world.material import material, names
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


def standing(make):
    """Return what a shape is and where its origin lies, as its docstring says."""
    first, *rest = " ".join(inspect.getdoc(make).split()).split(". ")
    origin = [f"; {text[0].lower()}{text[1:]}" for text in rest if text.startswith("Origin")]
    return (first.removeprefix("Return ").rstrip(".") + "".join(origin)).rstrip(".")


def parameters():
    """Return the list, a line a shape: each parameter with its default, and how the shape stands."""
    rows = ["| shape | `params` and their defaults | is |", "| --- | --- | --- |"]
    for name, make in SHAPES.items():
        known = inspect.signature(make).parameters.values()
        rows.append(f"| `{name}` | {', '.join(map(told, known))} | {standing(make)} |")
    return "\n".join(rows) + "\n"


def materials():
    """Return the list, a line a material."""
    rows = ["| material | eps_r | sigma [S/m] | thickness | source |", "| --- | --- | --- | --- | --- |"]
    for made in (material(name, 77e9) for name in names()):
        thick = "" if made.thickness is None else f"{1e3 * made.thickness:g} mm"
        eps, sigma = ("", "") if made.pec else (f"{made.eps_r:.3g}", f"{made.sigma:.3g}")
        rough = f"; roughness {1e3 * made.roughness:g} mm" if made.roughness else ""
        rows.append(f"| `{made.name}` | {eps} | {sigma} | {thick} | {made.source}{rough} |")
    return "\n".join(rows) + "\n"


def test_the_list_of_materials_is_that_of_the_program():
    assert materials() in TEXT.read_text(encoding="utf-8")


def test_the_list_of_shapes_and_their_parameters_is_that_of_the_program():
    assert parameters() in TEXT.read_text(encoding="utf-8")


if __name__ == "__main__":
    print(parameters(), materials(), sep="\n", end="")
