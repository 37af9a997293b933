"""Verdicts: a printed figure agrees with the simulation, differs, or cannot be tested; differences must be listed."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

from raychan.study.validation.data import Figure, Item, Known
from raychan.study.validation.measures import Seen

AGREES, DIFFERS, UNTESTABLE = "agrees", "differs", "cannot be tested as printed"
_ROUNDING = 1e-9  # relative: a sum of printed decimals is not exact in binary


@dataclass(frozen=True)
class Check:
    """A printed figure, the simulated value, and the verdict."""

    figure: Figure
    simulated: Seen
    verdict: str
    note: str = ""
    """The level of a target that is not detected, or why the figure cannot be tested."""
    known: str = ""
    """The known difference that covers it."""

    @property
    def key(self) -> str:
        """Key of the figure: item, target, figure."""
        return self.figure.key

    @property
    def difference(self) -> float | None:
        """Simulated less printed; None where one of them is no number."""
        both = self.simulated, self.figure.printed
        return both[0] - both[1] if all(map(_number, both)) else None  # type: ignore[operator]


def judge(figure: Figure, simulated: Seen, note: str = "", reason: str = "") -> Check:
    """Return the check of a figure against its simulated value, None where the target is not detected.

    Args: note, a remark on the simulated value; reason why the figure cannot be tested as printed, '' if it can.
    """
    if reason:
        return Check(figure, simulated, UNTESTABLE, "; ".join(x for x in (note, reason) if x))
    return Check(figure, simulated, AGREES if agrees(figure, simulated) else DIFFERS, note)


def agrees(figure: Figure, simulated: Seen) -> bool:
    """Return whether a simulated value lies within a figure's tolerance, bounds included; texts must be equal."""
    printed = figure.printed
    if simulated is None:
        return False
    if not (_number(simulated) and _number(printed)):
        return simulated == printed
    slack = (figure.within or 0.0) + _ROUNDING * abs(float(printed))
    down = slack if figure.below is None else figure.below
    off = float(simulated) - float(printed)
    if not math.isfinite(off):
        return False
    return (figure.at_most or off >= -down) and (figure.at_least or off <= slack)


def cover(checks: Sequence[Check], known: Iterable[Known], whole: bool = True) -> tuple[list[Check], list[str]]:
    """Return the checks with the known differences that cover them, and the problems, a sentence each.

    Problems are: a difference that is not listed; a listed one that is gone (its check agrees or can no longer be
    tested); a listed one without a check, or with one that another covers too. Args: whole, whether all checks of the
    study are there; if not, listed differences without a check are no problem.
    """
    found = {c.key: c for c in checks}
    said: list[str] = []
    for k in known:
        for pattern in k.checks:
            keys = [key for key in found if fnmatchcase(key, pattern)]
            if not keys and whole:
                said.append(f"known difference '{k.id}': no check '{pattern}'")
            for key in keys:
                c = found[key]
                if c.verdict != DIFFERS:
                    said.append(
                        f"known difference '{k.id}' is gone: {key} {c.verdict} (printed {shown(c.figure.printed)}, "
                        f"simulated {shown(c.simulated)}); remove it from known_differences.toml"
                    )
                elif c.known:
                    said.append(f"{key}: covered by '{c.known}' and by '{k.id}'")
                else:
                    found[key] = Check(c.figure, c.simulated, c.verdict, c.note, k.id)
    for c in found.values():
        if c.verdict == DIFFERS and not c.known:
            said.append(
                f"difference not listed: {c.key}: printed {shown(c.figure.printed)}, simulated {shown(c.simulated)} "
                f"{c.figure.unit}".rstrip()
            )
    return list(found.values()), said


def verdict(checks: Iterable[Check]) -> str:
    """Return the verdict on an item: differs if any check does, untestable if none can be tested."""
    found = {c.verdict for c in checks}
    if DIFFERS in found:
        return DIFFERS
    return AGREES if AGREES in found else UNTESTABLE


def of_item(item: Item, checks: Iterable[Check]) -> list[Check]:
    """Return the checks of a table or claim, in its order."""
    keys = {f.key for f in item.figure}
    return [c for c in checks if c.key in keys]


def shown(value: Seen) -> str:
    """Return a value as text."""
    if value is None:
        return "not detected"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str):
        return value
    if isinstance(value, int) or float(value).is_integer():
        return f"{value:,.0f}"
    return f"{value:.2f}" if 1.0 <= abs(value) < 1e4 else f"{value:.3g}"


def _number(value: Seen) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
