"""The stages of a reflection, from a wave of tubes to the next, as one compiled function: so threads seldom meet at the
interpreter's lock."""

from __future__ import annotations

import numpy as np

from raychan.compile.jit import njit
from raychan.tracing.bounce_landing import going_on, is_spent, keep_to_budget, land
from raychan.tracing.bounce_rays import cast_centres, cast_corners, room_for
from raychan.tracing.contributions import RAYS

ALL, CENTRES, CORNERS, SETTLE = 0, 1, 2, 3
"""Stages: from the centre rays on, only these, only the corner rays, and from when all rays are cast on."""


@njit(cache=True, nogil=True, error_model="numpy")
def fly(stage, begin, end, most, flight, met, landed, count, world, how, account, uncut, packet):  # type: ignore[no-untyped-def]
    """Do one stage for the tubes from `begin` to `end`, or follow all, wave by wave, until none is left or a wave has
    more than `most`.

    Args: flight as `Flight`, met, room for it, as `Met`; landed as `Landed`, of which `count` are in use; world as
    `Surroundings`, how as `Rules`; account of the budget (see `contributions`), uncut (b,) tubes of bodies that it
    kept from being subdivided; packet as of `embree_packet`. Returns: flight, met, landed as plain tuples
    (see `bounce_records.named`), count; rays cast by CENTRES or CORNERS, which all others add to the account.
    """
    # Not constants: the compiler would make what takes them once more.
    casts, tag, none = np.int64(0), np.int64(0), np.int64(0)
    tested = np.full(len(world.outlines.grid.edges) if stage != CENTRES else 0, -1, np.int32)
    room, planes = np.empty((9, 3)), np.empty(4, np.int32)
    # Each part is called at one place: what is called twice may be compiled twice.
    while True:
        if stage == ALL:
            begin, end = none, len(flight.tubes.facet)
            met = room_for(flight, world, how)
            if end == 0 or end > most:
                break
        if stage in (ALL, CENTRES):
            casts = cast_centres(begin, end, flight, met, world, packet)
            if stage == CENTRES:
                break
            account[RAYS] += casts
        if stage in (ALL, CORNERS):
            matter = not is_spent(account, how)
            casts = cast_corners(begin, end, matter, tag, flight, met, world, how, packet, tested, room, planes)
            if stage == CORNERS:
                break
            account[RAYS] += casts
        tag, stage = tag + end, ALL
        keep_to_budget(met.wanted, flight.tubes.facet, world.body, how, account, uncut)
        landed, count, ready = land(flight, met, landed, count, world, how)
        flight = going_on(flight, met, ready, world, how)
    flown, seen = (flight.tubes[0:],) + flight[1:], (met.rays[0:],) + met[1:]  # noqa: RUF005 (numba)
    return flown, seen, (landed.tubes[0:],) + landed[1:], count, casts  # noqa: RUF005
