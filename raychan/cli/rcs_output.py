"""What `raychan rcs` prints and writes: table, CSV and remarks on the result."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from raychan.cli import show

if TYPE_CHECKING:
    from rich.table import Table

    from raychan.run.rcs import Rcs
    from raychan.world.meshes.mesh import Mesh

Row = tuple[float, float, float, float, float, float, int, int, bool, float, float]
"""Azimuth [deg], elevation [deg], RCS [m^2], RCS [dBsm], error [dB], its numerical part [dB], rays,
bounces, converged, changes [dB] by a further bounce and by fringe fields of edges."""


def rows(az: Any, el: Any, found: Rcs) -> list[Row]:
    """Return a row for each angle."""
    import numpy as np

    with np.errstate(divide="ignore"):
        dbsm = 10.0 * np.log10(found.sigma)
    levels = (az, el, found.sigma, dbsm, found.error_db, found.numerical_db)
    beyond = found.further_db, found.edges_db
    columns = [c.tolist() for c in (*levels, found.rays, found.bounces, found.converged, *beyond)]
    return list(zip(*columns, strict=True))


def csv_text(rows: list[Row]) -> str:
    """Return the rows as the text of a CSV file."""
    head = "azimuth_deg,elevation_deg,sigma_m2,rcs_dbsm,error_db,numerical_db,rays,bounces,converged"
    lines = [
        f"{a:.10g},{e:.10g},{s:.8g},{d:.6g},{_known(x, '.4g', '')},{_known(n, '.4g', '')},{r},{b},{str(c).lower()},"
        f"{_known(f, '.4g', '')},{_known(g, '.4g', '')}"
        for a, e, s, d, x, n, r, b, c, f, g in rows
    ]
    return "\n".join([head + ",further_db,edges_db", *lines, ""])


def table_of(title: str, rows: list[Row]) -> Table:
    """Return the rows as a table for the terminal."""
    cells = [
        (
            *(f"{a:g}", f"{e:g}", f"{d:.2f}" if s else "no return"),
            *(_known(x, ".3f", "unknown"), _known(n, ".3f", "unknown"), f"{r}", f"{b}"),
        )
        for a, e, s, d, x, n, r, b, *_ in rows
    ]
    heads = ("azimuth deg", "elevation deg", "RCS dBsm", "error dB", "numerical dB", "rays", "bounces")
    return show.table(title, heads, cells, left=())


def further_bounces(found: Rcs, most: int, tolerance: float) -> list[str]:
    """Return a line on the change by bounces beyond the last allowed one, where it may exceed the tolerance."""
    import numpy as np

    beyond = f"the error does not include further bounces (--max-bounces, now {most})"
    if most == 1:
        if np.isnan(found.further_db[found.sigma > 0.0]).any():
            return [f"the body is not convex: {beyond}"]
        return []
    last = int((found.further_db > tolerance).sum())
    if not last:
        return []
    change = float(np.nanmax(found.further_db))
    estimate = f"one more changes up to {change:.2g} dB, by estimate"
    return [f"at {last} of {found.bounces.size} angles {beyond}: {estimate}"]


def edge_fields(found: Rcs, tolerance: float) -> list[str]:
    """Return a line on fringe fields of edges, where they may change levels by more than the tolerance."""
    import numpy as np

    some = found.sigma > 0.0
    lost = int((np.isnan(found.edges_db) & some).sum())
    over = int((found.edges_db > tolerance).sum()) + lost
    if not over:
        return []
    most = f"at {lost} of them by as much as it is" if lost else f"by up to {np.nanmax(found.edges_db):.2g} dB"
    return [
        f"at {over} of {found.sigma.size} angles the error does not include fringe fields of edges, which physical "
        f"optics leaves out: they may change the level {most}, by estimate"
    ]


def near_ends(found: Rcs, frequency: float) -> list[str]:
    """Return a line where an end stands within a wavelength of the body, at a frequency [Hz]."""
    from raychan.units import C0

    near = int(found.too_near.sum())
    if not near:
        return []
    return [
        f"at {near} of {found.sigma.size} angles the radar is within a wavelength ({1e3 * C0 / frequency:.2g} mm) of "
        "the body: levels leave out near fields, and err beyond what is stated"
    ]


def beyond_budget(found: Rcs, most: int) -> list[str]:
    """Return a line where angles took more than twice the rays they may."""
    over, took = int((found.rays > 2 * most).sum()), int(found.rays.max(initial=0))
    if not over:
        return []
    return [
        f"{over} of {found.rays.size} angles took more rays than --max-rays ({most:,}), up to {took:,}: the whole body "
        "is launched twice whatever it costs, for an error to state"
    ]


def _known(number: float, form: str, unknown: str) -> str:
    return format(number, form) if math.isfinite(number) else unknown


def uncertainties(mesh: Mesh, found: Rcs, tolerance: float, sure: bool) -> list[str]:
    """Return a line each on folds of the mesh that may be edges, unless these are sure, and on angles that missed the
    tolerance."""
    import numpy as np

    from raychan.world.meshes.creases import uncertain_folds

    lines = [text for text in ["" if sure else uncertain_folds(mesh, "--crease")] if text]
    known, count = found.converged, found.error_db.size
    over = int((found.error_db > tolerance).sum())
    if over:
        worst = float(found.error_db[known].max())
        lines.append(
            f"{over} of {count} angles miss the tolerance of {tolerance:g} dB; largest stated error: {worst:.2f} dB"
        )
    nothing = found.sigma == 0.0
    if nothing.any():
        lines.append(
            f"{int(nothing.sum())} of {count} angles return nothing in physical optics, or less than rounding leaves "
            "of the returns of single faces: their error is unknown"
        )
    if lost := int((np.isnan(found.numerical_db) & ~nothing).sum()):
        lines.append(
            f"{lost} of {count} angles did not converge: their error is unknown; more rays (--max-rays) may help"
        )
    if open_ := int((~known & np.isfinite(found.numerical_db)).sum()):
        lines.append(
            f"{open_} of {count} angles are converged, but their level is open: other surfaces that the mesh may stand "
            "for, or waves that creep around the body, may change it by more than it is"
        )
    return lines
