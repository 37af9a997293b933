"""Frames of SICK LMS2xx telegrams: STX, address, length, payload, CRC; multi-byte numbers are little-endian.

The payload begins with the command and ends, from the scanner, with a status byte.
"""

from __future__ import annotations

from dataclasses import dataclass

STX, ACK, NAK = 0x02, 0x06, 0x15
HOST_TO_SCANNER, SCANNER_TO_HOST = 0x00, 0x80
LONGEST = 2048
"""Longest payload [bytes] that a reader waits for: 721 beams take 1,446. A longer length is a damaged one."""
_HEAD, _TAIL = 4, 2
_POLYNOMIAL = 0x8005


class TelegramError(ValueError):
    """Bytes that are no whole, undamaged telegram, or a payload that is not what it should be."""


@dataclass(frozen=True)
class Telegram:
    """A telegram: address (HOST_TO_SCANNER or SCANNER_TO_HOST), payload from the command to the status byte."""

    address: int
    payload: bytes


def crc(data: bytes) -> int:
    """Return the 16-bit check sum of LMS2xx telegrams, which is no CRC-16 of the catalogues.

    Each byte shifts the register by one bit only, and is added together with the byte before it. So a flipped bit
    changes two bits of the register that never cancel, and no later byte can undo it.
    Args: data: the telegram from STX to the end of its payload.
    """
    register, before = 0, 0
    for byte in data:
        carry = register & 0x8000
        register = (register << 1) & 0xFFFF
        if carry:
            register ^= _POLYNOMIAL
        register ^= byte | before << 8
        before = byte
    return register


def frame(payload: bytes, address: int = SCANNER_TO_HOST) -> bytes:
    """Return a payload as the bytes of a telegram.

    Raises: TelegramError for an empty payload or one longer than LONGEST.
    """
    if not 1 <= len(payload) <= LONGEST:
        raise TelegramError(f"payload of {len(payload)} bytes; allowed: 1 to {LONGEST}")
    body = bytes((STX, address)) + len(payload).to_bytes(2, "little") + payload
    return body + crc(body).to_bytes(2, "little")


def unframe(data: bytes) -> Telegram:
    """Return the telegram that the bytes are, no more and no less.

    Raises: TelegramError that says what is wrong: start, length or check sum.
    """
    if len(data) < _HEAD + 1 + _TAIL:
        raise TelegramError(f"half a telegram: {len(data)} bytes")
    if data[0] != STX:
        raise TelegramError(f"starts with {data[0]:02X}, not with STX (02)")
    length = int.from_bytes(data[2:4], "little")
    if length != len(data) - _HEAD - _TAIL:
        raise TelegramError(f"length says {length} bytes, {len(data) - _HEAD - _TAIL} are there")
    said, found = int.from_bytes(data[-_TAIL:], "little"), crc(data[:-_TAIL])
    if said != found:
        raise TelegramError(f"CRC is {said:04X}, the bytes give {found:04X}")
    return Telegram(data[1], data[_HEAD:-_TAIL])


class TelegramReader:
    """Finds telegrams in a stream of bytes that may start anywhere, break off, or be damaged.

    After a damaged telegram the search goes on at the byte after its STX, so a good one that overlaps it is not lost.
    Counts: `damaged` telegrams whose length or CRC is wrong; `skipped` bytes that are of no telegram, those of damaged
    ones included; `acknowledged` and `refused` are bytes ACK and NAK between telegrams.
    Args: longest payload [bytes] that is waited for.
    """

    def __init__(self, longest: int = LONGEST) -> None:
        self._rest, self._longest = b"", longest
        self.damaged = self.skipped = self.acknowledged = self.refused = 0

    @property
    def waiting(self) -> int:
        """Bytes of a telegram that has begun and is not whole."""
        return len(self._rest)

    def feed(self, data: bytes) -> list[Telegram]:
        """Return the telegrams that the bytes complete, in order."""
        self._rest += data
        return self._take(final=False)

    def give_up(self) -> list[Telegram]:
        """Return whole telegrams inside a half one, and drop the rest; for a line that has fallen silent."""
        return self._take(final=True)

    def _take(self, final: bool) -> list[Telegram]:
        found: list[Telegram] = []
        at, data = 0, self._rest
        while at < len(data):
            if data[at] != STX:
                self._pass_over(data[at])
                at += 1
                continue
            length = int.from_bytes(data[at + 2 : at + 4], "little")
            short_head = len(data) - at < _HEAD
            bad = not short_head and not 1 <= length <= self._longest
            end = at + _HEAD + length + _TAIL
            if not bad and not final and (short_head or end > len(data)):
                break
            try:
                found.append(unframe(data[at:end]))
                at = end
            except TelegramError:
                self.damaged += 1
                self.skipped += 1
                at += 1
        self._rest = data[at:]
        return found

    def _pass_over(self, byte: int) -> None:
        self.acknowledged += byte == ACK
        self.refused += byte == NAK
        self.skipped += byte not in (ACK, NAK)
