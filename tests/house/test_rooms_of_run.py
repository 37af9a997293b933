"""The rooms of `run`: what one of them needs never needs it back."""

from graphlib import TopologicalSorter
from pathlib import Path

from house.test_floors import ROOT, imports

RUN = ROOT / "run"


def _room(file: Path) -> str:
    """Return the folder or file of `run` in which a module is."""
    return file.relative_to(RUN).parts[0].removesuffix(".py")


def test_no_rooms_of_run_need_each_other():
    needs: dict[str, set[str]] = {}
    for file in RUN.rglob("*.py"):
        named = (tuple(name.split(".")) for name, at_import in imports(file) if at_import)
        others = {name[2] for name in named if name[:2] == ("raychan", "run") and len(name) > 2}
        needs.setdefault(_room(file), set()).update(others - {_room(file)})
    order = [*TopologicalSorter(needs).static_order()]
    assert order.index("streams") < order.index("refinement") < order.index("simulate")
