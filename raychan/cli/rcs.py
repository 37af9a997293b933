"""raychan rcs: radar cross-section of a mesh or a built-in shape against angle, with its error."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from raychan.cli import show
from raychan.cli.options import Threads, within
from raychan.cli.rcs_options import MOST_ANGLES, angles, can_be_polar, metres, writable
from raychan.cli.rcs_output import (
    beyond_budget,
    csv_text,
    edge_fields,
    further_bounces,
    near_ends,
    rows,
    table_of,
    uncertainties,
)
from raychan.run.files.in_place import told
from raychan.scalars import as_text
from raychan.world import limits

if TYPE_CHECKING:
    from collections.abc import Callable

    from raychan.run.rcs import Rcs
    from raychan.world.meshes.mesh import Mesh

_CHUNKS = 50  # parts of the angles, after each of which progress is shown


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
        str | None, typer.Option(help="Built-in shape instead of a mesh: plate, sphere, trihedral, car, ...")
    ] = None,
    frequency_ghz: Annotated[
        float, typer.Option(help="Frequency in GHz.", metavar="GHZ", callback=within(limits.CARRIER_GHZ))
    ] = 77.0,
    azimuth: Annotated[
        str,
        typer.Option(help="Azimuth in degrees, target to radar: one angle, or first:last:step.", metavar="A[:B:STEP]"),
    ] = "0",
    elevation: Annotated[str, typer.Option(help="Elevation in degrees, in the same form.", metavar="A[:B:STEP]")] = "0",
    polarization: Annotated[str, typer.Option(help="Receive then transmit: VV, VH, HV or HH.")] = "VV",
    distance: Annotated[
        str, typer.Option(help="Radar's distance from the target's origin in metres, or inf.", metavar="M")
    ] = "inf",
    material: Annotated[str, typer.Option(help="Material of the whole body, such as pec or glass.")] = "pec",
    tolerance: Annotated[
        float,
        typer.Option(
            help="Error in dB to which tubes are refined.", metavar="DB", callback=within(limits.TOLERANCE_DB)
        ),
    ] = 0.25,
    max_bounces: Annotated[
        int, typer.Option(help="Most bounces along a path.", metavar="N", callback=within(limits.BOUNCES, True))
    ] = 3,
    max_rays: Annotated[
        int,
        typer.Option(
            help="Rays an angle may take, about, to reach the tolerance; two launches are made in any case.",
            metavar="N",
            callback=within(limits.RAYS, True),
        ),
    ] = 1_000_000,
    threads: Threads = None,
    unit: Annotated[str, typer.Option(help="Unit of the mesh file: m, cm, mm, inch, ft.")] = "m",
    up: Annotated[
        str | None, typer.Option(help="Axis of the file that points up; if not given, y for GLB and z for others.")
    ] = None,
    scale: Annotated[
        float, typer.Option(help="Further factor on the mesh's size.", callback=within(limits.SCALE))
    ] = 1.0,
    crease: Annotated[
        float | None,
        typer.Option(
            help="Crease angle in degrees: folds of the mesh below it are smooth, others edges. If not given it is 20, "
            "a guess that the stated error includes.",
            metavar="DEG",
            callback=within(limits.CREASE),
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Write a table to this file.", metavar="FILE.csv")
    ] = None,
    plot: Annotated[Path | None, typer.Option(help="Draw RCS against angle to this file.", metavar="FILE.png")] = None,
    polar: Annotated[bool, typer.Option("--polar", help="Draw the figure in polar coordinates.")] = False,
) -> None:
    """Compute the radar cross-section of a mesh or a built-in shape against angle, with its stated error.

    Angles point from the target to the radar in the target's frame (x forward, y left, z up). After Ctrl-C the table of
    --out has the angles that are done.
    """
    import numpy as np

    for file, endings in ((out, (".csv",)), (plot, (".png", ".pdf", ".svg"))):
        writable(file, endings)
    az, el = angles(azimuth, "--azimuth"), angles(elevation, "--elevation")
    if len(az) * len(el) > MOST_ANGLES:
        raise typer.BadParameter(f"{len(az) * len(el)} angles; at most {MOST_ANGLES} are allowed")
    if polar:
        can_be_polar(plot, len(az), len(el))
    if shape is not None and (unit != "m" or up is not None or scale != 1.0):
        raise typer.BadParameter("--unit, --up and --scale are for mesh files: a built-in shape is in metres, z up")
    if shape is not None and crease is not None:
        raise typer.BadParameter("--crease is for mesh files: a built-in shape defines its edges itself")
    mesh, name = _target(source or [], shape, unit, up, scale, crease)
    grid = np.meshgrid(az, el)
    far = metres(distance, "--distance")
    settings: dict[str, Any] = {
        "polarization": polarization,
        "distance": far,
        "material": material,
        "tolerance_db": tolerance,
        "max_bounces": max_bounces,
        "max_rays": max_rays,
        "crease_deg": crease,
    }
    parts: list[Rcs] = []
    place = "far field" if np.isinf(far) else f"radar at {far:g} m"
    title = f"{name}, {frequency_ghz:g} GHz, {polarization.upper()}, {place}"

    def keep() -> str:
        return told() or _kept(out, plot, grid[0].ravel(), grid[1].ravel(), parts)

    with show.keeping(keep):
        with show.progress(kernels="rcs") as tell:
            _sweep(mesh, frequency_ghz * 1e9, grid[0].ravel(), grid[1].ravel(), settings, tell, parts)
        found = _joined(parts)
        table = rows(grid[0].ravel(), grid[1].ravel(), found)
        try:
            _written(out, plot, (az, el), table, found, title, polar)
        finally:
            # Where it cannot be written, what was computed is on the screen at least.
            show.console().print(table_of(title, table))
        if shape is None and source:
            from raychan.world.mesh_files.mesh_io import oddities

            show.warn([*mesh.report.warnings(), *oddities(mesh, source[0], unit, up, "--")])
        show.warn([f"smooth surfaces: {found.merged}"] if found.merged else [])
        show.warn(further_bounces(found, max_bounces, tolerance))
        show.warn(edge_fields(found, tolerance))
        show.warn(near_ends(found, 1e9 * frequency_ghz))
        show.warn(beyond_budget(found, max_rays))
        show.warn(uncertainties(mesh, found, tolerance, crease is not None))
        if told():
            show.console().print(told(), soft_wrap=True)


def _written(
    out: Path | None, plot: Path | None, angles: tuple[Any, Any], table: list[Any], found: Rcs, title: str, polar: bool
) -> None:
    """Write the table and the figure that are asked for; the table alone where the figure cannot be written.

    Raises: StoreError where either cannot."""
    import numpy as np

    from raychan.run.files.output import PictureError, StoreError, write_together, write_whole

    files: dict[Path, bytes | memoryview] = {}
    if out is not None:
        files[out] = csv_text(table).encode()
    if plot is not None:
        from raychan.report.rcs_figure import rcs_picture

        az, el = angles
        shape = len(el), len(az)
        dbsm = np.array([row[3] for row in table]).reshape(shape)
        files[plot] = rcs_picture(az, el, dbsm, found.error_db.reshape(shape), title, plot.suffix, polar)
    try:
        write_together(files)
    except StoreError as error:
        if len(files) == 1 or out is None:
            raise
        write_whole(out, files[out])
        raise PictureError(f"{error}; the table is in {out}") from error


def _target(
    source: list[str], shape: str | None, unit: str, up: str | None, scale: float, crease: float | None
) -> tuple[Mesh, str]:
    """Return the mesh of a file, or of a built-in shape with its parameters, and what to call it."""
    if shape is None:
        from raychan.world.mesh_files.mesh_io import load
        from raychan.world.meshes.mesh import CREASE_DEG

        if len(source) != 1:
            raise typer.BadParameter("give one mesh file, or --shape NAME with its parameters")
        angle = CREASE_DEG if crease is None else crease
        return load(source[0], unit=unit, up=up, scale=scale, crease_deg=angle), as_text(Path(source[0]).name)
    from raychan.world.shapes import build

    params = dict[str, Any]()
    for key, value in map(_parameter, source):
        if key in params:
            raise typer.BadParameter(f"'{key}' is given twice")
        params[key] = value
    return build(shape, params), " ".join([shape, *source])


def _parameter(text: str) -> tuple[str, Any]:
    """Return the name and value of a shape's parameter written KEY=VALUE."""
    key, sign, value = text.partition("=")
    if not sign:
        raise typer.BadParameter(f"'{text}' is not a parameter of a shape; write KEY=VALUE, such as radius=0.3")
    if value.lower() in ("true", "false"):
        return key, value.lower() == "true"
    try:
        return key, float(value)
    except ValueError:
        return key, value


def _kept(out: Path | None, plot: Path | None, az: Any, el: Any, parts: list[Rcs]) -> str:
    """Write the table of the angles that are done, if one is asked for; return how many these are, '' for none, and
    that a figure which is there is not of them."""
    if out is None or not parts:
        return ""
    from raychan.run.files.output import write_whole

    found = _joined(parts)
    count = found.sigma.size
    write_whole(out, csv_text(rows(az[:count], el[:count], found)).encode())
    earlier = f"; {plot} is of an earlier run" if plot is not None and plot.is_file() else ""
    return f"{show.share(count, len(az), 'angles')} in {out}{earlier}"


def _sweep(
    mesh: Mesh, frequency: float, az: Any, el: Any, settings: dict[str, Any], tell: Callable[..., None],
    parts: list[Rcs],
) -> None:  # fmt: skip
    """Add the RCS at all angles to parts, in chunks so that progress can be shown."""
    import numpy as np

    from raychan.run.rcs import rcs as compute

    done = 0
    tell("rcs", 0.0)
    for some in np.array_split(np.arange(len(az)), min(_CHUNKS, len(az))):
        try:
            parts.append(compute(mesh, frequency, az[some], el[some], **settings))
        except ValueError as error:
            from raychan.world.errors import SceneError

            if isinstance(error, SceneError):
                raise
            raise typer.BadParameter(str(error)) from error
        done += len(some)
        tell("rcs", done / len(az))


def _joined(parts: list[Rcs]) -> Rcs:
    """Return parts of a sweep as one."""
    import numpy as np

    from raychan.run.rcs import Rcs

    columns = {f.name: [getattr(p, f.name) for p in parts] for f in fields(Rcs)}
    merged = columns.pop("merged")[0]
    return Rcs(**{name: np.concatenate(found) for name, found in columns.items()}, merged=merged)
