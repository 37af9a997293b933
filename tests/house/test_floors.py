"""The house stands: imports go downward, trades never meet but through the tables, heavy libraries have one home."""

import ast
from collections import defaultdict
from pathlib import Path

import pytest
from support.places import TESTS

ROOT = Path(__file__).parents[2] / "raychan"
STOREYS = (
    ("crew",),
    ("units", "scalars", "parallel", "blas", "compile"),
    ("poses", "reprs", "kinds", "vectors", "limits"),
    ("columns",),
    ("trajectories",),
    ("records",),
    ("em", "geometry"),
    ("radar",),
    ("world", "dynamics"),
    ("tracing", "channel", "signal", "processing", "sensors"),
    ("run",),
    ("hil",),
    ("study",),
    ("report",),
    ("view",),
    ("cli",),
    ("__main__",),
)
"""From the ground up; rooms of one storey do not import each other."""
FLOOR = {room: floor for floor, rooms in enumerate(STOREYS) for room in rooms}
HOME = {
    "embreex": "world/embree_library.py",
    "pyvista": "view/render.py",
    "matplotlib": "report/canvas.py",
    "serial": "hil/ports.py",
}
UPWARD = {("reprs.py", "raychan.report.shown")}
"""The one door upward: what has a picture is a record, and `.plot()` on it asks, when called, for the pictures."""
LAZY = {"pyvista", "matplotlib", "serial", "dask"}


def _for_types(test: ast.expr) -> bool:
    return isinstance(test, ast.Name) and test.id == "TYPE_CHECKING"


def imports(file: Path) -> list[tuple[str, bool]]:
    """Modules that a file imports, and whether it does so outside of any function."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    inner = {n for f in ast.walk(tree) if isinstance(f, ast.FunctionDef | ast.Lambda) for n in ast.walk(f)}
    # What only type checkers read is not imported.
    typing = {n for f in ast.walk(tree) if isinstance(f, ast.If) and _for_types(f.test) for n in ast.walk(f)}
    found = []
    for node in ast.walk(tree):
        if node in typing:
            continue
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
        assert other == room or FLOOR[other] < FLOOR[room], f"{room} imports {name}, which is not below it"
        if room in ("signal", "processing"):
            assert other != "world", f"{room} sees the truth: {name}"


def test_no_module_imports_itself_by_way_of_others():
    below: dict[str, set[str]] = {}
    for file in FILES:
        own = "raychan." + ".".join(file.relative_to(ROOT).with_suffix("").parts)
        names = {name for name, at_import in imports(file) if at_import and name.startswith("raychan.")}
        below[own] = {
            n if (ROOT.parent / (n.replace(".", "/") + ".py")).exists() else n.rpartition(".")[0] for n in names
        }
    done: set[str] = set()

    def visit(module: str, way: tuple[str, ...]) -> None:
        assert module not in way, " > ".join((*way, module))
        if module not in done:
            for other in sorted(below.get(module, ())):
                visit(other, (*way, module))
            done.add(module)

    for module in below:
        visit(module, ())


LONGEST_FILE, LONGEST_FUNCTION, DEEPEST = 300, 60, 4
LONG: dict[str, str] = {
    "cli/rcs:rcs": "48 lines declare its options, each with its help",
    "signal/nufft:add_transposed": "in blocks; splitting a fast-math loop may change its last digits",
    "signal/nufft:interpolate": "in blocks of chirps; as above",
}
"""Functions that may be longer or deeper, each with its reason."""


def _depth(node: ast.AST) -> int:
    nests = (ast.For, ast.While, ast.If, ast.With, ast.Try)
    deeper = max((_depth(child) for child in ast.iter_child_nodes(node)), default=0)
    alone = isinstance(node, ast.If) and len(getattr(node, "orelse", [])) == 1 and isinstance(node.orelse[0], ast.If)
    return deeper + (isinstance(node, nests) and not alone)


@pytest.mark.parametrize("file", FILES, ids=lambda p: str(p.relative_to(ROOT)))
def test_files_are_short_and_functions_short_and_shallow(file: Path):
    text = file.read_text(encoding="utf-8")
    assert text.count("\n") <= LONGEST_FILE
    where = str(file.relative_to(ROOT).with_suffix(""))
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef) and f"{where}:{node.name}" not in LONG:
            length = (node.end_lineno or node.lineno) - node.lineno + 1
            assert length <= LONGEST_FUNCTION, f"{where}:{node.name} has {length} lines"
            assert _depth(node) <= DEEPEST, f"{where}:{node.name} is nested {_depth(node)} deep"


@pytest.mark.parametrize("file", sorted(TESTS.rglob("*.py")), ids=lambda p: str(p.relative_to(TESTS)))
def test_files_of_tests_are_short_too(file: Path):
    assert file.read_text(encoding="utf-8").count("\n") <= LONGEST_FILE


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
