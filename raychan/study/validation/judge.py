"""Judging: a printed figure agrees with ours, differs, or cannot be tested; what differs must be known."""

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
    """A printed figure, ours, and the verdict."""

    figure: Figure
    ours: Seen
    verdict: str
    note: str = ""
    """What was seen of a thing that was not detected; why a figure cannot be tested."""
    known: str = ""
    """The known difference that covers it."""

    @property
    def key(self) -> str:
        """Where it stands: item, target, figure."""
        return self.figure.key

    @property
    def difference(self) -> float | None:
        """Ours less theirs, of numbers."""
        return self.ours - self.figure.theirs if _number(self.ours) and _number(self.figure.theirs) else None  # type: ignore[operator]


def judge(figure: Figure, ours: Seen, note: str = "", reason: str = "") -> Check:
    """Return the verdict on a figure of which we see `ours`; None is not detected.

    Args: note what is to be said of it; reason why it cannot be tested as printed, if it cannot.
    """
    if reason:
        return Check(figure, ours, UNTESTABLE, "; ".join(x for x in (note, reason) if x))
    return Check(figure, ours, AGREES if agrees(figure, ours) else DIFFERS, note)


def agrees(figure: Figure, ours: Seen) -> bool:
    """Say whether ours lies within the tolerance of a figure, bounds included; texts and truths must be equal."""
    theirs = figure.theirs
    if ours is None:
        return False
    if not (_number(ours) and _number(theirs)):
        return ours == theirs
    slack = (figure.within or 0.0) + _ROUNDING * abs(float(theirs))
    down = slack if figure.below is None else figure.below
    off = float(ours) - float(theirs)
    if not math.isfinite(off):
        return False
    return (figure.at_most or off >= -down) and (figure.at_least or off <= slack)


def cover(checks: Sequence[Check], known: Iterable[Known], whole: bool = True) -> tuple[list[Check], list[str]]:
    """Return the checks with the known differences that cover them, and what is wrong, a sentence each.

    Wrong are: a difference that no known one covers; a known one that heals (a check that it covers agrees or can no
    longer be tested); one that covers no check, or a check that another covers too. Args: whole, whether all checks of
    the study are there; if not, what known differences say of others is left alone.
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
                        f"known difference '{k.id}' has healed: {key} {c.verdict} (theirs {shown(c.figure.theirs)}, "
                        f"ours {shown(c.ours)}); take it out of known_differences.toml"
                    )
                elif c.known:
                    said.append(f"{key}: covered by '{c.known}' and by '{k.id}'")
                else:
                    found[key] = Check(c.figure, c.ours, c.verdict, c.note, k.id)
    for c in found.values():
        if c.verdict == DIFFERS and not c.known:
            said.append(
                f"unknown difference: {c.key}: theirs {shown(c.figure.theirs)}, ours {shown(c.ours)} "
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
