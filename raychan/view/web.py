"""A drawing as one HTML page that needs no network and no library: turn, zoom, pick a ray."""

from __future__ import annotations

import base64
import json
from importlib.resources import files
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from raychan.run.files import write_whole
from raychan.view.drawing import Drawing


def page(drawing: Drawing, path: str | Path) -> Path:
    """Write a drawing as a self-contained page and return its path."""
    data = {
        "title": drawing.title,
        "radar": drawing.radar.tolist(),
        "bounds": [side.tolist() for side in drawing.bounds()],
        "shapes": [
            {"name": s.name, "colour": s.colour, "opacity": s.opacity, "triangles": _packed(s.triangles)}
            for s in drawing.shapes
        ],
        "rays": [
            {"name": r.name, "power": r.power, "label": r.label, "points": _packed(r.points)} for r in drawing.rays
        ],
        "targets": drawing.targets,
    }
    template = (files("raychan.view") / "viewer.html").read_text(encoding="utf-8")
    # '<' is escaped so that no name can end the script element.
    text = template.replace("/*DATA*/null", json.dumps(data).replace("<", "\\u003c"))
    return write_whole(path, text.encode())


def _packed(values: NDArray[np.float64]) -> str:
    return base64.b64encode(np.ascontiguousarray(values, "<f4").tobytes()).decode("ascii")
