"""raychan rcs: radar cross-section of a mesh or a built-in shape against angle, with its error."""

from __future__ import annotations

import os
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from raychan.cli import show
from raychan.cli.options import meant, within
from raychan.world import limits

if TYPE_CHECKING:
    from collections.abc import Callable

    from raychan.run.rcs import Rcs
    from raychan.world.mesh import Mesh

_MOST_ANGLES = 1_000_000
_CHUNKS = 50


def rcs(
    source: Annotated[
        list[str] | None,
        typer.Argument(
            help="Mesh file (GLB, OBJ, PLY, STL); with --shape its parameters, such as radius=0.3.",
            metavar="MESH | KEY=VALUE...",
            show_default=False,
        ),
    ] = None,
    shape: Annotated[
        str | None, typer.Option(help="Built-in shape instead of a mesh: plate, sphere, trihedral, car...")
    ] = None,
    frequency_ghz: Annotated[
        float, typer.Option(help="Frequency in GHz.", metavar="GHZ", callback=within(limits.CARRIER_GHZ))
    ] = 77.0,
    azimuth: Annotated[
        str,
        typer.Option(help="Azimuth in degrees from target to radar: one, or first:last:step.", metavar="A[:B:STEP]"),
    ] = "0",
    elevation: Annotated[str, typer.Option(help="Elevation in degrees, likewise.", metavar="A[:B:STEP]")] = "0",
    polarization: Annotated[str, typer.Option(help="Receive then transmit: VV, VH, HV or HH.")] = "VV",
    distance: Annotated[
        str, typer.Option(help="Radar's distance from the target's origin in metres, or inf.", metavar="M")
    ] = "inf",
    material: Annotated[str, typer.Option(help="What all of it is made of, such as pec or glass.")] = "pec",
    tolerance: Annotated[
        float, typer.Option(help="Error in dB to refine to.", metavar="DB", callback=within(limits.TOLERANCE_DB))
    ] = 0.25,
    max_bounces: Annotated[
        int, typer.Option(help="Bounces along a path.", metavar="N", callback=within(limits.BOUNCES, True))
    ] = 3,
    unit: Annotated[str, typer.Option(help="Unit of the mesh file: m, cm, mm, inch, ft.")] = "m",
    up: Annotated[
        str | None, typer.Option(help="The file's axis that points up; y for GLB and z else if not given.")
    ] = None,
    scale: Annotated[
        float, typer.Option(help="Further factor on the mesh's size.", callback=within(limits.SCALE))
    ] = 1.0,
    crease: Annotated[
        float | None,
        typer.Option(
            help="Folds of the mesh under this angle are smooth; 20 if not given.",
            metavar="DEG",
            callback=within(limits.CREASE),
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Write a table to this file.", metavar="FILE.csv")
    ] = None,
    plot: Annotated[Path | None, typer.Option(help="Draw RCS against angle to this file.", metavar="FILE.png")] = None,
    polar: Annotated[bool, typer.Option("--polar", help="Draw the angle round a circle.")] = False,
) -> None:
    """Compute the radar cross-section of a mesh or a built-in shape against angle, and how wrong it may be.

    Angles point from the target to the radar in the target's frame (x forward, y left, z up).
    """
    import numpy as np

    for file, endings in ((out, (".csv",)), (plot, (".png", ".pdf", ".svg"))):
        _writable(file, endings)
    az, el = angles(azimuth, "--azimuth"), angles(elevation, "--elevation")
    if len(az) * len(el) > _MOST_ANGLES:
        raise typer.BadParameter(f"{len(az) * len(el)} angles wanted; at most {_MOST_ANGLES} can be")
    if polar:
        _can_be_polar(plot, len(az), len(el))
    if shape is not None and (unit != "m" or up is not None or scale != 1.0):
        raise typer.BadParameter("--unit, --up and --scale are for mesh files: a built-in shape is in metres, z up")
    if shape is not None and crease is not None:
        raise typer.BadParameter("--crease is for mesh files: a built-in shape knows which of its folds are edges")
    mesh, name = _target(source or [], shape, unit, up, scale, crease)
    grid = np.meshgrid(az, el)
    try:
        far = float(distance)
    except ValueError:
        raise typer.BadParameter(f"--distance: '{distance}' is not a number of metres, nor inf") from None
    if not np.isinf(far):
        meant(limits.LENGTH, "--distance", far)
    settings: dict[str, Any] = {
        "polarization": polarization,
        "distance": far,
        "material": material,
        "tolerance_db": tolerance,
        "max_bounces": max_bounces,
    }
    with show.progress(kernels="rcs") as tell:
        found = _sweep(mesh, frequency_ghz * 1e9, grid[0].ravel(), grid[1].ravel(), settings, tell)
    rows = _rows(grid[0].ravel(), grid[1].ravel(), found)
    title = f"{name}, {frequency_ghz:g} GHz, {polarization.upper()}, " + (
        "far field" if np.isinf(far) else f"radar at {far:g} m"
    )
    files: dict[Path, bytes | memoryview] = {}
    if out is not None:
        files[out] = _csv(rows).encode()
    if plot is not None:
        from raychan.report.rcs_figure import rcs_picture

        dbsm = np.array([r[3] for r in rows]).reshape(grid[0].shape)
        error = found.error_db.reshape(grid[0].shape)
        files[plot] = rcs_picture(az, el, dbsm, error, title, plot.suffix, polar)
    from raychan.run.output_files import write_together

    write_together(files)
    screen = show.console()
    screen.print(_table(title, rows))
    if shape is None and source:
        from raychan.world.mesh_io import oddities

        show.warn([*mesh.report.warnings(), *oddities(mesh, source[0], unit, up, "--")])
    _bounces(found, max_bounces, tolerance)
    _warn(mesh, found, tolerance)
    if files:
        screen.print("written: " + ", ".join(str(f) for f in files), soft_wrap=True)


def angles(text: str, option: str) -> Any:
    """Return the angles (n,) [deg] that 'A' or 'A:B:STEP' stands for, B included. Raises: typer.BadParameter."""
    import numpy as np

    try:
        numbers = [float(part) for part in text.split(":")]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 3) or not np.isfinite(numbers).all():
        raise typer.BadParameter(f"{option}: '{text}' is neither a number of degrees nor first:last:step, as -30:30:1")
    for number in numbers:
        meant(limits.ANGLE, option, number)
    if len(numbers) == 1:
        return np.array(numbers)
    first, last, step = numbers
    if step == 0.0 or (last - first) * step < 0.0:
        raise typer.BadParameter(f"{option}: '{text}' never ends: the step must lead from the first angle to the last")
    count = (last - first) / step
    if count > _MOST_ANGLES:
        raise typer.BadParameter(f"{option}: '{text}' asks for {count:.3g} angles; at most {_MOST_ANGLES} can be")
    return first + step * np.arange(int(count + 1e-9) + 1)


def _writable(file: Path | None, endings: tuple[str, ...]) -> None:
    if file is None:
        return
    if file.suffix.lower() not in endings:
        raise typer.BadParameter(f"{file}: must end in {' or '.join(endings)}")
    if not file.parent.is_dir():
        raise typer.BadParameter(f"{file}: there is no directory {file.parent}")
    if not os.access(file.parent, os.W_OK):
        raise typer.BadParameter(f"{file}: the directory {file.parent} cannot be written to")


def _can_be_polar(plot: Path | None, azimuths: int, elevations: int) -> None:
    from raychan.report.rcs_figure import MOST_CUTS

    if plot is None:
        raise typer.BadParameter("it needs --plot", param_hint="--polar")
    if azimuths > 1 and elevations > MOST_CUTS:
        raise typer.BadParameter(f"{elevations} cuts wanted; at most {MOST_CUTS} can be", param_hint="--polar")


def _target(
    source: list[str], shape: str | None, unit: str, up: str | None, scale: float, crease: float | None
) -> tuple[Mesh, str]:
    """Return the mesh of a file, or of a built-in shape with its parameters, and what to call it."""
    if shape is None:
        from raychan.world.mesh import CREASE_DEG
        from raychan.world.mesh_io import load

        if len(source) != 1:
            raise typer.BadParameter("one mesh file is wanted, or --shape NAME with its parameters")
        angle = CREASE_DEG if crease is None else crease
        return load(source[0], unit=unit, up=up, scale=scale, crease_deg=angle), Path(source[0]).name
    from raychan.world.shapes import build

    return build(shape, dict(_parameter(text) for text in source)), " ".join([shape, *source])


def _parameter(text: str) -> tuple[str, Any]:
    key, sign, value = text.partition("=")
    if not sign:
        raise typer.BadParameter(f"'{text}' is no parameter of a shape; write KEY=VALUE, as radius=0.3")
    if value.lower() in ("true", "false"):
        return key, value.lower() == "true"
    try:
        return key, float(value)
    except ValueError:
        return key, value


def _sweep(mesh: Mesh, frequency: float, az: Any, el: Any, settings: dict[str, Any], tell: Callable[..., None]) -> Rcs:
    """Return the RCS at all angles, a chunk at a time so that progress can be told."""
    import numpy as np

    from raychan.run.rcs import Rcs
    from raychan.run.rcs import rcs as compute

    parts: list[Rcs] = []
    done = 0
    tell("rcs", 0.0)
    for rows in np.array_split(np.arange(len(az)), min(_CHUNKS, len(az))):
        try:
            parts.append(compute(mesh, frequency, az[rows], el[rows], **settings))
        except ValueError as error:
            from raychan.world.errors import SceneError

            if isinstance(error, SceneError):
                raise
            raise typer.BadParameter(str(error)) from error
        done += len(rows)
        tell("rcs", done / len(az))
    return Rcs(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Rcs)))


def _rows(az: Any, el: Any, found: Rcs) -> list[tuple[float, float, float, float, float, int, int, bool]]:
    import numpy as np

    with np.errstate(divide="ignore"):
        dbsm = 10.0 * np.log10(found.sigma)
    columns = (az, el, found.sigma, dbsm, found.error_db, found.rays, found.bounces, found.converged)
    return list(zip(*(c.tolist() for c in columns), strict=True))


def _csv(rows: list[Any]) -> str:
    head = "azimuth_deg,elevation_deg,sigma_m2,rcs_dbsm,error_db,rays,bounces,converged"
    lines = [
        f"{a:.10g},{e:.10g},{s:.8g},{d:.6g},{f'{x:.4g}' if c else ''},{r},{b},{str(c).lower()}"
        for a, e, s, d, x, r, b, c in rows
    ]
    return "\n".join([head, *lines, ""])


def _table(title: str, rows: list[Any]) -> Any:
    cells = [
        (f"{a:g}", f"{e:g}", f"{d:.2f}" if s else "no return", f"{x:.3f}" if c else "unknown", f"{r}", f"{b}")
        for a, e, s, d, x, r, b, c in rows
    ]
    heads = ("azimuth deg", "elevation deg", "RCS dBsm", "error dB", "rays", "bounces")
    return show.table(title, heads, cells, left=())


def _bounces(found: Rcs, most: int, tolerance: float) -> None:
    """Tell in a line what bounces beyond the last allowed one may change, where that matters: no error holds it."""
    import numpy as np

    beyond = f"what further bounces bring is not in the error (--max-bounces, now {most})"
    if most == 1:
        if np.isnan(found.further_db[found.sigma > 0.0]).any():
            show.warn([f"the body is not convex: {beyond}"])
        return
    last = int((found.further_db > tolerance).sum())
    if last:
        change = float(np.nanmax(found.further_db))
        told = f"one that brings as much as the last allowed one changes up to {change:.2g} dB"
        show.warn([f"at {last} of {found.bounces.size} angles {beyond}: {told}"])


def _warn(mesh: Mesh, found: Rcs, tolerance: float) -> None:
    """Tell in a line each how the mesh was read, if it may mean something else, and what missed the tolerance."""
    from raychan.world.creases import folds_told

    said = [text for text in [folds_told(mesh, "--crease")] if text]
    known, count = found.converged, found.error_db.size
    over = int((found.error_db > tolerance).sum())
    if over:
        worst = float(found.error_db[known].max())
        said.append(
            f"{over} of {count} angles miss the tolerance of {tolerance:g} dB; largest stated error: {worst:.2f} dB"
        )
    nothing = found.sigma == 0.0
    if nothing.any():
        said.append(f"{int(nothing.sum())} of {count} angles return nothing in physical optics: their error is unknown")
    if lost := int((~known & ~nothing).sum()):
        said.append(f"{lost} of {count} angles did not converge: their error is unknown")
    show.warn(said)
