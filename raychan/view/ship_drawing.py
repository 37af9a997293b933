"""A ship's voyage in space: bodies, sea, track, ship at the end, and the points that beams met."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.poses import rotation
from raychan.report.ship_figures import colours
from raychan.run.ship.files import COLUMNS, ShipLog
from raychan.run.ship.scene import ShipScene
from raychan.sensors.laser import SEA
from raychan.view.drawing import Drawing, Shape

Floats = NDArray[np.float64]

_WATER = "#a9c7d8"
_HITS = 12_000  # points drawn, each of four triangles
_LENGTHS = {"yacht": 11.0}
_SHIP = 175.0  # length of the other models [m]
_TETRAHEDRON = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])
_FACES = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])


def ship_drawing(scene: ShipScene, log: ShipLog) -> Drawing:
    """Return the drawing of a voyage."""
    x, y, heading, roll = (log.row[:, COLUMNS.index(k)] for k in ("x_m", "y_m", "heading_deg", "roll_deg"))
    facets, shades = scene.bodies.facets(), colours(scene.names)
    shapes, targets = [], []
    for b, name in enumerate(scene.names):
        own = facets.vertices[facets.body == b]
        shapes.append(Shape(name, own, "#b9b2a3"))
        corners = own.reshape(-1, 3)
        middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
        targets.append((name, (float(middle[0]), float(middle[1]), float(corners[:, 2].max()))))
    track = np.column_stack([x, y, np.zeros(len(x))])
    every = np.concatenate([track, log.hits, facets.vertices.reshape(-1, 3)])
    size = float(np.linalg.norm(np.ptp(every[:, :2], axis=0)))
    shapes.append(Shape("track", _ribbon(track, 0.002 * size), "#1a1a1a"))
    thin = max(1, len(log.hits) // _HITS)
    for b in np.unique(log.hit_body):
        points = log.hits[log.hit_body == b][::thin]
        name, mark = ("sea echoes", 0.0015) if b == SEA else (f"echoes of {scene.names[b]}", 0.003)
        shapes.append(Shape(name, _marks(points, mark * size), shades[int(b)]))
    length = _LENGTHS.get(scene.tables.ship.model, _SHIP)
    yaw = float(np.radians(-heading[-1]))
    turn = rotation(yaw, 0.0, float(np.radians(roll[-1])))
    shapes.append(Shape("ship", _hull(length) @ turn.T + track[-1], "#c0392b"))
    low, high = every.min(axis=0) - 0.04 * size, every.max(axis=0) + 0.04 * size
    water = np.array([[low[0], low[1], 0], [high[0], low[1], 0], [high[0], high[1], 0], [low[0], high[1], 0]])
    shapes.insert(0, Shape("ground", water[[[0, 1, 2], [0, 2, 3]]] - [0.0, 0.0, 0.05], _WATER))
    eye = track[-1] + [0.0, 0.0, scene.tables.scanner.position[2]]
    ahead = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    return Drawing(scene.title or "Voyage", tuple(shapes), (), eye, ahead, tuple(targets), observer="ship")


def _ribbon(track: Floats, width: float) -> Floats:
    """Return the triangles (n, 3, 3) of a band along a track (k, 3) on the water."""
    along = np.gradient(track, axis=0)
    long = np.linalg.norm(along, axis=1, keepdims=True)
    along = np.divide(along, long, out=np.zeros_like(along), where=long > 0.0)
    aside = 0.5 * width * np.column_stack([-along[:, 1], along[:, 0], 0.0 * along[:, 0]])
    left, right = track + aside, track - aside
    first = np.stack([left[:-1], right[:-1], right[1:]], axis=1)
    second = np.stack([left[:-1], right[1:], left[1:]], axis=1)
    return np.asarray(np.concatenate([first, second]))


def _marks(points: Floats, size: float) -> Floats:
    """Return small tetrahedra (4 n, 3, 3) at points (n, 3)."""
    corners = points[:, None] + size * _TETRAHEDRON
    return np.asarray(corners[:, _FACES].reshape(-1, 3, 3))


def _hull(length: float) -> Floats:
    """Return the triangles (n, 3, 3) of a plain hull about the origin at the water line, its bow ahead."""
    beam, deck = 0.15 * length, 0.06 * length
    outline = np.array([[0.5, 0.0], [0.3, 0.5], [-0.5, 0.45], [-0.5, -0.45], [0.3, -0.5]]) * [length, beam]
    top = np.column_stack([outline, np.full(5, deck)])
    keel = np.column_stack([0.9 * outline, np.full(5, -0.02 * length)])
    sides = []
    for k in range(5):
        j = (k + 1) % 5
        sides += [[keel[k], keel[j], top[j]], [keel[k], top[j], top[k]], [top[0], top[k], top[j]]]
    return np.array(sides)
