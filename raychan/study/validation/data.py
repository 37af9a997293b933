"""What the study prints, read from `validation/`: tables, claims, runs, targets, known differences."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

import raychan
from raychan.world.errors import SceneError
from raychan.world.scene_files import overrides
from raychan.world.scene_files.errors import checked
from raychan.world.scene_files.schema import Table

HERE = Path(raychan.__file__).parents[1] / "validation"
"""The study's data in a checkout."""

Value = bool | int | float | str
POINT = "point"


class Figure(Table):
    """A printed figure, and the measure of the simulation that is compared with it."""

    name: str
    printed: Value
    measure: list[Any] = Field(min_length=1)
    unit: str = ""
    within: float | None = Field(None, ge=0.0)
    below: float | None = Field(None, ge=0.0)
    """Tolerance downwards where it differs from `within`."""
    at_most: bool = False
    at_least: bool = False
    untestable: str = ""
    key: str = ""


class Column(Table):
    """A column of a table: a figure for each row that has the key."""

    key: str
    name: str
    measure: list[Any] = Field(min_length=1)
    unit: str = ""
    within: float | None = None
    untestable: str = ""
    rcs_only: bool = False
    as_: str = Field("", alias="as")
    printed: Value | None = None


class Item(Table):
    """A table or a claim."""

    title: str = Field(alias="text", default="")
    where: str = ""
    note: str = ""
    id: str = ""
    figure: tuple[Figure, ...] = ()


class PrintedTable(Table):
    """A table as it stands in tables.toml."""

    number: int
    title: str
    note: str = ""
    run: str = ""
    figure: tuple[Figure, ...] = ()
    columns: tuple[Column, ...] = ()
    rows: tuple[dict[str, Any], ...] = ()


class Run(Table):
    """A scene with some keys changed."""

    title: str
    scene: str
    changes: tuple[str, ...] = ()
    max_bounces: int | None = None
    ablation: bool = False


class Target(Table):
    """The bodies, parts and range by which a target of the tables is recognised."""

    title: str
    scene: str
    parts: tuple[str, ...]
    over: tuple[str, ...] = ()
    near: float | None = None
    reference: Literal["nearest", "middle", "point"] = "nearest"
    reference_parts: tuple[str, ...] = ()
    reference_above: float = -math.inf
    """Only facets that reach above this height [m] count for the reference point."""


class Known(Table):
    """A difference whose reason is known: the checks that it covers, by their keys; '*' stands for anything."""

    id: str
    kind: Literal["level", "range", "layout", "model", "paper"]
    checks: tuple[str, ...] = Field(min_length=1)
    reason: str


class _Study(Table):
    run: dict[str, Run]
    target: dict[str, Target]
    reason: dict[str, str]


class _Tables(Table):
    table: tuple[PrintedTable, ...]


class _Claims(Table):
    claim: tuple[Item, ...]


class _Known(Table):
    difference: tuple[Known, ...]


@dataclass(frozen=True)
class Study:
    """The contents of `validation/`, and the folder of the scenes."""

    scenes: Path
    runs: Mapping[str, Run]
    targets: Mapping[str, Target]
    reasons: Mapping[str, str]
    items: tuple[Item, ...]
    """Tables (T1 to T16), then claims."""
    known: tuple[Known, ...]


def load(folder: Path | None = None) -> Study:
    """Return the study's data in a `validation/` folder, by default that of the checkout raychan is installed from.

    Raises: SceneError where there is none, or where a file, key or value in it is wrong.
    """
    folder = folder or HERE
    if not (folder / "tables.toml").is_file():
        raise SceneError(
            "no validation data there: the study's tables come with a checkout of the repository, not with a package",
            file=folder,
            allowed="an editable installation from a checkout (pip install -e .), or --data DIR",
        )
    study: _Study = _read(_Study, folder / "study.toml")
    sheets: _Tables = _read(_Tables, folder / "tables.toml")
    claims: _Claims = _read(_Claims, folder / "claims.toml")
    known: _Known = _read(_Known, folder / "known_differences.toml")
    file = folder / "tables.toml"
    items = [_item(sheet, study, file) for sheet in sheets.table]
    items += [c.model_copy(update={"figure": tuple(_keyed(c.id, c.figure))}) for c in claims.claim]
    for i in items:
        for f in i.figure:
            if f.untestable and f.untestable not in study.reason:
                where = file if i.id.startswith("T") else folder / "claims.toml"
                raise SceneError(f"no reason '{f.untestable}'", file=where, key=f.key, allowed=", ".join(study.reason))
    return Study(folder.parent / "scenes", study.run, study.target, study.reason, tuple(items), known.difference)


def _read(kind: type[Table], file: Path) -> Any:
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise SceneError(f"cannot be read ({error})", file=file, allowed="a text file in TOML") from None
    return checked(kind, overrides.parsed(text, file), file)


def _item(sheet: PrintedTable, study: _Study, file: Path) -> Item:
    name = f"T{sheet.number}"
    figures = [*_keyed(name, sheet.figure)]
    for row in sheet.rows:
        for column in sheet.columns:
            if column.key in row:
                figures.append(_cell(name, sheet, column, row, study, file))
    return Item(id=name, text=sheet.title, where=f"table {sheet.number}", note=sheet.note, figure=tuple(figures))


def _cell(name: str, sheet: PrintedTable, column: Column, row: dict[str, Any], study: _Study, file: Path) -> Figure:
    """Return the figure of a table cell: the column's settings, overridden by those of the cell."""
    target = str(row.get("target", ""))
    given = row[column.key]
    known = study.target.get(target)
    data: dict[str, Any] = {
        "key": f"{name}/{target}/{column.as_ or column.key}",
        "name": f"{known.title if known else target}: {column.name}",
        "measure": [{"{target}": target, "{run}": sheet.run}.get(str(m), m) for m in column.measure],
        "unit": column.unit,
        "within": column.within,
        "untestable": column.untestable,
    }
    data |= given if isinstance(given, dict) else {"printed": given}
    if column.printed is not None:
        data["printed"] = column.printed
    if column.rcs_only and not (known and known.reference == POINT):
        data["untestable"] = "shape"
    made: Figure = checked(Figure, data, file)
    return made


def _keyed(name: str, figures: tuple[Figure, ...]) -> Iterator[Figure]:
    for f in figures:
        slug = re.sub(r"[^a-z0-9]+", "_", f.name.lower()).strip("_")
        yield f.model_copy(update={"key": f"{name}/{slug}"})
