"""The lists of built-in shapes and materials in docs/scene_files.md are those that the program makes.

`python tests/docs/test_built_in_lists.py` prints them.
"""

import inspect
from pathlib import Path

import pytest

from raychan.world.errors import SceneError
from raychan.world.material import material, names
from raychan.world.shapes import SHAPES, build

TEXT = Path(__file__).parents[2] / "docs" / "scene_files.md"
ROD, COARSE = {"radius": 0.05}, {"max_sag": 0.01}
# Of a shape: the text, the size it is of, the least and most, and other sizes; a twentieth beyond none is built.
LIMITS = [
    ("car", "`length` 2.8 to 66 m", "length", 2.8, 66.0, COARSE),
    ("car", "`width` 0.72 to 2.38 m", "width", 0.72, 2.38, COARSE),
    ("suv", "`length` 3.25 to 73 m", "length", 3.25, 73.0, COARSE),
    ("suv", "`width` 0.69 to 2.45 m", "width", 0.69, 2.45, COARSE),
    ("van", "`length` 3.1 to 80 m", "length", 3.1, 80.0, COARSE),
    ("van", "`width` 0.71 to 2.9 m", "width", 0.71, 2.9, COARSE),
    ("truck", "`front_axle` from 0.22 `length` + 0.96 m", "front_axle", 0.22 * 8.0 + 0.961, None, COARSE),
    ("truck", "to `length` - 0.48 m", "front_axle", None, 8.0 - 0.481, COARSE),
    ("lamp_post", "`height` above 0.47 m + 0.6 `radius`", "height", 0.501, None, ROD),
    ("lamp_post", "without an arm above 0.37 m", "height", 0.371, None, ROD | {"arm": 0.0}),
    ("guard_rail", "`length` up to 10 km", "length", None, 10_000.0, {"max_sag": 0.1}),
    ("walker", "`speed` of 0.053 to 1.59 times `height`", "speed", 0.0531 * 1.75, 1.589 * 1.75, COARSE),
    ("cyclist", "`height` 1.45 to 2.1 m", "height", 1.45, 2.1, COARSE),
    ("cyclist", "`speed` up to 30 m/s", "speed", None, 30.0, COARSE),
]


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
    """Return what a shape is, where its origin lies, and which sizes are allowed, as its docstring says."""
    first, *rest = " ".join(inspect.getdoc(make).split()).split(". ")
    more = [f"; {text[0].lower()}{text[1:]}".rstrip(".") for text in rest if text.startswith(("Origin", "Allowed"))]
    return first.removeprefix("Return ").rstrip(".") + "".join(more)


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


@pytest.mark.parametrize(("shape", "text", "key", "least", "most", "others"), LIMITS, ids=lambda x: str(x)[:20])
def test_a_shape_is_built_at_the_limits_that_the_list_names_and_refused_beyond(shape, text, key, least, most, others):
    (row,) = [line for line in TEXT.read_text(encoding="utf-8").splitlines() if line.startswith(f"| `{shape}` |")]
    assert text in row.split("; allowed: ")[1]
    for size, beyond in ((least, 0.95), (most, 1.05)):
        if size is not None:
            build(shape, {key: size} | others)
            with pytest.raises(SceneError):
                build(shape, {key: type(size)(size * beyond)} | others)


if __name__ == "__main__":
    print(parameters(), materials(), sep="\n", end="")
