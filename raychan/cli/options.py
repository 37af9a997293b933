"""Options that several commands share, and the format of their help."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from raychan.world import limits
from raychan.world.limits import Limit


def within(limit: Limit, whole: bool = False) -> Callable[[Any], Any]:
    """Return the check that an option's number is within a limit; an option that is not given passes."""

    def check(value: Any) -> Any:
        if value is not None and (problem := limit.problem(value, whole)):
            raise typer.BadParameter(problem)
        return value

    return check


def meant(limit: Limit, option: str, value: Any, whole: bool = False) -> None:
    """Raise typer.BadParameter where an option's number is outside its limits."""
    try:
        limit.check(option, value, whole)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None


def directory(text: str) -> Path:
    """Return the path of a directory for results. Raises: typer.BadParameter for an empty name, as of an unset
    variable, and for a file."""
    if not str(text).strip():
        raise typer.BadParameter("the name is empty: name a directory for the results")
    path = Path(text)
    for there in (path, *path.parents):
        if there.is_file():
            inside = "" if there == path else f"{path} cannot be made in it; "
            raise typer.BadParameter(f"{there}: is a file; {inside}name a directory")
    return path


def unread(error: Any) -> str:
    """Return what is wrong with an option whose text is no number, with what is allowed; '' for other errors."""
    reading, option = error.__cause__, getattr(error, "param", None)
    if option is None or not hasattr(reading, "errors"):
        return ""
    given = reading.errors()[0]["input"]
    wanted = "whole number" if reading.errors()[0]["type"].startswith("int") else "number"
    error.message = f"{given!r}: a {wanted} is wanted"
    try:
        if option.callback is not None:
            option.callback(error.ctx, option, given)
    except typer.BadParameter as told:
        error.message = told.message
    return str(error.format_message())


Directory = Annotated[
    Path | None,
    typer.Option("--out", "-o", help="Directory for the results; made if missing.", metavar="DIR", parser=directory),
]

# typer takes [m] for markup and drops it: in help texts units are words.
_SCENE = "Scene file (TOML), or the name of a bundled one, such as urban."
SceneFile = Annotated[Path, typer.Argument(help=_SCENE, metavar="SCENE", show_default=False)]
Seed = Annotated[
    int,
    typer.Option(help="Seed of the noise; equal seeds give equal detections.", callback=within(limits.SEED, True)),
]
Tolerance = Annotated[
    float | None,
    typer.Option(
        help="Error in dB to which tubes are refined; if not given, the scene's own.",
        metavar="DB",
        callback=within(limits.TOLERANCE_DB),
    ),
]
MaxBounces = Annotated[
    int | None,
    typer.Option(
        help="Most interactions along a path; if not given, the scene's own.",
        metavar="N",
        callback=within(limits.BOUNCES, True),
    ),
]


def _use_threads(number: int | None) -> int | None:
    """Set how many threads work, where the option is given."""
    from raychan.parallel import MOST, set_threads

    if number is not None:
        if not isinstance(number, int):  # a text that is no number, see `unread`
            raise typer.BadParameter(f"{number!r}: a whole number is wanted, 1 to {MOST}")
        try:
            set_threads(number)
        except ValueError as error:
            raise typer.BadParameter(str(error)) from None
    return number


Threads = Annotated[
    int | None,
    typer.Option(
        help="Threads that work at most; if not given, RAYCHAN_THREADS, else one for each core. Results do not depend "
        "on it.",
        metavar="N",
        callback=_use_threads,
    ),
]
Changes = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        help="Override a key of the scene file, such as bodies.van.position=[30,3,0]; may be repeated.",
        metavar="KEY=VALUE",
    ),
]

Preview = Annotated[
    bool,
    typer.Option(
        "--preview",
        help="A fast, coarse picture without bounces from body to body, the same as --set model.mode=preview.",
    ),
]
Frames = Annotated[
    int | None,
    typer.Option(
        help="Simulate a sequence of N frames; poses advance by velocities and turn rates.",
        metavar="N",
        callback=within(limits.FRAMES, True),
    ),
]
FrameInterval = Annotated[
    float | None,
    typer.Option(
        help="Seconds from frame to frame; if not given, frames follow without a pause.",
        metavar="S",
        callback=within(limits.INTERVAL),
    ),
]

_SHIP = "A ship's scene file (TOML), or the name of a bundled one, such as ship_avoid."
ShipSceneFile = Annotated[Path, typer.Argument(help=_SHIP, metavar="SCENE", show_default=False)]
ShipChanges = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        help="Override a key of the scene file, such as ship.speed_mps=8; may be repeated.",
        metavar="KEY=VALUE",
    ),
]


def help_of(command: Callable[..., None]) -> str:
    """Return a command's docstring with one line a paragraph: typer would keep the line ends of the source."""
    return "\n\n".join(" ".join(paragraph.split()) for paragraph in (command.__doc__ or "").split("\n\n"))
