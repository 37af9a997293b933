"""raychan view: a scene, or a result with its rays, in a window, a picture or a page."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from raychan.cli import show

if TYPE_CHECKING:
    from raychan.view.drawing import Drawing


def view(
    source: Annotated[
        Path,
        typer.Argument(
            help="Scene file, or a directory that `raychan run` wrote.", metavar="SCENE|DIR", show_default=False
        ),
    ],
    screenshot: Annotated[Path | None, typer.Option(help="Write a picture.", metavar="FILE.png")] = None,
    html: Annotated[
        Path | None, typer.Option(help="Write an interactive page for any browser.", metavar="FILE.html")
    ] = None,
    range: Annotated[
        float | None,
        typer.Option(
            "--range", help="Show only the rays of the detection nearest to this range in metres.", metavar="M"
        ),
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(help="Speed of that detection in m/s; any if not given.", metavar="M/S"),
    ] = None,
    detection: Annotated[
        int | None,
        typer.Option(
            help="Show only the rays of the detection with this number in the list of `raychan run`.", metavar="N"
        ),
    ] = None,
) -> None:
    """Show a scene, and the rays of a result coloured by the power they bring.

    Without --screenshot or --html a window opens, where a click on a ray prints the bodies along it. With --range or
    --detection only the rays of one detection are shown (of the map cell at --range if no detection is near), and
    bodies that they do not meet are transparent. Rays of a detection that is not converged are dashed.
    """
    for option, file, ending in (("--screenshot", screenshot, ".png"), ("--html", html, ".html")):
        if file is not None and file.suffix.lower() != ending:
            raise typer.BadParameter(f"{option} {file}: the name must end in {ending}")
    drawing = _drawing(source, range, speed, detection)
    if screenshot is not None or html is not None:
        _write(drawing, screenshot, html)
    if screenshot is None and html is None:
        if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
            raise typer.BadParameter("there is no display; use --screenshot FILE.png or --html FILE.html")
        from raychan.view.render import window

        window(drawing)


def _write(drawing: Drawing, screenshot: Path | None, html: Path | None) -> None:
    """Write the picture and the page that are asked for, and print their names."""
    from raychan.run.files.output import write_together
    from raychan.view.scene import drawn_scene
    from raychan.view.web import page

    files, warnings = dict[Path, bytes | memoryview](), list[str]()
    if screenshot is not None:
        files[screenshot], warnings = drawn_scene(drawing)
    if html is not None:
        files[html] = page(drawing)
    write_together(files)
    show.warn(warnings)
    for name in files:
        print(name)


def _drawing(source: Path, range: float | None, speed: float | None, detection: int | None) -> Drawing:
    """Return the drawing of a scene file, or of a result and the rays asked for. Raises: typer.BadParameter."""
    from raychan.run.explain import explain
    from raychan.run.files.output import StoreError
    from raychan.run.storage import load_result
    from raychan.view.scene import drawing_of
    from raychan.world.errors import SceneError, is_guess
    from raychan.world.scene import Scene

    if speed is not None and range is None:
        raise typer.BadParameter("it needs --range", param_hint="--speed")
    wanted = range is not None or detection is not None
    if source.is_dir() or source.suffix == ".nc":
        result = load_result(source)
        if result.scene is None:
            why = "a mesh or antenna file has moved, or the scene holds a mesh or an antenna that only Python has"
            raise StoreError(f"{source}: its scene cannot be read again ({why})")
        try:
            cell = explain(result, range, speed, detection=detection) if wanted else None
        except ValueError as error:
            raise typer.BadParameter(str(error)) from error
        if cell is not None and not cell.contributions:
            show.warn([f"no path explains this cell: {cell.bodies}"])
        return drawing_of(result.scene, result, cell)
    if wanted:
        raise typer.BadParameter(f"{source} is a scene; --range and --detection need a directory of `raychan run`")
    try:
        return drawing_of(Scene.load(source))
    except SceneError as error:
        # Another file, such as a mesh, may be what is missing; a name near to that of a scene is proposed alone.
        if error.file != source or source.exists() or is_guess(error.allowed):
            raise
        allowed = f"a directory that `raychan run` wrote, its result.nc, or {error.allowed}"
        raise SceneError("no such file or directory", file=error.file, allowed=allowed) from error
