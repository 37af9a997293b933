"""The drawing by matplotlib, where there is no OpenGL: positions are right, but surfaces may overlap wrongly."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.report.canvas import collections, drawn_as, figure, style, verbatim
from raychan.view.drawing import Drawing

_DASH = 0.015  # length of a dash over the scene's diagonal
_SMALLEST = 0.006  # side over the scene's diagonal: smaller bodies are marked, with points
_MOST = 6000  # triangles drawn of a shape: matplotlib sorts and paints them one by one (not measured)


def _largest(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the largest triangles: small ones hide little and cost as much."""
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return triangles[np.argsort(-np.linalg.norm(cross, axis=1), kind="stable")[:_MOST]]


def picture(drawing: Drawing) -> memoryview:
    """Draw a scene in 3-D by matplotlib and return the bytes of a PNG."""
    solids = collections()
    with style():
        made = figure(9.0, 5.0, layout=None)
        axes: Any = made.add_axes((-0.05, -0.08, 0.98, 1.1), projection="3d", computed_zorder=False)
        low, high = drawing.bounds()
        room = 0.03 * (high - low).max()
        low, high = low - room * np.array([1.0, 1.0, 0.0]), high + room
        low[2] = min(low[2], 0.0)
        for shape in drawing.shapes:
            flat = shape.name == "ground"
            triangles = np.clip(shape.triangles, low, high) if flat else shape.triangles
            triangles = _largest(triangles)
            opacity = 0.5 if flat else 0.8 * shape.opacity
            faces = solids.Poly3DCollection(triangles, facecolors=shape.colour, alpha=opacity, shade=not flat)
            faces.set_zorder(0 if flat else 1)
            axes.add_collection3d(faces)
        if drawing.rays:
            dash = _DASH * float(np.linalg.norm(high - low))
            strokes = [(line, ray.power) for ray in drawing.rays for line in ray.strokes(dash)]
            lines = solids.Line3DCollection([x for x, _ in strokes], cmap="plasma", linewidths=1.4, zorder=2)
            lines.set_array(np.array([power for _, power in strokes]))
            axes.add_collection3d(lines)
            made.colorbar(lines, cax=made.add_axes((0.91, 0.2, 0.015, 0.6)), label="received power [dBm]")
        for place, colour in drawing.specks(_SMALLEST * float(np.linalg.norm(high - low))):
            axes.plot(*np.array(place)[:, None], marker="o", ms=4, color=colour, ls="none", zorder=3)
        axes.plot(*drawing.radar[:, None], marker=">", ms=9, color="#d62728", ls="none", zorder=3)
        axes.text(*drawing.radar, f"  {drawing.observer}", fontsize=8, zorder=4)
        for name, (x, y, z) in drawing.targets:
            axes.text(x, y, z + 0.3, verbatim(name), fontsize=8, ha="center", zorder=4)
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]), xlabel="x [m]", ylabel="y [m]")
        axes.set_box_aspect(high - low, zoom=1.25)
        axes.locator_params(axis="y", nbins=4)
        axes.locator_params(axis="z", nbins=3)
        axes.view_init(elev=28.0, azim=-132.0)
        axes.set_zlabel("z [m]")
        made.suptitle(verbatim(drawing.title))
        made.text(0.02, 0.93, drawing.note, fontsize=8)
        return drawn_as(made, ".png")
