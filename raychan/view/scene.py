"""The picture of a scene and its rays: by pyvista where OpenGL works, by matplotlib where it does not."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from raychan.run.explain import CellExplanation
from raychan.run.files.output import write_picture
from raychan.run.result import Result
from raychan.view import plain
from raychan.view.drawing import Drawing, draw

_PATIENCE_S = 180.0  # for one picture; a driver that hangs is given up then (not measured)
_PNG_END = b"IEND\xaeB`\x82"  # missing where the disk was full


def drawing_of(scene: Any, result: Result | None = None, cell: CellExplanation | None = None) -> Drawing:
    """Return the drawing of a scene, with the rays of its result if given, or with those of one cell of its map: then
    as it stood when they were traced."""
    time = 0.0 if result is None else result.traced_at
    radar, title = scene.radar_at(time), scene.title
    if cell is not None:
        where = f"{cell.range:.2f} m, {cell.speed:+.2f} m/s, {cell.label}"
        where += f", folded from {cell.true_range:.2f} m" if cell.folded else ""
        where += "" if cell.converged else ", not converged"
        title = f"{title}: {where}" if title else where
    return draw(title, scene.facets(time), scene.points(time), radar.position, radar.boresight, result, cell)


def scene_picture(drawing: Drawing, path: str | Path) -> list[str]:
    """Draw into a PNG and return warnings: none, or the reason why matplotlib drew it."""
    content, warnings = drawn_scene(drawing)
    write_picture(path, content)
    return warnings


def drawn_scene(drawing: Drawing) -> tuple[bytes | memoryview, list[str]]:
    """Return the bytes of a PNG, and warnings: none, or the reason why matplotlib drew it.

    pyvista runs in a process of its own, so that a driver that crashes or hangs is only a warning.
    """
    content, trouble = _rendered(drawing)
    if trouble is None:
        return content, []
    return plain.picture(drawing), [f"scene picture drawn by matplotlib, as pyvista drew none ({trouble})"]


def _rendered(drawing: Drawing) -> tuple[bytes, str | None]:
    if os.environ.get("RAYCHAN_NO_OPENGL"):
        return b"", "RAYCHAN_NO_OPENGL is set"
    try:
        return _in_own_process(drawing)
    except OSError as error:
        return b"", f"no room for the drawing in {tempfile.gettempdir()}: {error.strerror or error}"


def _in_own_process(drawing: Drawing) -> tuple[bytes, str | None]:
    """Return the rendered PNG, or why there is none."""
    with tempfile.TemporaryDirectory() as room:
        held, made = Path(room) / "drawing.npz", Path(room) / "scene.png"
        drawing.save(held)
        command = [sys.executable, "-m", "raychan.view.render", str(held), str(made)]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=_PATIENCE_S, check=False)
        except subprocess.TimeoutExpired:
            return b"", f"no picture within {_PATIENCE_S:.0f} s"
        if done.returncode < 0:
            return b"", f"the renderer died of signal {-done.returncode}"
        picture = made.read_bytes() if made.is_file() else b""
        if done.returncode or not picture.endswith(_PNG_END):
            lines = done.stderr.strip().splitlines()
            return b"", lines[-1] if lines else f"the renderer ended with code {done.returncode}"
        return picture, None
