"""raychan hil: a ship's scanner and instruments on serial lines, in real time."""

from __future__ import annotations

import json
import signal
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from raychan.cli import show
from raychan.cli.hil_files import check_out, track, write_summary
from raychan.cli.options import ShipChanges, ShipSceneFile, directory, within
from raychan.run.files.in_place import ENDS
from raychan.world.limits import Limit

if TYPE_CHECKING:
    from raychan.hil.channel import Channel
    from raychan.hil.geodesy import Origin
    from raychan.hil.ports import Port

_BAUDS = (9600, 19200, 38400, 500000)
_NMEA_BAUD = Limit(4800, 500_000, "bit/s", "NMEA 0183 runs at 4800, its fast form at 38400")
_RATE = Limit(0.1, 50.0, "per second", "a satellite receiver tells its place 1 to 20 times a second")
_DURATION = Limit(0.0, 1e7, "s", "a run of months is a mistake", above=True)
_ALWAYS = (signal.SIGINT, signal.SIGTERM)
"""Signals that end a run even if they were ignored; nohup ignores that of a closed terminal."""
_ORIGIN = "54.0,8.0"

Device = Annotated[str | None, typer.Option(help="Serial port; if not given, a pseudo-terminal.", metavar="PORT")]


def _origin(text: str) -> Origin:
    """Return an origin of 'latitude,longitude'. Raises: typer.BadParameter."""
    from raychan.hil.geodesy import Origin

    try:
        latitude, longitude = (float(part) for part in str(text).split(","))
    except ValueError:
        wanted = f"two numbers, latitude and longitude in degrees, as {_ORIGIN}"
        raise typer.BadParameter(f"'{text}': {wanted}", param_hint="--origin") from None
    try:
        return Origin(latitude, longitude)
    except ValueError as error:
        raise typer.BadParameter(f"'{text}': {error}", param_hint="--origin") from None


def _baud(value: int) -> int:
    if value not in _BAUDS:
        raise typer.BadParameter(f"{value}; allowed: {', '.join(map(str, _BAUDS))}")
    return value


def hil(
    scene: ShipSceneFile = Path("ship_turn"),
    scanner: Device = None,
    position: Device = None,
    heading: Device = None,
    attitude: Device = None,
    baud: Annotated[
        int, typer.Option(help="Rate of the scanner's line at the start, in bit/s.", metavar="N", callback=_baud)
    ] = 38400,
    nmea_baud: Annotated[
        int, typer.Option(help="Rate of the other lines, in bit/s.", metavar="N", callback=within(_NMEA_BAUD, True))
    ] = 38400,
    rate: Annotated[
        float, typer.Option(help="Sentences of each kind a second.", metavar="N", callback=within(_RATE))
    ] = 10.0,
    origin: Annotated[
        str, typer.Option(help="Latitude and longitude of the scene's origin in degrees.", metavar="LAT,LON")
    ] = _ORIGIN,
    duration: Annotated[
        float | None,
        typer.Option(help="Seconds to run; if not given, until Ctrl-C.", metavar="S", callback=within(_DURATION)),
    ] = None,
    stream: Annotated[bool, typer.Option("--stream", help="Send scans from the start, before a host asks.")] = False,
    realtime: Annotated[
        bool,
        typer.Option(
            "--realtime/--no-realtime", help="Run before other programs (SCHED_FIFO), where the system allows it."
        ),
    ] = True,
    ports: Annotated[bool, typer.Option("--ports", help="Print the names of the ports as JSON, then run.")] = False,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="Directory for summary.json and track.csv.", metavar="DIR", parser=directory),
    ] = None,
    set_: ShipChanges = None,
) -> None:
    """Run a ship in real time: scanner telegrams, position, heading and attitude on four serial lines; orders for
    rudder and shaft come back.

    Without SCENE: ship_turn. Once the ports are named, Ctrl-C, SIGTERM or SIGHUP ends the run in order, with exit
    code 0.
    """
    from raychan.hil.summary import one_line, warnings

    place = _origin(origin)
    if out is not None:
        check_out(out)
    names = {"scanner": scanner, "position": position, "heading": heading, "attitude": attitude}
    with ExitStack() as ending, ExitStack() as closing:  # signals are heard until the ports are closed
        channels = _channels(names, baud, nmea_baud, closing)
        wishes = _Wishes(scene, set_ or [], place, rate, duration, stream, realtime, ports, out)
        numbers = _run(wishes, channels, ending)
        if out is not None:
            write_summary(out, numbers)
        show.warn(warnings(numbers))
        _say(one_line(numbers))
    if numbers["failed"]:
        from raychan.world.errors import SceneError

        raise SceneError(numbers["ended"])


class _Wishes(NamedTuple):
    scene: Path
    changes: list[str]
    origin: Origin
    rate: float
    duration: float | None
    stream: bool
    realtime: bool
    ports: bool
    out: Path | None


def _channels(names: dict[str, str | None], baud: int, nmea_baud: int, closing: ExitStack) -> dict[str, Channel]:
    """Return the channels on their ports, which `closing` closes. Raises: typer.BadParameter for a wrong port."""
    try:
        from raychan.hil.channel import Channel
        from raychan.hil.ports import PortError, SerialPort, TerminalPort
    except ModuleNotFoundError as error:  # fcntl, termios
        raise typer.BadParameter("raychan hil needs a system with pseudo-terminals, such as Linux") from error

    made = {}
    for name, device in names.items():
        if device is not None and not device.strip():
            allowed = "name a serial port, or leave the option out for a pseudo-terminal"
            raise typer.BadParameter(f"the name is empty: {allowed}", param_hint=f"--{name}")
        speed = baud if name == "scanner" else nmea_baud
        try:
            port: Port = TerminalPort() if device is None else SerialPort(device, speed)
        except PortError as error:
            raise typer.BadParameter(f"--{name}: {error}") from error
        closing.callback(port.close)
        made[name] = Channel(name, port, speed)
    return made


def _run(wishes: _Wishes, channels: dict[str, Channel], ending: ExitStack) -> dict[str, Any]:
    """Run and return the numbers of the run; from the first port's name on until `ending` closes, signals end the run
    only."""
    from raychan.hil.instruments import ScannedShip
    from raychan.hil.lms import STREAM, check_sendable
    from raychan.hil.session import Session
    from raychan.hil.summary import summary
    from raychan.run.ship.scene import read_ship_scene

    loaded = read_ship_scene(wishes.scene, wishes.changes)
    show.warn(loaded.warnings + check_sendable(loaded.scanner))
    with show.progress(kernels="ship"):
        session = Session(ScannedShip(loaded), channels, wishes.origin, wishes.rate)
    if wishes.stream:
        session.scanner.mode = STREAM
    stopped = ending.enter_context(_stops())
    # Threads that are started while this one goes first do so too: none waits for the interpreter behind others.
    with _first(wishes.realtime) as session.first, track(wishes.out) as session.tell:
        names = {name: channel.port.name for name, channel in channels.items()}
        _say(json.dumps(names) if wishes.ports else "  ".join(f"{name} {port}" for name, port in names.items()))
        session.run(float("inf") if wishes.duration is None else wishes.duration, stopped)
    return summary(session)


def _say(text: str) -> None:
    """Print a line at once. A program that read the ports' names and closed the pipe does not end the run."""
    with suppress(BrokenPipeError):
        print(text, flush=True)


@contextmanager
def _first(wanted: bool) -> Iterator[bool]:
    """Yield whether this thread runs before ordinary ones, as long as this lasts."""
    from raychan.hil.pacing import run_first

    try:
        yield wanted and run_first()
    finally:
        if wanted:
            run_first(False)


@contextmanager
def _stops() -> Iterator[Callable[[], bool]]:
    """Yield whether a signal to end has come; they end the run, not the process."""
    asked: list[int] = []
    heard = [n for n in ENDS if n in _ALWAYS or signal.getsignal(n) is not signal.SIG_IGN]
    before = {number: signal.signal(number, lambda n, frame: asked.append(n)) for number in heard}
    try:
        yield lambda: bool(asked)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
