"""The rooms of `run` and `world`: what one of them needs never needs it back."""

from graphlib import TopologicalSorter
from pathlib import Path

import pytest
from house.test_floors import ROOT, imports


def _room(file: Path, package: str) -> str:
    """Return the folder or file of a package in which a module is."""
    return file.relative_to(ROOT / package).parts[0].removesuffix(".py")


@pytest.mark.parametrize(
    ("package", "upwards"),
    [("run", ("streams", "refinement", "simulate")), ("world", ("meshes", "mesh_files", "scene_files", "scene"))],
)
def test_no_rooms_of_a_package_need_each_other(package, upwards):
    needs: dict[str, set[str]] = {}
    for file in (ROOT / package).rglob("*.py"):
        named = (tuple(name.split(".")) for name, at_import in imports(file) if at_import)
        others = {name[2] for name in named if name[:2] == ("raychan", package) and len(name) > 2}
        needs.setdefault(_room(file, package), set()).update(others - {_room(file, package)})
    order = [*TopologicalSorter(needs).static_order()]
    assert sorted(upwards, key=order.index) == [*upwards]
