"""What the study prints stands in `validation/` and `scenes/`: no figure of its tables is typed into the package."""

from __future__ import annotations

import re
import tokenize
import tomllib

from support.places import ROOT

NUMBER = re.compile(r"(?<![\w.])\d(?:[\d_]*\d)?\.?\d*(?:[eE][-+]?\d+)?(?![\w])")
CHANCE = {128.0, 1.25, 1.95}
"""Three digits that mean something else where they stand: sizes of blocks and grids, a default, shapes of cars."""


def digits(value: float) -> int:
    """How many digits count in a number as people write it: 10.36 has four, 4000 one."""
    return len(f"{value:.12g}".split("e")[0].replace(".", "").strip("0-"))


def printed() -> set[float]:
    """Numbers of three digits and more in the study's tables and of its antennas."""
    found: list[float] = []

    def walk(at):
        if isinstance(at, dict | list):
            for inner in at.values() if isinstance(at, dict) else at:
                walk(inner)
        elif isinstance(at, int | float) and not isinstance(at, bool):
            found.append(abs(float(at)))

    for table in tomllib.loads((ROOT / "validation" / "tables.toml").read_text(encoding="utf-8"))["table"]:
        walk([table.get("rows"), [f["printed"] for f in table.get("figure", ())]])
    for file in (ROOT / "scenes" / "antennas").glob("*.toml"):
        walk(tomllib.loads(file.read_text(encoding="utf-8")))
    return {x for x in found if digits(x) >= 3}


def test_no_printed_figure_is_typed_into_the_package():
    figures = printed()
    assert {10.36, 27.63, 568.62, 28.75, 0.5035} <= figures and len(figures) > 80
    met = []
    for file in sorted((ROOT / "raychan").rglob("*.py")):
        with open(file, "rb") as source:
            for token in tokenize.tokenize(source.readline):
                numbers = NUMBER.findall(token.string)
                if token.type in (tokenize.NUMBER, tokenize.STRING, tokenize.COMMENT) and numbers:
                    met += [(file.name, token.start[0], n) for n in numbers if float(n) in figures - CHANCE]
    assert not met
