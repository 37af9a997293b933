"""What a run says beforehand of its array: that directions of several echoes, or of bodies beside the plane in which it
measures, are not to be trusted."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from raychan.radar.aperture import Aperture
from raychan.radar.measured import SAME
from raychan.radar.radar import Radar
from raychan.records import MIRROR
from raychan.units import C0, db
from raychan.world.body import Body
from raychan.world.checks import nearest_point

_LOST_DB = 0.5  # what the best beam loses of an echo: less is as much as levels are asked for, by default
_LIKE = 0.98  # of the best beam's power: a beam that reads as much is a twelfth of a beam width beside it at most
_PER_BEAM = 8  # beams tried per beam width: one between two loses at most 0.06 dB (sinc(1/16))


def distrusted(bodies: Iterable[Body], radar: Radar) -> list[str]:
    """Return the warnings of `unsmoothed` and of `beside_plane`."""
    aperture = Aperture(radar.virtual_elements, C0 / radar.waveform.middle)
    return unsmoothed(aperture, radar) + beside_plane(aperture, bodies, radar)


def unsmoothed(aperture: Aperture, radar: Radar) -> list[str]:
    """Return a warning where directions are sought by a method for which one snapshot of the array is too little."""
    asked = radar.processing.doa
    if asked not in ("capon", "music") or not any(aperture.scans) or aperture.table is not None:
        return []
    return [
        f"processing.doa = '{asked}': a cell is one snapshot, and the elements fill no uniform line or rectangle over "
        "whose parts it could be averaged (spatial smoothing): directions and levels of echoes in a cell less than "
        "a beam width apart are not to be trusted"
    ]


def beside_plane(aperture: Aperture, bodies: Iterable[Body], radar: Radar) -> list[str]:
    """Return a warning for each body, ahead, of which an array that measures one angle, not on a line along y or z, has
    no beam, or another direction's: such an array takes all waves for those of its plane."""
    if sum(aperture.scans) != 1 or radar.rx_position is not None:
        return []
    axis = 0 if aperture.scans[0] else 1
    if aperture.flat and np.ptp(aperture.elements[:, 2 - axis]) <= SAME * aperture.wavelength:
        return []
    own, other, along = ("azimuth", "elevation", "y") if axis == 0 else ("elevation", "azimuth", "z")
    at, said = aperture.spread(_PER_BEAM), []
    beams = aperture.steering(at).conj() / len(aperture.elements)
    for body in bodies:
        if body.resolved_role == MIRROR:
            continue
        place = radar.position
        way = (
            nearest_point(body, place) if body.rcs_dbsm is None else body.motion.to_world(body.target_point())
        ) - place
        look = way @ radar.axes / max(float(np.linalg.norm(way)), 1e-9)
        wave = np.exp(2j * np.pi / aperture.wavelength * (aperture.elements @ look))
        held = np.abs(beams @ wave) ** 2
        best, straight = int(held.argmax()), aperture.steering(look[None, 1:] * aperture.scans)[0]
        lost = -float(db(max(float(held[best]), 1e-30)))
        nearer = abs(np.vdot(straight, wave)) ** 2 / len(wave) ** 2
        if look[0] <= 0.0 or (lost <= _LOST_DB and nearer >= _LIKE * held[best]):
            continue
        shown = np.degrees(np.arcsin(np.clip(at[best, axis], -1.0, 1.0)))
        true = np.degrees(np.arctan2(look[1], look[0]) if axis == 0 else np.arcsin(look[2]))
        what = (
            f"the best beam reads {lost:.1f} dB less of it, and it may show in several wrong directions"
            if lost > _LOST_DB
            else f"it shows near {own} {shown:.1f} deg in place of {true:.1f}"
        )
        said.append(
            f"body '{body.name}' stands off {other} 0, which the receivers, of one angle but not on a line along "
            f"{along}, take all waves for: {what}"
        )
    return said
