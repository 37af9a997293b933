"""The command line. Nothing heavy is imported until a command needs it."""

from __future__ import annotations

import _thread
import os
import signal
import sys
import threading
from types import FrameType

import typer

from raychan.cli.explain import explain
from raychan.cli.info import info
from raychan.cli.options import help_of
from raychan.cli.rcs import rcs
from raychan.cli.run import run
from raychan.cli.show import Interrupted
from raychan.cli.study import study
from raychan.cli.validate import validate
from raychan.cli.view import view

_HELP = """A street becomes a range-Doppler map, and every detection names the bodies it came from.

A scene file (TOML) says which bodies stand where, of what they are made, how they move, and what radar looks at them. \
raychan traces the waves over them, synthesises what the receiver samples, and processes it as a radar would.

[bold]raychan info scenes/urban.toml[/]
  [dim]what is in it, and what the radar can resolve[/]
[bold]raychan run scenes/urban.toml --out out/urban[/]
  [dim]simulate: detections, files and pictures[/]
[bold]raychan explain out/urban --range 25[/]
  [dim]which paths made the return at 25 m[/]
[bold]raychan view out/urban --html scene.html[/]
  [dim]the scene and its rays, to turn and to pick[/]

Ranges are in metres, speeds in m/s; a positive range rate recedes.

Exit code 0: done
  1: validate found an unknown or a healed difference
  2: the input is wrong, and the message says where
  130: interrupted, 143: told to end (SIGTERM); it says what was written"""

_STOPPED = "interrupted; nothing was written"
_ended: list[int] = []  # signals other than Ctrl-C that asked this process to end

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
    pass


for command in (run, info, rcs, explain, view, validate):
    app.command(help=help_of(command))(command)
app.add_typer(study, name="study")


def main(argv: list[str] | None = None) -> None:
    """Run the command line and end the process with its exit code."""
    sys.unraisablehook = _interrupt_again
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, _end)
    sys.exit(invoke(sys.argv[1:] if argv is None else argv))


def _end(number: int, frame: FrameType | None) -> None:
    """End as Ctrl-C does, but for the exit code: what was begun is put away."""
    _ended.append(number)
    raise KeyboardInterrupt


def _stopped(text: str) -> int:
    """Say that the command was interrupted; return the exit code, 128 and the signal's number."""
    return _fail(text, 128 + (_ended[-1] if _ended else signal.SIGINT))


def _interrupt_again(lost: sys.UnraisableHookArgs) -> None:
    """Repeat a Ctrl-C that was lost in a callback from C, such as numba's when it loads compiled code."""
    if issubclass(lost.exc_type, KeyboardInterrupt):
        threading.Timer(0.05, _interrupt).start()
    else:
        sys.__unraisablehook__(lost)


def _interrupt() -> None:
    """Send the interruption to the main thread again; a signal, unlike a mere note, also ends its waits."""
    main_thread = threading.main_thread().ident
    if hasattr(signal, "pthread_kill") and main_thread is not None:
        signal.pthread_kill(main_thread, signal.SIGINT)
    else:
        _thread.interrupt_main()


def invoke(argv: list[str]) -> int:
    """Run one command and return its exit code: 0, 2 for input that is wrong, 130 for Ctrl-C, 143 for SIGTERM."""
    try:
        code = typer.main.get_command(app).main(args=argv, prog_name="raychan", standalone_mode=False)
        if (trouble := _unprinted()) is not None:
            return trouble
        # typer turns Ctrl-C into an exit code of its own, silently.
        return _stopped(_STOPPED) if code == 130 else int(code or 0)
    except (KeyboardInterrupt, typer.Abort):
        return _stopped(_STOPPED)
    except Interrupted as stop:
        return _stopped(str(stop))
    except BrokenPipeError:
        return _unprinted() or 0
    except MemoryError:
        return _fail("out of memory; ask for a coarser --tolerance or fewer --max-bounces")
    except Exception as error:
        if hasattr(error, "format_message"):  # typer's own, of options and arguments
            text = error.format_message()
            return _fail(text) if text else 2
        from raychan.parallel import was_interrupted
        from raychan.world.errors import SceneError

        if was_interrupted(error):
            return _stopped(_STOPPED)

        _unprinted()
        if isinstance(error, OSError) and error.errno and not error.filename:
            return _fail(f"standard output: {error.strerror}")  # files are told of by their names
        if isinstance(error, SceneError | OSError):
            return _fail(str(error))
        raise


def _unprinted() -> int | None:
    """Print what waits to be printed; return the exit code where standard output does not take it."""
    if sys.stdout is None:  # closed by whoever started the command
        return None
    try:
        sys.stdout.flush()
        return None
    except OSError as error:
        # Python would complain again when it flushes at the end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if isinstance(error, BrokenPipeError):
            return 0  # the reader of a pipe went away, as `head` does
        return _fail(f"standard output: {error.strerror or error}")


def _fail(text: str, code: int = 2) -> int:
    print(f"raychan: {text}", file=sys.stderr)
    return code
