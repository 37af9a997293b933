"""Batches of routes as fewer and larger ones: each costs as much again where there are many sums over it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from raychan.records import Routes

_ENDS = "tx", "rx", "far"  # alike in all batches of a launch


def joined(batches: Sequence[Routes], most: int) -> list[Routes]:
    """Return the same routes, in order, in batches of `most` at most unless one alone has more; chains are as long as
    the longest of their batch."""
    groups: list[list[Routes]] = []
    for batch in batches:
        if groups and sum(len(r.kind) for r in groups[-1]) + len(batch.kind) <= most:
            groups[-1].append(batch)
        else:
            groups.append([batch])
    return [_in_one(group) if len(group) > 1 else group[0] for group in groups]


def _in_one(batches: list[Routes]) -> Routes:
    """Return routes between the same ends as one batch."""
    deep = max(r.kind.shape[1] for r in batches)
    unused: dict[str, Any] = {"vertices": batches[0].rx, "normals": 0.0, "facet": -1, "body": -1, "kind": 0}
    columns = {}
    for name in (f.name for f in fields(Routes) if f.name not in _ENDS):
        parts = [getattr(r, name) for r in batches]
        if name in unused:
            wide = [np.broadcast_to(unused[name], (len(p), deep, *p.shape[2:])).astype(p.dtype) for p in parts]
            for one, part in zip(wide, parts, strict=True):
                one[:, : part.shape[1]] = part
            parts = wide
        columns[name] = np.concatenate(parts)
    return batches[0].replace(**columns)
