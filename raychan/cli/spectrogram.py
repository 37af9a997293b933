"""raychan spectrogram: received power against time and range rate, over seconds in which bodies move in themselves."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from raychan.cli import show
from raychan.cli.options import Changes, MaxBounces, SceneFile, Seed, Threads, Tolerance, directory, within
from raychan.world import limits

if TYPE_CHECKING:
    from raychan.run.spectrogram import Spectrogram
    from raychan.world.scene import Scene

_Near = Annotated[
    float | None,
    typer.Option(
        help="Nearest range cell in metres; the first if not given.", metavar="M", callback=within(limits.CELL_RANGE)
    ),
]
_Far = Annotated[
    float | None,
    typer.Option(
        help="Farthest range cell in metres; the last if not given.", metavar="M", callback=within(limits.CELL_RANGE)
    ),
]


def spectrogram(
    scene: SceneFile,
    out: Annotated[
        Path,
        typer.Option(
            "--out", "-o", help="Directory for the results; made if missing.", metavar="DIR", parser=directory
        ),
    ],
    seconds: Annotated[
        float, typer.Option(help="How long the radar listens.", metavar="S", callback=within(limits.SECONDS))
    ] = 2.0,
    resolution: Annotated[
        float,
        typer.Option(
            help="Resolution of the range rate in m/s, which sets how long a stretch is transformed.",
            metavar="M/S",
            callback=within(limits.RATE_STEP),
        ),
    ] = 0.1,
    tracings: Annotated[
        float, typer.Option(help="Tracings of the scene a second.", metavar="N", callback=within(limits.TRACED))
    ] = 50.0,
    near: _Near = None,
    far: _Far = None,
    seed: Seed = 0,
    tolerance: Tolerance = None,
    max_bounces: MaxBounces = None,
    threads: Threads = None,
    set_: Changes = None,
) -> None:
    """Compute a spectrogram of a scene: walkers, cyclists, wheels and rotors show how their parts move.

    The radar's chirps follow each other without a pause. Writes spectrogram.nc (netCDF-4) and spectrogram.png.

    Time goes with seconds and tracings a second: walker_and_cyclist takes about 3 minutes on one thread.
    """
    from raychan.world.scene import Scene

    loaded = Scene.load(scene).override(set_ or [])
    show.warn(loaded.warnings)
    options = {
        "ranges": None if near is None and far is None else (near or 0.0, float("inf") if far is None else far),
        "resolution": resolution,
        "tracings_per_second": tracings,
        "seed": seed,
        "tolerance_db": tolerance,
        "max_bounces": max_bounces,
    }
    found = _computed(loaded, seconds, options)
    files = _written(loaded, out, found)
    show.warn(found.warnings)
    screen = show.console()
    got = f"{found.resolution:.3g} m/s"
    asked = "" if got == f"{resolution:.3g} m/s" else f" ({resolution:g} asked: a stretch has whole chirps)"
    screen.print(
        f"{len(found.time)} stretches of {got}{asked} over {seconds:g} s; {found.tracings} tracings, "
        f"error of carrying on {found.error_db:.1f} dB; seed {found.seed}",
        soft_wrap=True,
    )
    screen.print("written: " + ", ".join(str(f) for f in files), soft_wrap=True)


def _computed(scene: Scene, seconds: float, options: dict[str, Any]) -> Spectrogram:
    """Return the spectrogram. Raises: typer.BadParameter for options that do not fit the radar."""
    from raychan.run.spectrogram import spectrogram as compute
    from raychan.world.errors import SceneError

    try:
        with show.progress() as tell:
            return compute(scene, seconds, **options, progress=tell)
    except SceneError:
        raise
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error


def _written(scene: Scene, out: Path, found: Spectrogram) -> list[Path]:
    from raychan.report.spectrogram_figure import spectrogram_picture
    from raychan.run.files.output import folder_for, write_together
    from raychan.run.files.spectrogram import as_netcdf

    files: dict[Path, bytes | memoryview] = {
        out / "spectrogram.nc": as_netcdf(found, scene.text),
        out / "spectrogram.png": spectrogram_picture(found, scene.title or "Spectrogram"),
    }
    with folder_for(out):
        write_together(files)
    return list(files)
