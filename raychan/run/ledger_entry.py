"""Entries of the ledger: what each mechanism that a run left out would bring, against its weakest detection."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

UNKNOWN = "unknown"
NOTHING = "none"
"""Level of an effect that the scene does not have, or that is modelled."""
SEEN = "seen"
"""Kind of an effect that is there, of unknown level."""


@dataclass(frozen=True)
class Entry:
    """One effect: `level_db` [dB] against the weakest detection (of none, the weakest possible), 'unknown' where there
    is no estimate, 'none' where there is no effect; `kind` 'estimate', 'bound', 'exact', 'seen' where the effect is
    there, of unknown level, or 'none'; `how` it was found."""

    level_db: float | str
    kind: str
    how: str


@dataclass(frozen=True)
class ModelChoice(Entry):
    """What `model.mode = "auto"` models: the entry "model" of a run in that mode."""

    bounces: int
    transmissions: int
    diffraction: bool
    why: tuple[str, ...]
    """A line for each mechanism, with its level and whether it is needed."""

    def over(self, used: int, every: int) -> ModelChoice:
        """Return the choice with a line on how many of the legs over mirrors carry tubes."""
        if used == every:
            return self
        line = (
            f"{used} of {every} legs over mirrors: of the others a mirror is not seen from the one before, at points "
            "0.15 m apart (estimate): left out"
        )
        return replace(self, why=(*self.why, line))

    def applied_to(self, model: Any) -> Any:
        """Return the model settings with what was chosen."""
        chosen = {"max_bounces": self.bounces, "max_transmissions": self.transmissions, "diffraction": self.diffraction}
        return model.model_copy(update=chosen)


def entry_of(held: Mapping[str, Any]) -> Entry:
    """Return the entry that a file holds as a table. Raises: TypeError for a table of other keys."""
    level = math.nan if held.get("level_db", NOTHING) is None else held.get("level_db", NOTHING)
    if "bounces" in held:
        missing = {"level_db": level, "kind": "estimate", "how": ""}  # earlier files hold the choice without a level
        return ModelChoice(**(missing | dict(held) | {"why": tuple(held["why"])}))
    return Entry(**(dict(held) | {"level_db": level}))
