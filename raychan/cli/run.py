"""raychan run: a scene becomes a map, detections, files and pictures."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from raychan.cli import show

if TYPE_CHECKING:
    from raychan.run.result import Result

PICTURES = ("scene.png", "profile.png", "rdmap.png")


def run(
    scene: Annotated[Path, typer.Argument(help="Scene file (TOML).", metavar="SCENE", show_default=False)],
    out: Annotated[
        Path, typer.Option("--out", "-o", help="Directory for the results; made if missing.", metavar="DIR")
    ],
    seed: Annotated[int, typer.Option(help="Seed of the noise; equal seeds give equal detections.", min=0)] = 0,
    tolerance: Annotated[
        float | None,
        typer.Option(help="Error to refine the tubes to [dB]; the scene's own if not given.", metavar="DB", min=1e-3),
    ] = None,
    max_bounces: Annotated[
        int | None, typer.Option(help="Interactions along a path; the scene's own if not given.", metavar="N", min=1)
    ] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option(
            "--set", help="Override a key of the scene file, such as bodies.van.position=[30,3,0].", metavar="KEY=VALUE"
        ),
    ] = None,
    no_pictures: Annotated[bool, typer.Option("--no-pictures", help="Write no pictures.")] = False,
) -> None:
    """Simulate a scene: paths, power-delay profile, I/Q cube, range-Doppler map, detections.

    Writes result.nc (netCDF-4: all of it), detections.csv, summary.json (timings, error reached, what was left out) and
    three pictures. The directory changes only when everything is ready.
    """
    from raychan.run.chain import simulate
    from raychan.run.files import staging
    from raychan.run.store import save_result
    from raychan.world.scene import Scene

    loaded = Scene.load(scene)
    if set_:
        loaded = loaded.override(set_)
    with staging(out) as stage, show.progress() as tell:
        result = simulate(loaded, seed=seed, tolerance_db=tolerance, max_bounces=max_bounces, progress=tell)
        save_result(result, stage)
        warnings = list(result.warnings)
        if not no_pictures:
            warnings += _pictures(result, stage, tell)
    show.warn(warnings)
    screen = show.console()
    screen.print(show.detections(result))
    took = sum(result.timings.values())
    screen.print(f"{len(result.paths.delay)} paths in {took:.1f} s; seed {seed}")
    if not no_pictures:
        screen.print("pictures: " + ", ".join(str(out / name) for name in PICTURES), soft_wrap=True)
    screen.print(f"all of it: {out / 'result.nc'}, detections.csv and summary.json beside it", soft_wrap=True)


def _pictures(result: Result, stage: Path, tell) -> list[str]:  # type: ignore[no-untyped-def]
    from raychan.report.figures import profile_picture, rdmap_picture
    from raychan.view.scene import drawing_of, scene_picture

    tell("pictures", 0.0)
    warnings = scene_picture(drawing_of(result.scene, result), stage / "scene.png")
    tell("pictures", 0.6)
    profile_picture(result, stage / "profile.png")
    rdmap_picture(result, stage / "rdmap.png")
    tell("pictures", 1.0)
    return warnings
