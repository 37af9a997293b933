"""Lines on what the receiver loses of detections: by beams of plane waves in one cell, and by migration."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from raychan.radar.radar import Radar
from raychan.run.numbered import numbers, share_of, verb
from raychan.run.receiver_losses import BeamLosses, beam_losses, beside, far_field_distance, migration
from raychan.run.result import DC, ExplainedDetections, Explanation

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

_LOST_DB = 0.5  # by what a receiver makes of an echo: less is as much as levels are asked for, by default
_HIDES = 0.02  # of an echo's power: of 60 cells of three echoes 12 dB apart none is lost where it is less
_COUNTED_DB = 0.05  # of a cause beside another one: from here on a line names it


def lost(found: ExplainedDetections, reasons: Sequence[Explanation], radar: Radar) -> list[str]:
    """Return a line for each cause by which most is lost of detections: spherical waves in a beam, ranges or rates that
    differ over the elements, migration over range cells. Its figure is of all causes together."""
    beams = beam_losses(found, reasons, radar)
    moved, late = migration(found.true_rate, radar)
    # The receiver's DC offset is no wave.
    wave = np.array([why.label != DC for why in reasons], bool)
    each = wave * np.array([beams.near, beams.ranges, beams.rates, late])
    # Migration is the same for all elements: at most both add up in dB.
    whole, most = wave * (beams.whole + late), each.argmax(axis=0)
    said = []
    for cause, tell in enumerate((_near, _ranges, _rates, _moving)):
        if (rows := (whole > _LOST_DB) & (most == cause)).any():
            others = [k for k in range(len(each)) if k != cause and each[k, rows].max() > _COUNTED_DB]
            counted = f" ({' and '.join(_NAMES[k] for k in others)} counted in)" if others else ""
            said.append(tell(rows, f"{_up(whole[rows].max())} dB less", counted, beams, moved, radar))
    return said + _hiding(found, wave, beams, radar)


def _hiding(found: ExplainedDetections, wave: Bools, beams: BeamLosses, radar: Radar) -> list[str]:
    """Return a line where so much of detections lies in other cells that it hides echoes of theirs that would be
    detected: the slope of the window's response over the elements, as in `Scan.misfit`, twice where several add up."""
    share = 2.0 * beams.range_cells**2 / 3.0
    hides = found.snr + 10.0 * np.log10(np.maximum(share, 1e-30)) > radar.processing.min_snr_db
    rows = np.asarray(wave & hides & (share > _HIDES))
    if not rows.any():
        return []
    least, one = max(math.floor(-10.0 * math.log10(share[rows].max())), 0), rows.sum() == 1
    return [
        f"{share_of(rows)} may hide echoes of {'its cell' if one else 'their cells'} over {least} dB weaker "
        f"({numbers(rows)}): {'its ranges differ' if one else 'their ranges differ'} over the elements by up to "
        f"{beams.range_cells[rows].max():.2f} cells"
    ]


_NAMES = "the near field", "ranges that differ over the elements", "rates that do", "migration"


def _up(loss: float) -> str:
    """Return a loss [dB] as a figure that it does not exceed."""
    return f"{math.ceil(10.0 * loss - 1e-6) / 10.0:.1f}"


def _near(rows: Bools, less: str, counted: str, beams: BeamLosses, moved: Floats, radar: Radar) -> str:
    return (
        f"{share_of(rows)} {verb(rows)} in the near field of the array ({numbers(rows)}), nearer than 2 D^2 / "
        f"wavelength = {far_field_distance(radar):.3g} m: beams are those of plane waves and read up to {less} of a "
        f"spherical one{counted}"
    )


def _ranges(rows: Bools, less: str, counted: str, beams: BeamLosses, moved: Floats, radar: Radar) -> str:
    return _differing("ranges", beams.range_cells, rows, less) + counted


def _rates(rows: Bools, less: str, counted: str, beams: BeamLosses, moved: Floats, radar: Radar) -> str:
    return _differing("rates", beams.rate_cells, rows, less) + counted


def _differing(what: str, cells: Floats, rows: Bools, less: str) -> str:
    return (
        f"{share_of(rows)} {'has' if rows.sum() == 1 else 'have'} {what} that differ over the elements "
        f"({numbers(rows)}), by up to {cells[rows].max():.1f} cells: beams add one cell of all and read up to {less}"
    )


def _moving(rows: Bools, less: str, counted: str, beams: BeamLosses, moved: Floats, radar: Radar) -> str:
    off = beside(moved[rows], radar)
    stand = f", and may stand up to {off[1]:g} range cells and {off[0]:g} rate cells off" if off.any() else ""
    return (
        f"{share_of(rows)} {'moves' if rows.sum() == 1 else 'move'} over range cells during the frame "
        f"({numbers(rows)}), up to {moved[rows].max():.1f}: peaks read up to {less}{counted}{stand}"
    )
