"""raychan ship: a ship under way with a laser scanner, in a closed loop or on logged poses."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from raychan.cli import show
from raychan.cli.options import Directory, ShipChanges, within
from raychan.world import limits

if TYPE_CHECKING:
    from raychan.run.ship.files import ShipLog
    from raychan.run.ship.scene import ShipScene


def ship(
    scene: Annotated[
        Path,
        typer.Argument(
            help="Scene file (TOML), or the name of one that comes along: ship_turn, ship_trial, ship_avoid.",
            metavar="SCENE",
            show_default=False,
        ),
    ] = Path("ship_turn"),
    out: Directory = None,
    seed: Annotated[
        int | None,
        typer.Option(
            help="Seed of all noise, in place of the scene's own.", metavar="N", callback=within(limits.SEED, True)
        ),
    ] = None,
    set_: ShipChanges = None,
    no_pictures: Annotated[bool, typer.Option("--no-pictures", help="Write no pictures.")] = False,
    view: Annotated[bool, typer.Option("--view", help="Show track and echoes in a window at the end.")] = False,
) -> None:
    """Sail a ship: its course, and what a laser scanner on its rolling deck meets.

    Without SCENE: ship_turn, a container ship that turns a full circle and changes course by 90 degrees. ship_trial is
    a yacht on the open sea, ship_avoid one that turns from what its scanner meets.

    Writes ship.csv, scan.nc (netCDF-4: range and body of every beam), summary.json and four pictures: the scans over
    time, the track with what beams met, heading and roll, and all of it in space. They replace those of an earlier
    run, all at once at the end; other files in DIR stay.
    """
    from raychan.run.files.output import staging
    from raychan.run.ship.files import CONTENTS, PICTURES, sail_into
    from raychan.run.ship.scene import read_ship_scene

    if out is None:
        raise typer.BadParameter("missing: name a directory for the results", param_hint="--out")
    if (
        view
        and sys.platform.startswith("linux")
        and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
    ):
        raise typer.BadParameter("there is no display; scene.png holds the picture", param_hint="--view")
    loaded = read_ship_scene(scene, [*(set_ or []), *([] if seed is None else [f"run.seed={seed}"])])
    show.warn(loaded.warnings + loaded.ends_early)
    with staging(out, CONTENTS) as stage, show.progress(kernels="ship") as tell:
        log, found = sail_into(loaded, stage, tell)
        if not no_pictures:
            show.warn(_pictures(loaded, log, stage, tell))
    _tell(found)
    if not no_pictures:
        show.console().print("pictures: " + ", ".join(str(out / name) for name in PICTURES), soft_wrap=True)
    show.console().print(f"results: {out / 'ship.csv'}, scan.nc and summary.json beside it", soft_wrap=True)
    if view:
        from raychan.view.render import window
        from raychan.view.ship_drawing import ship_drawing

        window(ship_drawing(loaded, log))


def _pictures(scene: ShipScene, log: ShipLog, stage: Path, tell: Any) -> list[str]:
    from raychan.report.ship_figures import motion_picture, scan_picture, track_picture
    from raychan.view.scene import scene_picture
    from raychan.view.ship_drawing import ship_drawing

    tell("pictures", 0.0)
    scan_picture(scene, log, stage / "scan.png")
    tell("pictures", 0.3)
    track_picture(scene, log, stage / "track.png")
    motion_picture(scene, log, stage / "motion.png")
    tell("pictures", 0.6)
    warnings = scene_picture(ship_drawing(scene, log), stage / "scene.png")
    tell("pictures", 1.0)
    return warnings


def _tell(found: dict[str, Any]) -> None:
    from raychan.run.ship.files import rounded_heading
    from raychan.run.ship.places import lost_lines

    screen = show.console()
    show.warn(lost_lines(found["lost_in"], found["scans"]))
    rows = [
        (name, f"{count:,}", f"{found['nearest_m'].get(name, float('nan')):.2f}".replace("nan", ""))
        for name, count in found["echoes"].items()
    ]
    if rows:
        screen.print(show.table("Echoes", ("body", "count", "nearest m"), rows))
    roll, end = found["roll_deg"], found["end"]
    scans = f"{found['scans']:,} scans of {found['beams']} beams over {found['duration_s']:.1f} s"
    speed = f"{found['seconds']:.1f} s, {found['real_time_factor']:.0f} times real time"
    screen.print(f"{scans} in {speed}; seed {found['seed']}", soft_wrap=True)
    heading = rounded_heading(end["heading_deg"], ".1f")
    rolled = f"roll {roll['least']:+.1f} to {roll['most']:+.1f} deg"
    screen.print(f"{rolled}; at the end heading {heading} deg", soft_wrap=True)
    if found["log_start_s"] is not None:
        screen.print(f"0 s is the log's {found['log_start_s']:.15g} s", soft_wrap=True)
