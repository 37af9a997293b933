"""The command line. Heavy modules are imported only when a command needs them."""

from __future__ import annotations

import _thread
import atexit
import os
import signal
import sys
import threading
from types import FrameType

import typer

from raychan.cli.explain import explain
from raychan.cli.hil import hil
from raychan.cli.info import info
from raychan.cli.options import help_of, unread
from raychan.cli.rcs import rcs
from raychan.cli.run import run
from raychan.cli.ship import ship
from raychan.cli.show import Interrupted, open_streams, say, silence
from raychan.cli.spectrogram import spectrogram
from raychan.cli.study import study
from raychan.cli.validate import validate
from raychan.cli.view import view
from raychan.run.files.in_place import ENDS, forget, told

_HELP = """Simulate a radar: from a scene to a range-Doppler map whose detections name the bodies they come from.

A scene file (TOML) gives the bodies with their positions, materials and motion, and the radar. raychan traces the \
waves, synthesises the receiver's samples, and processes them as a radar does.

[bold]raychan info scenes/urban.toml[/]
  [dim]bodies, link budget and resolutions[/]
[bold]raychan run scenes/urban.toml --out out/urban[/]
  [dim]simulate: detections, files and pictures[/]
[bold]raychan explain out/urban --range 25[/]
  [dim]the paths behind the detection at 25 m[/]
[bold]raychan view out/urban --html scene.html[/]
  [dim]the scene and its rays, interactive[/]

Ranges are in metres, speeds in m/s; a positive range rate means receding.

Exit code 0: done
  1: validate found a difference that is not listed, or a listed one that is gone
  2: wrong input; the message says what, where, and what is allowed
  130: interrupted, 143: ended by SIGTERM, 129: by the end of its terminal; the message says what was written"""

_ended: list[int] = []  # signals that asked this process to end, the first counts

app = typer.Typer(
    help=_HELP,
    no_args_is_help=True,
    rich_markup_mode="rich",
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 120},
)


def _version(wanted: bool) -> None:
    if wanted:
        from raychan import __version__

        print(f"raychan {__version__}")
        raise typer.Exit


@app.callback()
def _top(
    version: bool = typer.Option(False, "--version", callback=_version, is_eager=True, help="Print the version."),
) -> None:
    from raychan.parallel import threads

    try:
        threads()
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None


for command in (run, info, rcs, spectrogram, explain, view, ship, hil, validate):
    app.command(help=help_of(command))(command)
app.add_typer(study, name="study")


def main(argv: list[str] | None = None) -> None:
    """Run the command line and end the process with its exit code."""
    sys.unraisablehook = _interrupt_again
    if threading.current_thread() is threading.main_thread():
        atexit.register(_ignore)  # before modules that commands import, so that it is called last
        for number in ENDS:
            # A job in the background ignores Ctrl-C, one under nohup the end of its terminal.
            if number == signal.SIGTERM or signal.getsignal(number) is not signal.SIG_IGN:
                signal.signal(number, _end)
    code = invoke(sys.argv[1:] if argv is None else argv)
    # A KeyboardInterrupt in code that is a text, as dataclasses make it, has Python end by SIGINT in place of this
    # code, though it was caught; the next such code takes that back.
    exec("")
    _settle(code)
    sys.exit(code)


def _end(number: int, frame: FrameType | None) -> None:
    """End by an exception, so that unfinished files are removed."""
    _ended.append(number)
    raise KeyboardInterrupt


def _no_more(number: int, frame: FrameType | None) -> None:
    """Let a further signal pass, while the command tells that it was interrupted."""


def _settle(code: int) -> None:
    """Have signals end the process with this exit code from now on: its command is done."""

    def leave(number: int, frame: FrameType | None) -> None:
        os._exit(code)

    for number in ENDS:
        if signal.getsignal(number) in (_end, _no_more):
            signal.signal(number, leave)


def _ignore() -> None:
    """Ignore signals while Python takes itself down: it does without its handlers then, and would end by the signal."""
    for number in ENDS:
        signal.signal(number, signal.SIG_IGN)


def _stopped(text: str = "") -> int:
    """Print that the command was interrupted, and what is in place; return the exit code, 128 plus the signal's number.

    Args: text in place of that."""
    for number in ENDS:
        if signal.getsignal(number) is _end:
            signal.signal(number, _no_more)
    _unprinted()
    written = told() or "nothing was written"
    return _fail(text or f"interrupted; {written}", 128 + (_ended[0] if _ended else signal.SIGINT))


def _interrupt_again(lost: sys.UnraisableHookArgs) -> None:
    """Repeat a Ctrl-C that was lost in a callback from C, such as numba's when it loads compiled code."""
    if issubclass(lost.exc_type, KeyboardInterrupt):
        threading.Timer(0.05, _interrupt).start()
    else:
        sys.__unraisablehook__(lost)


def _interrupt() -> None:
    """Send the interruption to the main thread again, by a signal, which also ends its waits."""
    main_thread = threading.main_thread().ident
    if hasattr(signal, "pthread_kill") and main_thread is not None:
        signal.pthread_kill(main_thread, signal.SIGINT)
    else:
        _thread.interrupt_main()


def invoke(argv: list[str]) -> int:
    """Run one command and return its exit code: 0, 2 for input that is wrong, 130 for Ctrl-C, 143 for SIGTERM, 129 for
    SIGHUP."""
    open_streams()
    forget()
    try:
        code = typer.main.get_command(app).main(args=argv, prog_name="raychan", standalone_mode=False)
        if (trouble := _unprinted()) is not None:
            return trouble
        # typer turns Ctrl-C into an exit code of its own, silently.
        return _stopped() if code == 130 else int(code or 0)
    except (KeyboardInterrupt, typer.Abort):
        return _stopped()
    except Interrupted as stop:
        return _stopped(str(stop))
    except BrokenPipeError:
        return _unprinted() or 0
    except SystemExit as stop:
        # typer's answer to a closed pipe, as when `head` has read enough of a help text.
        if isinstance(stop.__context__, BrokenPipeError):
            return _unprinted() or 0
        raise
    except MemoryError:
        return _fail("out of memory; ask for a coarser --tolerance or fewer --max-bounces")
    except Exception as error:
        if hasattr(error, "format_message"):  # typer's own, of options and arguments
            text = unread(error) or error.format_message()
            return _fail(text) if text else 2
        from raychan.parallel import was_interrupted
        from raychan.world.errors import SceneError

        # Compiled modules turn an interruption while they are imported into errors of their own.
        if _ended or was_interrupted(error):
            return _stopped()

        _unprinted()
        if isinstance(error, OSError) and error.errno and not error.filename:
            return _fail(f"standard output: {error.strerror}")  # errors of files have a file name
        if isinstance(error, SceneError | OSError):
            return _fail(str(error))
        raise


def _unprinted() -> int | None:
    """Flush standard output; return the exit code where it cannot be written."""
    try:
        sys.stdout.flush()
        return None
    except OSError as error:
        silence(sys.stdout)
        if isinstance(error, BrokenPipeError):
            return 0  # the reader of a pipe went away, as `head` does
        return _fail(f"standard output: {error.strerror or error}")


def _fail(text: str, code: int = 2) -> int:
    say(f"raychan: {text}")
    return code
