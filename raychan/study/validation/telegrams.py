"""Measures of the ship paper's four serial streams: what comes through, and how long it takes."""

from __future__ import annotations

import os
from datetime import time
from functools import cache

import numpy as np

from raychan.hil.nmea import Attitude, Fix, gga, hdt, pashr
from raychan.hil.pacing import line_time
from raychan.hil.scans import ScanValues, decode_scan, encode_scan
from raychan.hil.telegrams import TelegramReader, frame
from raychan.study.validation.bench import Bench
from raychan.study.validation.measures import Seen, measure

_AT = time(10, 11, 12)
_BEAMS = 181
_BAUD = 38400


@cache
def _streams() -> dict[str, bytes]:
    """Return what each of the four channels sends."""
    return {
        "scanner": frame(encode_scan(ScanValues(_ranges(), np.zeros(_BEAMS, np.uint8)))),
        "position": gga(Fix(_AT, 55.0, -1.5, 3.0)),
        "heading": hdt(12.0),
        "attitude": pashr(Attitude(_AT, 12.0, 3.0, -1.0)),
    }


def _ranges() -> np.ndarray:
    return np.linspace(1.0, 80.0, _BEAMS).round(2)


@measure
def stream_comes_through(bench: Bench, channel: str) -> Seen:
    """Return whether a channel's bytes come through a pseudo-terminal unchanged and decode: ranges, or check sum."""
    # Imported here: other systems than Unix have no pseudo-terminals.
    from raychan.hil.ports import open_port, pseudo_terminal

    sent, pair = _streams()[channel], pseudo_terminal()
    try:
        with open_port(pair.name, _BAUD) as port:
            os.write(pair.ours, sent)
            found = bytes(port.read(len(sent)))
    finally:
        os.close(pair.held)
        os.close(pair.ours)
    return found == sent and _decodes(channel, found)


def _decodes(channel: str, data: bytes) -> bool:
    if channel == "scanner":
        telegrams = TelegramReader().feed(data)
        return len(telegrams) == 1 and np.allclose(decode_scan(telegrams[0].payload).range_m, _ranges(), atol=1e-9)
    content, _, check = data.decode("ascii").strip().removeprefix("$").partition("*")
    total = 0
    for character in content:
        total ^= ord(character)
    return f"{total:02X}" == check


@measure
def stream_bytes(bench: Bench, channel: str) -> Seen:
    """Return how many bytes a channel sends at once."""
    return len(_streams()[channel])


@measure
def stream_time(bench: Bench, channel: str, baud: int) -> Seen:
    """Return how long [ms] that takes on a line of `baud`."""
    return 1e3 * line_time(len(_streams()[channel]), baud)


@measure
def stream_rate(bench: Bench, channels: list[str], baud: int) -> Seen:
    """Return how often a second [Hz] a line of `baud` carries what channels send at once, together."""
    return 1.0 / line_time(sum(len(_streams()[c]) for c in channels), baud)
