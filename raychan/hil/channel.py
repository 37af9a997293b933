"""One channel: frames and answers leave through a line of a given rate; each frame is sent, or dropped and counted."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import NamedTuple

from raychan.hil.pacing import Lateness, Line, line_time
from raychan.hil.ports import Port

_MOST_WAITING = 65_536
"""Bytes [bytes] of answers kept for a host that asks and does not read. More are dropped and counted; not measured."""
_SETTLES = 5e-3
"""Time [s] after the last byte of an answer until a port changes its rate; not measured."""


_FRAME, _ANSWER, _PART = "frame", "answer", "part"


class _Item(NamedTuple):
    at: float
    ideal: float
    data: bytes
    kind: str
    baud: int = 0


@dataclass(frozen=True)
class Tally:
    """What became of a channel's frames: made = sent + busy + no_peer + not_reading + unfinished.

    Fields: busy dropped since the line was busy; no_peer since nobody had the other end open; not_reading since the
    peer's buffer was full; unfinished on the line at the end; answers sent; answers_dropped.
    """

    made: int
    sent: int
    busy: int
    no_peer: int
    not_reading: int
    unfinished: int
    answers: int
    answers_dropped: int


class Channel:
    """A line with a port at its end. A frame that finds the line busy is dropped; an answer waits for the line.

    On a pseudo-terminal, which has no rate, bytes are written when the last of them would have left; a serial port
    paces them itself. Times [s] are arguments, of one monotonic clock.
    """

    def __init__(self, name: str, port: Port, baud: int) -> None:
        self.name, self.port, self.line = name, port, Line(baud)
        self.lateness = Lateness()
        self._queue: deque[_Item] = deque()
        self._rest, self._of = b"", _PART
        self._made = self._sent = self._no_peer = self._not_reading = self._answers = self._lost = 0

    @property
    def due(self) -> float:
        """When [s] the next bytes are to be written; infinity if none are, or the peer must read first."""
        return self._queue[0].at if self._queue and not self._rest else math.inf

    @property
    def blocked(self) -> bool:
        """Whether bytes wait for the peer to read."""
        return bool(self._rest)

    def frame(self, now: float, due: float, data: bytes) -> None:
        """Send a frame that was due at a time [s]; drop and count it where nobody listens or the line is busy."""
        self._made += 1
        if not self.port.here:
            self._no_peer += 1
            return
        if self._rest:
            self._not_reading += 1
            return
        end = self.line.offer(now, len(data))
        if end is None:
            return
        if self.port.paced:
            self._queue.append(_Item(now, due, data, _FRAME))
        else:
            self._queue.append(_Item(end, due + line_time(len(data), self.line.baud), data, _FRAME))

    def answer(self, now: float, data: bytes, baud: int | None = None, first: int = 0) -> None:
        """Send an answer as soon as the line is free.

        Args: baud [bit/s] to change to afterwards, if one is given; first bytes that are written once they have left,
        before the rest: hosts wait for an ACK, not for the telegram behind it.
        """
        if sum(len(item.data) for item in self._queue) > _MOST_WAITING:
            self._lost += 1
            return
        for kind, part in ((_PART, data[:first]), (_ANSWER, data[first:])):
            end = self.line.reserve(now, len(part))
            at = now if self.port.paced else end
            if part:
                self._queue.append(_Item(at, at, part, kind))
        if baud is not None and baud != self.line.baud:
            self._queue.append(_Item(end + _SETTLES, end, b"", _PART, baud))

    def read(self) -> bytes:
        """Return the bytes that are there; what was on its way to a peer that has gone is dropped and counted."""
        data = self.port.read()
        if not self.port.here:
            self._peer_gone()
        return data

    def pump(self, now: float) -> None:
        """Write what is due."""
        if self._rest:
            self._write(self._rest, self._of, None)
        while self.due <= now:
            item = self._queue.popleft()
            if item.baud:
                self.line.baud = item.baud
                self.port.set_baud(item.baud)
            elif not self.port.here:
                self._drop(item.kind)
            else:
                self._write(item.data, item.kind, now - item.ideal)

    def tally(self) -> Tally:
        """Return what became of the frames so far."""
        left = sum(item.kind == _FRAME for item in self._queue) + (self._rest != b"" and self._of == _FRAME)
        return Tally(
            self._made, self._sent, self.line.dropped, self._no_peer, self._not_reading, left, self._answers, self._lost
        )

    def _write(self, data: bytes, kind: str, late: float | None) -> None:
        """Write bytes; keep the rest of what has begun, so that no half of a frame is sent. Args: late [s], None for
        such a rest."""
        written = self.port.write(data)
        if not self.port.here:
            self._rest, self._of = data, kind
            self._peer_gone()
        elif kind == _FRAME and not written and late is not None:
            self._not_reading += 1
        else:
            self._rest, self._of = data[written:], kind
            if not self._rest:
                self._sent += kind == _FRAME
                self._answers += kind == _ANSWER
            if kind == _FRAME and late is not None:
                self.lateness.note(late)

    def _peer_gone(self) -> None:
        if self._rest:
            self._drop(self._of)
            self._rest = b""
        kept = [item for item in self._queue if item.baud]
        for item in self._queue:
            if not item.baud:
                self._drop(item.kind)
        self._queue = deque(kept)

    def _drop(self, kind: str) -> None:
        self._no_peer += kind == _FRAME
        self._lost += kind == _ANSWER
