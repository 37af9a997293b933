"""What `raychan rcs` prints and writes: table, CSV and remarks on the result."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from raychan.cli import show

if TYPE_CHECKING:
    from rich.table import Table

    from raychan.run.rcs import Rcs
    from raychan.world.mesh import Mesh

Row = tuple[float, float, float, float, float, int, int, bool]
"""Azimuth [deg], elevation [deg], RCS [m^2], RCS [dBsm], error [dB], rays, bounces, converged."""


def rows(az: Any, el: Any, found: Rcs) -> list[Row]:
    """Return a row for each angle."""
    import numpy as np

    with np.errstate(divide="ignore"):
        dbsm = 10.0 * np.log10(found.sigma)
    columns = (az, el, found.sigma, dbsm, found.error_db, found.rays, found.bounces, found.converged)
    return list(zip(*(c.tolist() for c in columns), strict=True))


def csv_text(rows: list[Row]) -> str:
    """Return the rows as the text of a CSV file."""
    head = "azimuth_deg,elevation_deg,sigma_m2,rcs_dbsm,error_db,rays,bounces,converged"
    lines = [
        f"{a:.10g},{e:.10g},{s:.8g},{d:.6g},{f'{x:.4g}' if c else ''},{r},{b},{str(c).lower()}"
        for a, e, s, d, x, r, b, c in rows
    ]
    return "\n".join([head, *lines, ""])


def table_of(title: str, rows: list[Row]) -> Table:
    """Return the rows as a table for the terminal."""
    cells = [
        (f"{a:g}", f"{e:g}", f"{d:.2f}" if s else "no return", f"{x:.3f}" if c else "unknown", f"{r}", f"{b}")
        for a, e, s, d, x, r, b, c in rows
    ]
    heads = ("azimuth deg", "elevation deg", "RCS dBsm", "error dB", "rays", "bounces")
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


def uncertainties(mesh: Mesh, found: Rcs, tolerance: float) -> list[str]:
    """Return a line each on folds of the mesh that may be edges, and on angles that missed the tolerance."""
    from raychan.world.creases import uncertain_folds

    lines = [text for text in [uncertain_folds(mesh, "--crease")] if text]
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
            f"{int(nothing.sum())} of {count} angles return nothing in physical optics: their error is unknown"
        )
    if lost := int((~known & ~nothing).sum()):
        lines.append(
            f"{lost} of {count} angles did not converge: their error is unknown; more rays (--max-rays) may help"
        )
    return lines
