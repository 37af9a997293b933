"""Ends of serial lines: pseudo-terminals of our own, serial ports; the one place that imports pyserial.

Nothing here waits: reading returns what is there, writing what fits.
"""

from __future__ import annotations

import errno
import fcntl
import os
import select
import struct
import termios
import tty
from typing import Any, NamedTuple, Protocol

FIRST_RETRY, LAST_RETRY = 0.1, 2.0
"""Wait [s] before a lost serial port is opened again; it doubles from the first to the last. Trades how soon a port
comes back against opening one that is not there; not measured."""
_CHUNK = 4096
_WHY: dict[int | None, str] = {
    errno.ENOENT: "is not there",
    errno.ENODEV: "is not there",
    errno.ENXIO: "is not there",
    errno.EBUSY: "is taken by another program",
    errno.EWOULDBLOCK: "is taken by another program, or by another line of this one",
    errno.EACCES: "may not be opened by this user",
    errno.ENOTTY: "is no serial port",
    errno.EISDIR: "is no serial port",
}


class PortError(Exception):
    """A port that is not there, is taken, or cannot be a serial port; the message names it."""


class Port(Protocol):
    """The end of a line. `name` is what its peer, or the user, calls it; `paced` is whether it sends at its rate by
    itself. `reconnects` counts peers that came back; `unread` bytes that a peer left behind, at least."""

    name: str
    paced: bool
    unread: int

    @property
    def reconnects(self) -> int: ...  # noqa: D102

    @property
    def here(self) -> bool: ...  # noqa: D102

    def fileno(self) -> int: ...  # noqa: D102

    def look(self, now: float) -> None: ...  # noqa: D102

    def read(self) -> bytes: ...  # noqa: D102

    def write(self, data: bytes) -> int: ...  # noqa: D102

    def set_baud(self, baud: int) -> None: ...  # noqa: D102

    def close(self) -> None: ...  # noqa: D102


def open_port(name: str, baud: int, timeout: float = 1.0) -> Any:
    """Return an open `serial.Serial` of a port, 8N1.

    Args: name of the port; baud [bit/s]; timeout [s] of reading.
    Raises: OSError with the port's name where it is not there, or taken.
    """
    import serial

    return serial.Serial(name, baud, timeout=timeout, write_timeout=timeout, exclusive=True)


class PseudoTerminal(NamedTuple):
    """A pseudo-terminal: file descriptor of our end; that of the peer's end, held open; name that a peer opens.

    While the peer's end is held, its settings stay, and reading waits when a peer goes away and another comes.
    """

    ours: int
    held: int
    name: str


def pseudo_terminal() -> PseudoTerminal:
    """Return a new pseudo-terminal, raw: no echo, and no byte is changed on its way."""
    ours, held = os.openpty()
    tty.setraw(held)
    return PseudoTerminal(ours, held, os.ttyname(held))


class TerminalPort:
    """Our end of a pseudo-terminal. The peer's end is not held open, so that a peer that closes it is noticed.

    Fields as in `Port`. What a peer left unread is thrown away and counted: the next one does not read the past.
    """

    paced = False

    def __init__(self) -> None:
        self._ours, held, self.name = pseudo_terminal()
        os.close(held)
        os.set_blocking(self._ours, False)
        self._events = select.poll()
        self._events.register(self._ours, select.POLLIN)
        self._here = False
        self._peers = self.unread = 0

    @property
    def reconnects(self) -> int:
        """Peers that came after the first."""
        return max(0, self._peers - 1)

    @property
    def here(self) -> bool:
        """Whether a peer has the other end open."""
        return self._here

    def fileno(self) -> int:
        """Return the file descriptor to wait for; only while a peer is here."""
        return self._ours

    def look(self, now: float) -> None:
        """Notice a peer that came, or one that came and went and left bytes."""
        events = self._events.poll(0)
        flags = events[0][1] if events else 0
        if not self._here and (not flags & select.POLLHUP or flags & select.POLLIN):
            self._here = True
            self._peers += 1

    def read(self) -> bytes:
        """Return the bytes that are there; notice a peer that has gone."""
        try:
            return os.read(self._ours, _CHUNK)
        except BlockingIOError:
            return b""
        except OSError:
            self._gone()
            return b""

    def write(self, data: bytes) -> int:
        """Return how many of the bytes fit, 0 without a peer."""
        if not self._here:
            return 0
        try:
            return os.write(self._ours, data)
        except BlockingIOError:
            return 0
        except OSError:
            self._gone()
            return 0

    def set_baud(self, baud: int) -> None:
        """Do nothing: a pseudo-terminal has no rate."""

    def close(self) -> None:
        """Close our end; the name ceases to be."""
        os.close(self._ours)

    def _gone(self) -> None:
        self._here = False
        try:
            theirs = os.open(self.name, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        except OSError:
            return
        (left,) = struct.unpack("i", fcntl.ioctl(theirs, termios.FIONREAD, b"\0\0\0\0"))
        self.unread += left
        termios.tcflush(theirs, termios.TCIFLUSH)
        os.close(theirs)


class SerialPort:
    """A serial port of the machine, opened again when it was lost. Fields as in `Port`.

    Raises: PortError where it cannot be opened at first.
    """

    paced = True
    unread = 0

    def __init__(self, name: str, baud: int) -> None:
        self.name, self._baud = name, baud
        self._times = 0
        self._wait, self._retry_at = FIRST_RETRY, 0.0
        try:
            self._port: Any = open_port(name, baud, 0.0)
        except (OSError, ValueError) as error:
            raise PortError(_in_words(name, error)) from error

    @property
    def reconnects(self) -> int:
        """Times that the port was opened again."""
        return self._times

    @property
    def here(self) -> bool:
        """Whether the port is open."""
        return self._port is not None

    def fileno(self) -> int:
        """Return the file descriptor to wait for; only while the port is open."""
        return int(self._port.fileno())

    def look(self, now: float) -> None:
        """Open a lost port again, if it is time [s] to try."""
        if self._port is not None or now < self._retry_at:
            return
        try:
            self._port = open_port(self.name, self._baud, 0.0)
        except (OSError, ValueError):
            self._retry_at = now + self._wait
            self._wait = min(2.0 * self._wait, LAST_RETRY)
            return
        self._wait = FIRST_RETRY
        self._times += 1

    def read(self) -> bytes:
        """Return the bytes that are there; notice a port that is lost."""
        try:
            data = os.read(self._port.fileno(), _CHUNK)
        except BlockingIOError:
            return b""
        except OSError:
            data = b""
        if not data:  # the end of a file: the device is gone
            self._lost()
        return data

    def write(self, data: bytes) -> int:
        """Return how many of the bytes fit, 0 while the port is lost."""
        if self._port is None:
            return 0
        try:
            return os.write(self._port.fileno(), data)
        except BlockingIOError:
            return 0
        except OSError:
            self._lost()
            return 0

    def set_baud(self, baud: int) -> None:
        """Change the rate [bit/s] of the line."""
        self._baud = baud
        if self._port is None:
            return
        try:
            self._port.baudrate = baud
        except (OSError, ValueError, termios.error):
            self._lost()

    def close(self) -> None:
        """Close the port."""
        self._lost()

    def _lost(self) -> None:
        port, self._port = self._port, None
        if port is not None:
            try:
                port.close()
            except OSError:
                return


def _in_words(name: str, error: Exception) -> str:
    """Return what went wrong with a port; pyserial keeps the system's error number where there is one."""
    number = getattr(error, "errno", None)
    if number is None and "configure port" in str(error):
        number = errno.ENOTTY
    why = _WHY.get(number) or str(error).replace(name, "").strip(" :")
    return f"{name} {why}" if number in _WHY else f"{name}: {why}"
