"""raychan run: simulate a scene, or a sequence of its frames, and write maps, detections and pictures."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any

import typer

from raychan.cli import show
from raychan.cli.options import (
    Changes,
    Directory,
    FrameInterval,
    Frames,
    MaxBounces,
    Preview,
    SceneFile,
    Seed,
    Threads,
    Tolerance,
)

if TYPE_CHECKING:
    from raychan.run.result import Result
    from raychan.world.scene import Scene


def run(
    scene: SceneFile = None,  # type: ignore[assignment]
    out: Directory = None,
    seed: Seed = 0,
    tolerance: Tolerance = None,
    max_bounces: MaxBounces = None,
    threads: Threads = None,
    set_: Changes = None,
    preview: Preview = False,
    no_pictures: Annotated[bool, typer.Option("--no-pictures", help="Write no pictures.")] = False,
    frames: Frames = None,
    frame_interval: FrameInterval = None,
) -> None:
    """Simulate a scene: paths, power-delay profile, I/Q cube, range-Doppler map, detections.

    Without SCENE: list the bundled scenes.

    Writes result.nc (netCDF-4: the whole result), detections.csv, summary.json (timings, error reached, unmodelled
    effects) and three pictures. They replace those of an earlier run, all at once at the end; other files in DIR stay.

    With --frames, DIR holds a directory of these files for each frame, frame_0000, frame_0001, ..., written as soon as
    it is ready, and detections.csv of all frames. Frame k draws its noise with seed + k; frame 0 equals a run without
    --frames.
    """
    from raychan.run.rules import check_demand, long_run
    from raychan.world.scene import Scene

    if frame_interval is not None and frames is None:
        raise typer.BadParameter("it needs --frames", param_hint="--frame-interval")
    if scene is None:
        _list()
        return
    if out is None:
        raise typer.BadParameter("missing: name a directory for the results", param_hint="--out")
    if preview and any(one.split("=")[0].strip() == "model.mode" for one in set_ or []):
        raise typer.BadParameter("--set gives model.mode too: leave one of both out", param_hint="--preview")
    loaded = Scene.load(scene).override([*(set_ or []), *(["model.mode=preview"] if preview else [])])
    options = {"seed": seed, "tolerance_db": tolerance, "max_bounces": max_bounces}
    check_demand(loaded)
    show.warn(long_run(loaded, frames or 1))
    if frames is None:
        _single(loaded, out, options, not no_pictures)
    else:
        _sequence(loaded, out, frames, frame_interval, options, not no_pictures)


def _list() -> None:
    """Print the bundled scenes."""
    from raychan.world.scene import Scene
    from raychan.world.scene_files import bundled

    rows = [(name, Scene.load(name).title) for name in bundled.names()]
    screen = show.console()
    screen.print(show.table("Bundled scenes", ("name", ""), rows, left=(0, 1)))
    screen.print("raychan run NAME --out DIR")


def _single(scene: Scene, out: Path, options: dict[str, Any], pictures: bool) -> None:
    from raychan.run.files.output import staging
    from raychan.run.simulate import simulate
    from raychan.run.storage import CONTENTS, write_result

    with staging(out, CONTENTS) as stage, show.progress() as tell:
        result = simulate(scene, **options, progress=tell)
        warnings = list(result.warnings)
        if pictures:
            warnings += _pictures(result, stage, tell, lambda: write_result(result, stage))
        else:
            write_result(result, stage)
    _report(result, out, warnings, pictures)


def _report(result: Result, out: Path, warnings: list[str], pictures: bool) -> None:
    """Print what a run found and which files it wrote."""
    from raychan.run.messages.results import notes as result_notes
    from raychan.run.storage import ARRAY_PICTURES, PICTURES

    notes = result_notes(result)
    show.warn(w for w in warnings if w not in notes)
    screen = show.console()
    for made in show.detections(result):
        screen.print(made)
    for line in notes:
        screen.print(line, soft_wrap=True)
    took = sum(result.timings.values())
    screen.print(f"{len(result.paths.delay)} paths in {took:.1f} s; seed {result.seed}")
    if pictures:
        drawn = [name for name in (*PICTURES, *ARRAY_PICTURES) if (out / name).exists()]
        screen.print("pictures: " + ", ".join(str(out / name) for name in drawn), soft_wrap=True)
    screen.print(f"results: {out / 'result.nc'}, detections.csv and summary.json beside it", soft_wrap=True)


def _sequence(
    scene: Scene, out: Path, count: int, interval: float | None, options: dict[str, Any], pictures: bool
) -> None:
    from raychan.run.files.output import PictureError
    from raychan.run.messages.results import findings, marks
    from raychan.run.sequence import Store, frames, overlap

    show.warn(overlap(scene, count, interval))
    store, told, lost = Store(out), set(), list[PictureError]()
    start = perf_counter()

    def keep() -> str:
        return f"{show.share(store.count, count, 'frames')} in {out}" if store.count else ""

    with show.to_the_end() as say, show.keeping(keep), show.progress() as tell:
        for frame in frames(scene, count, interval, **options, progress=tell):
            drawn: list[str] = []
            try:
                store.add(frame, (lambda r, d: drawn.extend(_pictures(r, d, tell))) if pictures else None)  # noqa: B023
            except PictureError as error:
                # The frame's results are there, and the next ones do not hang on its pictures.
                lost.append(error)
            # A sequence prints each warning once. Lines on detections differ from frame to frame; each frame's own
            # line counts them.
            said = [] if frame.number == 0 else findings(frame.result)
            new = [w for w in dict.fromkeys([*frame.result.warnings, *drawn]) if w not in told and w not in said]
            told.update(new)
            show.warn(new)
            found = len(frame.result.detections.range)
            took = sum(frame.result.timings.values())
            plural = "" if found == 1 else "s"
            marked = marks(frame.result.detections)
            say(f"{frame.name}  {frame.time:9.4f} s  {found:4} detection{plural}{marked}  in {took:.2f} s")
        took = perf_counter() - start
        say(f"{count} frame{'' if count == 1 else 's'} in {took:.1f} s; seeds from {options['seed']}")
        say(f"results: {out / 'frame_0000'} and on; detections of all frames: {out / 'detections.csv'}")
    if lost:
        raise PictureError(f"{show.share(len(lost), count, 'frames')} without pictures: {lost[0]}")


def _pictures(  # type: ignore[no-untyped-def]
    result: Result, stage: Path, tell, first: Callable[[], None] = lambda: None
) -> list[str]:
    """Draw the pictures of a result and return warnings; `first` is called beside the drawing of the scene."""
    from raychan.parallel import run_pair
    from raychan.report.direction_figures import direction_pictures
    from raychan.report.figures import profile_picture, rdmap_picture
    from raychan.run.files.output import PictureError
    from raychan.view.scene import drawing_of, scene_picture

    def drawn() -> list[str] | PictureError:
        try:
            return scene_picture(drawing_of(result.scene, result), stage / "scene.png")
        except PictureError as error:
            return error  # what is written beside it is finished first

    def plots() -> None:
        first()
        profile_picture(result, stage / "profile.png")
        rdmap_picture(result, stage / "rdmap.png")
        direction_pictures(result, stage)
        tell("pictures", 0.4)

    tell("pictures", 0.0)
    # The scene is drawn by a process of its own.
    warnings, _ = run_pair(drawn, plots)
    if isinstance(warnings, PictureError):
        raise warnings
    tell("pictures", 1.0)
    return warnings
