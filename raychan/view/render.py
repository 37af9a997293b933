"""Drawings by pyvista, which is imported here only. `python -m raychan.view.render DRAWING.npz PICTURE.png` draws in a
process of its own, so that a crash of an OpenGL driver loses the picture and not the run.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

from raychan.report.canvas import font_file, legible
from raychan.view.drawing import Drawing, Ray
from raychan.view.scale import arcs, axes

_SIZE = (2000, 1125)  # pixels
_MAP = "plasma"
_POWER = "received power in dBm"  # VTK draws square brackets round
_DASH = 8.0  # length of a dash, and of the gap after it, in radii of a ray
_LABELS = 5  # of the colour scale
_PAD = 8  # pixels by which labels and title of the colour scale keep off it, or the labels touch it
_OF_FILE = 4  # VTK's number for a font that comes from a file
_SMALLEST = 0.6  # of the radar's size: smaller bodies are drawn as balls of it


def screenshot(drawing: Drawing, path: str | Path) -> None:
    """Render a drawing off screen into a PNG."""
    plotter = _plotter(drawing, off_screen=True)
    plotter.screenshot(str(path))
    plotter.close()


def window(drawing: Drawing) -> None:
    """Show a drawing in a window; a click on a ray prints its bodies and power."""
    plotter = _plotter(drawing, off_screen=False)
    plotter.enable_mesh_picking(_tell, left_clicking=True, show=False, show_message=False)
    plotter.show(title=drawing.title)


def _tell(mesh: Any) -> None:
    if mesh is not None and "what" in mesh.field_data:
        print(bytes(mesh.field_data["what"]).decode())


def _plotter(drawing: Drawing, off_screen: bool) -> Any:
    import pyvista as pv

    plotter: Any = pv.Plotter(off_screen=off_screen, window_size=list(_SIZE), lighting="light kit")
    plotter.set_background("white", top="#dfe8f1")
    for shape in drawing.shapes:
        flat = shape.name == "ground"
        points = shape.triangles.reshape(-1, 3)
        faces = np.column_stack([np.full(len(points) // 3, 3), np.arange(len(points)).reshape(-1, 3)])
        mesh = pv.PolyData(points, faces.ravel())
        plotter.add_mesh(
            mesh, color=shape.colour, opacity=shape.opacity, ambient=0.25 if flat else 0.1, lighting=not flat
        )
    low, high = drawing.bounds()
    scale = max(0.05, 0.011 * float(np.linalg.norm(high - low)))
    for place, colour in drawing.specks(_SMALLEST * scale):
        plotter.add_mesh(pv.Sphere(0.5 * _SMALLEST * scale, place), color=colour)
    _rings(drawing, plotter, pv)
    _rays(drawing, plotter, pv, 0.09 * scale)
    tip = drawing.radar + scale * drawing.boresight
    cone = pv.Cone(center=tip, direction=-drawing.boresight, height=2 * scale, radius=scale, resolution=40)
    plotter.add_mesh(cone, color="#d62728")
    names = [legible(name) for name, _ in drawing.targets] + [drawing.observer]
    places = [(x, y, z + 1.5 * scale) for _, (x, y, z) in drawing.targets]
    places.append((drawing.radar[0], drawing.radar[1], drawing.radar[2] + 2.5 * scale))
    plotter.add_point_labels(
        np.array(places), names, font_size=22, text_color="#1a1a1a", shape_color="white", shape_opacity=0.75,
        show_points=False, always_visible=True, margin=4, font_file=font_file(),
    )  # fmt: skip
    if drawing.caption:
        text = legible(f"{drawing.title}\n{drawing.caption}")
        plotter.add_text(text, position="upper_right", font_size=12, color="#1a1a1a", font_file=font_file())
    _look(plotter, drawing)
    plotter.enable_anti_aliasing("ssaa")
    return plotter


def _rings(drawing: Drawing, plotter: Any, pv: Any) -> None:
    """Draw arcs of equal range as a scale."""
    drawn = arcs(drawing)
    for line in (line for arc in drawn for line in arc.lines):
        plotter.add_mesh(pv.lines_from_points(line), color="#8d8a80", line_width=1.5)
    if drawn:
        plotter.add_point_labels(
            np.array([arc.label for arc in drawn]), [f"{arc.range:.0f} m" for arc in drawn], font_size=18,
            text_color="#6b685f", shape=None, show_points=False, bold=False, always_visible=True, font_file=font_file(),
        )  # fmt: skip


def _rays(drawing: Drawing, plotter: Any, pv: Any, radius: float) -> None:
    if not drawing.rays:
        return
    powers = [ray.power for ray in drawing.rays]
    low, steps = float(np.floor(min(powers))), _LABELS - 1
    # A whole number of dB from label to label, as labels have no decimals.
    limits = [low, low + steps * max(1.0, np.ceil((max(powers) - low) / steps))]
    for ray in drawing.rays:
        plotter.add_mesh(
            _tube(ray, radius, pv), scalars=_POWER, cmap=_MAP, clim=limits, show_scalar_bar=False, lighting=False,
        )  # fmt: skip
    bar = plotter.add_scalar_bar(
        _POWER, vertical=False, position_x=0.03, position_y=0.86, width=0.28, height=0.1, color="#1a1a1a",
        title_font_size=24, label_font_size=22, fmt="%.0f", n_labels=_LABELS,
    )  # fmt: skip
    if drawing.note:
        plotter.add_text(
            drawing.note, position=(0.03, 0.82), viewport=True, font_size=12, color="#1a1a1a", font_file=font_file()
        )
    bar.SetTextPositionToPrecedeScalarBar()  # below it; above it the title sits on the labels
    for text, off in ((bar.GetLabelTextProperty(), _PAD), (bar.GetTitleTextProperty(), 2 * _PAD)):
        text.SetLineOffset(off)
        text.SetFontFamily(_OF_FILE)
        text.SetFontFile(font_file())


def _tube(ray: Ray, radius: float, pv: Any) -> Any:
    tube = pv.merge([pv.lines_from_points(line).tube(radius=radius) for line in ray.strokes(_DASH * radius)])
    tube.field_data["what"] = np.frombuffer(ray.text.encode(), np.uint8)  # pyvista takes texts in ASCII only
    tube[_POWER] = np.full(tube.n_points, ray.power)
    return tube


def _look(plotter: Any, drawing: Drawing) -> None:
    """Look from behind the radar and to its right, down on the scene, close enough to fill the picture."""
    low, high = drawing.bounds()
    focus = 0.5 * (low + high)
    ahead, right = axes(drawing)
    away = -0.75 * ahead + 0.85 * right + 0.62 * np.array([0.0, 0.0, 1.0])
    plotter.camera_position = [focus + 10.0 * away, focus, (0.0, 0.0, 1.0)]
    plotter.reset_camera(bounds=(low[0], high[0], low[1], high[1], low[2], high[2]))
    plotter.camera.zoom(1.36)


if __name__ == "__main__":
    screenshot(Drawing.load(sys.argv[1]), sys.argv[2])
