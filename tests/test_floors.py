"""The house stands: imports go downward, trades never meet but through the tables, heavy libraries have one home."""

import ast
from collections import defaultdict
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1] / "raychan"
FLOOR = {
    "units": 0,
    "frames": 0,
    "tables": 0,
    "telling": 0,
    "kernels": 1,
    "world": 2,
    "radar": 2,
    "dynamics": 2,
    "run": 4,
}
FLOOR |= dict.fromkeys(("channel", "signal", "process", "models"), 3)
FLOOR |= dict.fromkeys(("study", "hil", "view", "report", "cli", "__main__"), 5)
HOME = {"embreex": "world/embree.py", "pyvista": "view/render.py", "matplotlib": "report/canvas.py"}
UPWARD = {("telling.py", "raychan.report.shown")}
"""The one door upward: what has a picture is a record, and `.plot()` on it asks, when called, for the pictures."""
LAZY = {"pyvista", "matplotlib", "serial", "dask"}


def imports(file: Path) -> list[tuple[str, bool]]:
    """Modules that a file imports, and whether it does so outside of any function."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    inner = {n for f in ast.walk(tree) if isinstance(f, ast.FunctionDef | ast.Lambda) for n in ast.walk(f)}
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found += [(a.name, node not in inner) for a in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}: relative import"
            deep = node.module in ("raychan", "importlib")
            found += [(f"{node.module}.{a.name}" if deep else str(node.module), node not in inner) for a in node.names]
    return found


FILES = sorted(p for p in ROOT.rglob("*.py") if p != ROOT / "__init__.py")


@pytest.mark.parametrize("file", FILES, ids=lambda p: str(p.relative_to(ROOT)))
def test_imports_go_downward_and_trades_never_meet(file: Path):
    room = file.relative_to(ROOT).parts[0].removesuffix(".py")
    for name, at_import in imports(file):
        if (str(file.relative_to(ROOT)), name) in UPWARD:
            assert not at_import, f"{name} is imported at once"
            continue
        if not name.startswith("raychan.") or name == "raychan.__version__":
            continue
        other = name.split(".")[1]
        assert FLOOR[other] <= FLOOR[room], f"{room} imports {name} from above"
        if FLOOR[room] == 3 and other != room:
            assert FLOOR[other] < 3, f"the trade {room} imports the trade {other}"
        if room in ("signal", "process"):
            assert other != "world", f"{room} sees the truth: {name}"
        if room == "kernels":
            assert other == "kernels", f"kernels import {name}"


def test_each_heavy_library_is_imported_in_one_place_and_drawing_lazily():
    homes = defaultdict(set)
    for file in FILES:
        for name, at_import in imports(file):
            top = name.split(".")[0].replace("mpl_toolkits", "matplotlib")
            if top in HOME or top in LAZY:
                homes[top].add(str(file.relative_to(ROOT)))
                assert not (at_import and top in LAZY), f"{file}: {top} is imported at once"
    assert {top: {home} for top, home in HOME.items()} == dict(homes)


def test_every_public_name_is_there():
    import raychan

    assert all(getattr(raychan, name) is not None for name in raychan.__all__)
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        _ = raychan.nonsense
