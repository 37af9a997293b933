"""Images: which returns of tubes the legs over mirrors carry already."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.records import MIRROR
from raychan.tracing.legs import Leg
from raychan.tracing.tubes import Tubes
from raychan.world.geometry import Geometry

Ints = NDArray[np.signedinteger]
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Images:
    """Returns that legs over mirrors carry already and tubes must not carry again; `planes` (p,) are the mirrors of
    legs in, `outward` (p,) those of legs out.

    Over several such mirrors in a row a wave scatters at the last one; one that goes back the way that it came, where
    it turns.
    """

    planes: Bools
    outward: Bools

    @staticmethod
    def of(geometry: Geometry, ins: list[Leg], outs: list[Leg]) -> Images:
        """Return the mirrors of legs in and out."""
        planes, outward = np.zeros((2, int(geometry.plane.max(initial=-1)) + 1), bool)
        for used, legs in ((planes, ins), (outward, outs)):
            used[geometry.plane[[m.facet for leg in legs for m in leg.mirrors]]] = True
        return Images(planes, outward)

    def returns(self, geometry: Geometry, tubes: Tubes, first: bool) -> Bools:
        """Tell which tubes (n,) stand on a mirror whose image carries their return: on their first surface those that
        leave over other mirrors, later all that came from another piece."""
        plane = geometry.plane[tubes.facet]
        if first:
            return self.planes[plane]
        return self.outward[plane] & (geometry.piece[tubes.came_from()] != geometry.piece[tubes.facet])

    def one_way(self, geometry: Geometry, leg: Leg, facet: Ints) -> Bools:
        """Tell for which facets (n,) a wave over `leg` that scatters there first is not the same the other way: the
        facet is a mirror of that way, and carries what this leg's mirrors scatter."""
        role = geometry.facets.role
        over = any(role[m.body] != MIRROR for m in leg.mirrors)
        return self.outward[geometry.plane[facet]] & over

    def carry(self, geometry: Geometry, tubes: Tubes) -> Bools:
        """Tell which tubes (n,) a leg covers: it leads over the mirror where they bounced first to where they are."""
        before = tubes.came_from()
        moved = geometry.piece[before] != geometry.piece[tubes.facet]
        return self.planes[geometry.plane[before]] & moved


def scattering(geometry: Geometry, leg: Leg) -> list[int]:
    """Return the facets of the mirrors of a leg that scatter too, as grounds do not, end's side first."""
    role = geometry.facets.role
    return [m.facet for m in leg.mirrors if role[m.body] != MIRROR]


def turning(there: list[int], back: list[int]) -> int:
    """Return the facet of the mirror where a wave that came over the mirrors `there`, and leaves over those `back`, has
    turned and is on its way back over the mirrors that it came by: it scatters where it turns. -1 if on none.

    Args: facets of mirrors that scatter (see `scattering`).
    """
    if len(there) <= len(back):
        return -1
    on = there[len(back)]
    way = [*there, on, *back[::-1]]
    return on if way == way[::-1] else -1


def without_turned(geometry: Geometry, leg: Leg, outs: list[Leg], pieces: Bools) -> Bools:
    """Return pieces (p,) without those of mirrors of `leg` from which no wave returns, over none of `outs`, but by the
    way that it came by."""
    if len(leg.mirrors) < 2:
        return pieces
    there, ok = scattering(geometry, leg), pieces
    ways = [back for back in (scattering(geometry, out) for out in outs) if not back or back == there]
    for facet in dict.fromkeys(m.facet for m in leg.mirrors[:-1]):
        if all(turning(there, back) == facet for back in ways):
            ok = ok.copy()
            ok[geometry.piece[facet]] = False
    return ok
