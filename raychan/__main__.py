"""`raychan` and `python -m raychan` are the command line."""

import os
import signal
from contextlib import suppress
from types import FrameType


def main() -> None:
    """Run the command line; Ctrl-C while its modules are imported ends the process, too."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _interrupted)
    from raychan.cli import main as run

    run()


def _interrupted(number: int, frame: FrameType | None) -> None:
    with suppress(OSError):  # standard error may be closed
        os.write(2, b"raychan: interrupted; nothing was written\n")
    os._exit(128 + number)


if __name__ == "__main__":
    main()
