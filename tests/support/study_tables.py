"""What the study prints, read from `validation/`, where its tables stand as data."""

from __future__ import annotations

import tomllib

from support.places import ROOT

_TABLES = ROOT / "validation" / "tables.toml"


def table(number):
    """Rows of a table of the study, by target; a cell with its own tolerance is a dict with `printed`, `within`."""
    return {row["target"]: row for row in _part(number, "rows")}


def figures(number):
    """Figures of a table of the study that is a list of them, by name."""
    return {row["name"]: row["printed"] for row in _part(number, "figure")}


def _part(number, name):
    every = tomllib.loads(_TABLES.read_text(encoding="utf-8"))["table"]
    (part,) = (t[name] for t in every if t["number"] == number)
    return part
