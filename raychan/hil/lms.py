"""What an LMS221-like scanner says and answers: scans, status, type, configuration, modes and baud rates.

Byte offsets count from the command byte. They follow what drivers of LMS2xx scanners read; fields that no driver reads
are 0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.hil.telegrams import ACK, HOST_TO_SCANNER, NAK, Telegram, TelegramError, frame

Floats = NDArray[np.float64]

BAUD_CODES = {0x42: 9600, 0x41: 19200, 0x40: 38400, 0x48: 500000}
STREAM, ON_REQUEST = 0x24, 0x25
UNITS_M = (0.01, 0.001)
"""Length [m] of a count in unit 0 and in unit 1 (bits 14 and 15 of the number of beams)."""
NO_ECHO = 0x1FFF
"""Largest distance that 13 bits hold; stands for a beam without an echo."""
MODE, POLL, STATUS, TYPE, CONFIGURATION = 0x20, 0x30, 0x31, 0x3A, 0x74
ANSWER = 0x80
"""Is added to a command to name its answer."""
STATUS_LENGTH = 152
_COUNT = 0x3FFF


@dataclass(frozen=True)
class ScanValues:
    """One scan as sent.

    Fields: range_m (n,) [m], inf without an echo; fields (n,) bits 0 to 2: field A, field B, dazzle; unit 0 (cm) or
    1 (mm); status byte.
    """

    range_m: Floats
    fields: NDArray[np.uint8]
    unit: int = 0
    status: int = 0


def encode_scan(scan: ScanValues) -> bytes:
    """Return the payload B0 of a scan; distances are rounded to the unit, larger ones than 13 bits hold are no echo.

    Raises: TelegramError for ranges that are negative or NaN, an unknown unit, fields beyond 3 bits, too many beams.
    """
    ranges, fields = np.asarray(scan.range_m, float), np.asarray(scan.fields)
    if scan.unit not in (0, 1):
        raise TelegramError(f"unit {scan.unit}; allowed: 0 (cm) or 1 (mm)")
    if not (ranges >= 0.0).all():
        raise TelegramError("a range is negative or NaN; a beam without an echo is inf")
    if fields.shape != ranges.shape or (fields > 7).any() or (fields < 0).any():
        raise TelegramError("fields: one of 0 to 7 for each beam")
    if ranges.ndim != 1 or len(ranges) > _COUNT:
        raise TelegramError(f"{ranges.shape} beams; allowed: a row of up to {_COUNT}")
    counts = np.minimum(np.round(np.minimum(ranges, 100.0) / UNITS_M[scan.unit]), NO_ECHO).astype("<u2")
    values = counts | fields.astype("<u2") << 13
    head = bytes((POLL | ANSWER,)) + (len(ranges) | scan.unit << 14).to_bytes(2, "little")
    return head + values.astype("<u2").tobytes() + bytes((scan.status,))


def decode_scan(payload: bytes) -> ScanValues:
    """Return the scan of a payload B0.

    Raises: TelegramError for another command, a length that does not fit the number of beams, an unknown unit.
    """
    if len(payload) < 4 or payload[0] != POLL | ANSWER:
        raise TelegramError("no scan: the payload does not begin with B0")
    word = int.from_bytes(payload[1:3], "little")
    count, unit = word & _COUNT, word >> 14
    if unit > 1:
        raise TelegramError(f"unit {unit}; allowed: 0 (cm) or 1 (mm)")
    if len(payload) != 4 + 2 * count:
        raise TelegramError(f"{count} beams take {4 + 2 * count} bytes, {len(payload)} are there")
    values = np.frombuffer(payload, "<u2", count, 3)
    counts = values & NO_ECHO
    ranges = np.where(counts == NO_ECHO, np.inf, counts * UNITS_M[unit])
    return ScanValues(ranges, (values >> 13).astype(np.uint8), unit, payload[-1])


@dataclass
class Scanner:
    """The scanner's end of the line: keeps its mode and answers commands.

    Fields: latest returns the last scan; angle_deg and step_deg of its fan; unit 0 (cm) or 1 (mm); streaming whether it
    sends each scan unasked; baud of the line; refused telegrams that it answered with NAK.
    """

    latest: Callable[[], ScanValues]
    angle_deg: int = 180
    step_deg: float = 1.0
    unit: int = 0
    streaming: bool = False
    baud: int = 9600
    refused: int = 0

    def answer(self, telegram: Telegram) -> bytes:
        """Return the bytes sent back: ACK and a telegram, or NAK for what is unknown; b"" if not addressed to it.

        A new baud rate holds once these bytes are sent: the answer goes out at the old one.
        """
        if telegram.address != HOST_TO_SCANNER:
            return b""
        command, rest = telegram.payload[0], telegram.payload[1:]
        if command == MODE and len(rest) >= 1 and self._switch(rest[0]):
            body = b"\x00"
        elif command == POLL:
            return bytes((ACK,)) + self.scan()
        elif command == STATUS:
            body = self._status()
        elif command == TYPE:
            body = b"LMS221;raychan;V01.00"
        elif command == CONFIGURATION:
            body = self._configuration()
        else:
            return self.refuse()
        return bytes((ACK,)) + frame(bytes((command | ANSWER,)) + body + b"\x00")

    def refuse(self) -> bytes:
        """Return NAK, and count it: for a command that is unknown or came damaged."""
        self.refused += 1
        return bytes((NAK,))

    def scan(self) -> bytes:
        """Return the last scan as a telegram."""
        return frame(encode_scan(self.latest()))

    def _switch(self, mode: int) -> bool:
        if mode in (STREAM, ON_REQUEST):
            self.streaming = mode == STREAM
        elif mode in BAUD_CODES:
            self.baud = BAUD_CODES[mode]
        else:
            return False
        return True

    def _status(self) -> bytes:
        """Return the status between command and status byte."""
        p = bytearray(STATUS_LENGTH)
        p[1:8] = b"V01.00 "
        p[8] = STREAM if self.streaming else ON_REQUEST
        p[67:69] = (75 * 60).to_bytes(2, "little")  # mirror [turns/min]
        p[107:109] = self.angle_deg.to_bytes(2, "little")
        p[109:111] = round(100.0 * self.step_deg).to_bytes(2, "little")
        p[122] = self.unit
        p[124:131] = b"V01.00 "
        return bytes(p[1:-1])

    def _configuration(self) -> bytes:
        """Return the configuration between command and status byte: offset 6 is the measuring mode, 7 the unit."""
        p = bytearray(35)
        p[7] = self.unit
        return bytes(p[1:])
