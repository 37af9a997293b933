"""Echoes that leave in one direction and return from another, as over two bodies: to several transmitters no wave."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from raychan.radar.radar import Radar
from raychan.run.result import Explanation
from raychan.units import C0

# rad: by how much the phase of the outermost transmitter may turn between both directions. Of 300 echoes of both ways
# (2 or 3 transmitters, 3 to 5 receivers) none of 146 below two thirds of this was split, folded or misplaced, 1 of 78
# up to this, 5 of 40 up to a third more, 15 of 36 beyond; of 300 cross-polar ones, whose two ways differ in sign, all
# (no command).
_TURN = 0.15 * math.pi
_CROSSED = 0.1  # of both fields: what of a transmitter's own polarisation a receiver of the other one hears, at most
_PARALLEL = 1e-3  # rad: of cross-polar echoes


def apart(reasons: Sequence[Explanation], radar: Radar) -> list[int]:
    """Return the rows of detections by time or Doppler division whose wave leaves and returns so far apart that their
    signals at the transmitters are no plane wave's."""
    if len(radar.tx_elements) < 2 or radar.rx_position is not None:
        return []
    places = (radar.tx_elements - radar.tx_elements.mean(axis=0)) @ radar.axes.T
    number, found = 2.0 * math.pi * radar.waveform.middle / C0, []
    for i, why in enumerate(reasons):
        away, back = np.array(why.departure), np.array(why.arrival)
        turn = float(np.abs(number * places @ (away - back)).max())
        sent, heard = (field(back[None])[0] if turn else np.ones(3) for field in (radar.tx_field, radar.rx_field))
        crossed = abs(sent @ heard) < _CROSSED * np.linalg.norm(sent) * np.linalg.norm(heard)
        if turn > (_PARALLEL if crossed else _TURN):
            found.append(i)
    return found
