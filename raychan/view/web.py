"""A drawing as one self-contained interactive HTML page: turn, zoom, pick a ray."""

from __future__ import annotations

import base64
import json
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.view.drawing import Drawing, Ray

_DASH = 0.008  # length of a dash over the scene's diagonal


def page(drawing: Drawing) -> bytes:
    """Return a drawing as a self-contained page."""
    low, high = drawing.bounds()
    dash = _DASH * float(np.linalg.norm(high - low))
    data = {
        "title": drawing.title,
        "note": drawing.note,
        "radar": drawing.radar.tolist(),
        "observer": drawing.observer,
        "bounds": [low.tolist(), high.tolist()],
        "shapes": [
            {"name": s.name, "colour": s.colour, "opacity": s.opacity, "triangles": _packed(s.triangles)}
            for s in drawing.shapes
        ],
        "rays": [_ray(ray, dash) for ray in drawing.rays],
        "targets": drawing.targets,
    }
    template = (files("raychan.view") / "viewer.html").read_text(encoding="utf-8")
    # '<' is escaped so that no name can end the script element.
    return template.replace("/*DATA*/null", json.dumps(data).replace("<", "\\u003c")).encode()


def _ray(ray: Ray, dash: float) -> dict[str, Any]:
    label = ray.label if ray.converged else f"{ray.label}, not converged"
    pairs = [np.stack([line[:-1], line[1:]], axis=1) for line in ray.strokes(dash)]
    dashes = "" if ray.converged else _packed(np.concatenate(pairs))
    return {"name": ray.name, "power": ray.power, "label": label, "points": _packed(ray.points), "dashes": dashes}


def _packed(values: NDArray[np.float64]) -> str:
    return base64.b64encode(np.ascontiguousarray(values, "<f4").tobytes()).decode("ascii")
