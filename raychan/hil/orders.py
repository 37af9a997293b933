"""What a host sends to steer: `$PRCHN,rudder,shaft*hh`, found in a stream that may hold anything else.

rudder [deg] by the ship's own sign, shaft [rev/min]; an empty field gives it back to the autopilot. The check sum is
required, as in all sentences of NMEA 0183: two hexadecimal digits, XOR of the characters between $ and *.
"""

from __future__ import annotations

import math
import re
from typing import NamedTuple

NAME = "PRCHN"
_LONGEST = 256
"""Characters of a line that is waited for: a sentence has up to 82, a host's other sentences may be longer."""
_FIELDS = 2
_NUMBER = re.compile(r"[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)")
"""A number as sentences of NMEA 0183 have it: Python's also takes blanks, 1_0 and 1e1."""


class Order(NamedTuple):
    """Rudder [rad] and shaft speed [rev/s]; None gives it back to the autopilot."""

    rudder: float | None
    shaft: float | None


def order_sentence(rudder_deg: float | None = None, shaft_rpm: float | None = None) -> bytes:
    """Return the sentence of an order; None leaves a field empty."""
    fields = ("" if value is None else _decimal(value) for value in (rudder_deg, shaft_rpm))
    content = ",".join((NAME, *fields))
    return f"${content}*{_check_sum(content)}\r\n".encode("ascii")


class OrderReader:
    """Finds orders in a stream of bytes. Counts: `ignored` sentences of another name; `bad`: the check sum is wrong or
    missing, the fields of an order are, or a line has no sentence."""

    def __init__(self) -> None:
        self._rest = b""
        self.ignored = self.bad = 0

    def feed(self, data: bytes) -> list[Order]:
        """Return the orders that the bytes complete."""
        *lines, self._rest = (self._rest + data).split(b"\n")
        if len(self._rest) > _LONGEST:
            self.bad += 1
            self._rest = b""
        found = [self._read(line.strip(b"\r")) for line in lines if line.strip(b"\r")]
        return [order for order in found if order is not None]

    def give_up(self) -> None:
        """Drop and count half a sentence, of a host that has gone."""
        self.bad += bool(self._rest)
        self._rest = b""

    def _read(self, line: bytes) -> Order | None:
        """Return the order of a line; None for anything else, which is counted. The last $ begins the sentence."""
        before, _, sentence = line.rpartition(b"$")
        self.bad += bool(before)
        content, _, said = sentence.partition(b"*")
        try:
            text = content.decode("ascii")
        except UnicodeDecodeError:
            text = ""
        if not text or said.upper() != _check_sum(text).encode():
            self.bad += 1
            return None
        name, *fields = text.split(",")
        if name != NAME:
            self.ignored += 1
            return None
        try:
            return _order(fields)
        except ValueError:
            self.bad += 1
            return None


def _order(fields: list[str]) -> Order:
    """Return the order of the fields of a sentence. Raises: ValueError where they are none."""
    if len(fields) != _FIELDS:
        raise ValueError(f"{len(fields)} fields; allowed: {_FIELDS}")
    rudder, shaft = (_number(text) if text else None for text in fields)
    return Order(None if rudder is None else math.radians(rudder), None if shaft is None else shaft / 60.0)


def _number(text: str) -> float:
    """Return the number of a field. Raises: ValueError where it is no plain decimal one."""
    if not _NUMBER.fullmatch(text) or not math.isfinite(float(text)):
        raise ValueError(f"value is {text!r}; allowed: a decimal number, such as -12.5")
    return float(text)


def _decimal(value: float) -> str:
    """Return a number as a field has it, to 1e-6."""
    text = f"{value:.6f}"
    return text.rstrip("0").rstrip(".") if math.isfinite(value) else text


def _check_sum(content: str) -> str:
    from pynmeagps import calc_checksum

    return str(calc_checksum(content))
