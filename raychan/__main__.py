"""`raychan` and `python -m raychan` are the command line."""

import os
import signal


def main() -> None:
    """Run the command line; Ctrl-C while its modules are imported ends the process, too."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _interrupted)
    # Pictures need no display; matplotlib cannot be imported where this names none of its own backends.
    os.environ["MPLBACKEND"] = "agg"
    from raychan.cli import main as run

    run()


def _interrupted(number: int, frame: object) -> None:
    try:  # noqa: SIM105  # contextlib takes a millisecond, in which a Ctrl-C is a traceback
        os.write(2, b"raychan: interrupted; nothing was written\n")
    except OSError:  # standard error may be closed
        pass
    os._exit(128 + number)


if __name__ == "__main__":
    main()
