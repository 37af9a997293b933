"""Serial ports and pseudo-terminals; the one place that imports pyserial (extra `hil`)."""

from __future__ import annotations

import os
import tty
from typing import Any, NamedTuple


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
