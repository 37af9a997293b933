"""Scans in telegrams: distances and flags in 16 bits for each beam.

A measuring mode gives the bits of a distance; the rest of the 16 are flags. The telegram does not say which mode it was
measured in: its reader knows from the configuration.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.hil.telegrams import LONGEST, TelegramError

Floats = NDArray[np.float64]

UNITS_M = (0.01, 0.001)
"""Length [m] of a count in unit 0 and in unit 1 (bits 14 and 15 of the number of beams)."""
DISTANCE_BITS = {0x00: 13, 0x01: 13, 0x02: 13, 0x03: 14, 0x04: 14, 0x05: 15, 0x06: 15, 0x0F: 16}
"""Bits of a distance in each measuring mode: 8 or 80 m, 16 m, 32 m, 32 m without flags."""
NO_ECHO = 0x1FFF
"""Largest distance that 13 bits hold; stands for a beam without an echo, as the largest of other modes does."""
ALL_VALUES, SUBRANGE = 0xB0, 0xB7
"""Commands of telegrams that hold scans: all beams of a scan or of a turn of the mirror; some neighbouring beams."""
_COUNT, _TURN, _PARTIAL = 0x3FF, 11, 0x2000
MOST_BEAMS = (LONGEST - 8) // 2
"""Beams of a scan that the longest telegram holds, also beside the 8 bytes that a part of a scan (B7) takes."""


@dataclass(frozen=True)
class ScanValues:
    """One scan as sent.

    Fields: range_m (n,) [m], inf without an echo; fields (n,) flags, in measuring mode 0 bits 0 to 2: field A, field B,
    dazzle; unit 0 (cm) or 1 (mm); status byte; bits of a distance; offset_deg of a turn of the mirror whose beams are
    these, None for a whole scan; first beam, counted from 1, where only some are sent, else None.
    """

    range_m: Floats
    fields: NDArray[np.uint8]
    unit: int = 0
    status: int = 0
    bits: int = 13
    offset_deg: float | None = None
    first: int | None = None


def encode_scan(scan: ScanValues) -> bytes:
    """Return the payload B0 of a scan, or B7 of some of its beams.

    Distances are rounded to the unit, larger ones than the bits hold are no echo.
    Raises: TelegramError for ranges that are negative or NaN, an unknown unit, flags that do not fit, too many beams.
    """
    ranges, fields = np.asarray(scan.range_m, float), np.asarray(scan.fields)
    if scan.unit not in (0, 1):
        raise TelegramError(f"unit {scan.unit}; allowed: 0 (cm) or 1 (mm)")
    if not (ranges >= 0.0).all():
        raise TelegramError("a range is negative or NaN; a beam without an echo is inf")
    flags = 1 << (16 - scan.bits)
    if fields.shape != ranges.shape or (fields >= flags).any() or (fields < 0).any():
        raise TelegramError(f"fields: one of 0 to {flags - 1} for each beam")
    if ranges.ndim != 1 or len(ranges) > _COUNT:
        raise TelegramError(f"{ranges.shape} beams; allowed: a row of up to {_COUNT}")
    none = (1 << scan.bits) - 1
    unit_m = UNITS_M[scan.unit]
    counts = np.minimum(np.round(np.minimum(ranges, 1000.0) / unit_m), none).astype("<u4")
    values = (counts | fields.astype("<u4") << scan.bits).astype("<u2")
    word = len(ranges) | scan.unit << 14
    if scan.offset_deg is not None:
        word |= _PARTIAL | round(4.0 * scan.offset_deg) << _TURN
    head = bytes((ALL_VALUES,))
    if scan.first is not None:
        last = scan.first + len(ranges) - 1
        head = bytes((SUBRANGE,)) + scan.first.to_bytes(2, "little") + last.to_bytes(2, "little")
    return head + word.to_bytes(2, "little") + values.tobytes() + bytes((scan.status,))


def decode_scan(payload: bytes, bits: int = 13) -> ScanValues:
    """Return the scan of a payload B0 or B7, whose distances have a number of bits.

    Raises: TelegramError for another command, a length that does not fit the number of beams, an unknown unit.
    """
    if len(payload) < 4 or payload[0] not in (ALL_VALUES, SUBRANGE):
        raise TelegramError("no scan: the payload does not begin with B0 or B7")
    at = 5 if payload[0] == SUBRANGE else 1
    word = int.from_bytes(payload[at : at + 2], "little")
    count, unit = word & _COUNT, word >> 14
    if unit > 1:
        raise TelegramError(f"unit {unit}; allowed: 0 (cm) or 1 (mm)")
    if len(payload) != at + 3 + 2 * count:
        raise TelegramError(f"{count} beams take {at + 3 + 2 * count} bytes, {len(payload)} are there")
    values = np.frombuffer(payload, "<u2", count, at + 2)
    none = (1 << bits) - 1
    counts = values & none
    ranges = np.where(counts == none, np.inf, counts * UNITS_M[unit])
    offset = 0.25 * (word >> _TURN & 3) if word & _PARTIAL else None
    first = int.from_bytes(payload[1:3], "little") if payload[0] == SUBRANGE else None
    return ScanValues(ranges, (values >> bits).astype(np.uint8), unit, payload[-1], bits, offset, first)
