"""Plane curves of arcs and lines, given by radii and turns of the normal: positions and normals are exact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from raychan.world.errors import SceneError
from raychan.world.meshes.mesh import Floats

_MOST = 1000  # chords of an arc: a sphere with as many has a million facets


@dataclass(frozen=True)
class Curve:
    """Points (n, 2) and outward unit normals (n, 2); the curve runs counter-clockwise, its left is inside.

    A point that comes twice in a row with different normals is a crease.
    """

    points: Floats
    normals: Floats

    def shifted(self, x: float, y: float) -> Curve:
        """Return the curve moved by (x, y)."""
        return Curve(self.points + np.array([x, y]), self.normals)


def steps(radius: float, angle: float, sag: float) -> int:
    """Return the number of chords of an arc that stay within `sag` [m] of it."""
    if radius <= 0.0 or angle == 0.0:
        return 1
    half = np.arccos(max(1.0 - sag / radius, np.cos(np.pi / 12)))
    if abs(angle) > 2.0 * half * _MOST:
        problem = f"an arc of radius {radius:g} m would need more than {_MOST} chords to keep to {sag:g} m"
        raise SceneError(problem, key="max_sag", value=sag, allowed="a larger max_sag, or a smaller body")
    return max(1, int(np.ceil(abs(angle) / (2.0 * half) - 1e-9)))


def arcs(elements: list[tuple[float, float]], start: float, sag: float) -> Curve:
    """Return the curve of successive elements, from the origin.

    Args: elements (radius [m], turn [rad]) for arcs, (0, turn) for creases, (inf, length [m]) for lines;
    start angle [rad] of the first outward normal; sag [m].
    """
    at, angle = np.zeros(2), start
    points, normals = [at], [_direction(angle)]
    for radius, amount in elements:
        if np.isinf(radius):
            if amount > 0.0:
                at = at + amount * _tangent(angle)
                points.append(at)
                normals.append(_direction(angle))
        elif radius == 0.0:
            angle += amount
            points.append(at)
            normals.append(_direction(angle))
        else:
            centre = at - radius * _direction(angle)
            for a in np.linspace(angle, angle + amount, steps(radius, amount, sag) + 1)[1:]:
                points.append(centre + radius * _direction(a))
                normals.append(_direction(a))
            at, angle = points[-1], angle + amount
    return Curve(np.array(points), np.array(normals))


def _direction(angle: float) -> Floats:
    return np.array([np.cos(angle), np.sin(angle)])


def _tangent(angle: float) -> Floats:
    return np.array([-np.sin(angle), np.cos(angle)])


@dataclass(frozen=True)
class End:
    """One end of an outline: radii [m] of its face and its corners, turn [rad] of the side up to its widest point."""

    face: float
    corner: float
    turn: float = np.radians(2.0)

    def reach(self, half: float, side: float) -> tuple[float, float]:
        """Return the turn [rad] of half the face, and the length [m] of face and corner along the axis."""
        room = half - self.corner * np.cos(self.turn) - side * (1.0 - np.cos(self.turn))
        alpha = np.arcsin(np.clip(room / (self.face - self.corner), 0.0, np.cos(self.turn)))
        along = self.face * (1.0 - np.cos(alpha)) + self.corner * (np.cos(alpha) - np.sin(self.turn))
        return float(alpha), float(along)


def half_outline(length: float, width: float, rear: End, front: End, sag: float) -> Curve:
    """Return the right half (y <= 0) of a convex outline, from the rear's middle to the front's, x in 0..length.

    Bowed face, round corner, bowed side, corner, face; length and width are met exactly. Raises: ValueError where the
    corners do not fit.
    """
    half = 0.5 * width

    def excess(side: float) -> float:
        ends = rear.reach(half, side)[1] + front.reach(half, side)[1]
        return ends + side * (np.sin(rear.turn) + np.sin(front.turn)) - length

    if rear.turn + front.turn > 0.0:
        top = min((half - e.corner * np.cos(e.turn)) / (1.0 - np.cos(e.turn)) for e in (rear, front) if e.turn > 0.0)
        if excess(1e-3) > 0.0 or excess(top) < 0.0:
            raise ValueError(f"an outline of {length:g} x {width:g} m has no room for these corners")
        side = float(brentq(excess, 1e-3, top, xtol=1e-13))
        middle = [(side, rear.turn), (side, front.turn)]
    else:
        side = 0.0
        middle = [(np.inf, -excess(0.0))]
    a, b = rear.reach(half, side)[0], front.reach(half, side)[0]
    quarter = np.pi / 2.0
    elements = [
        (rear.face, a),
        (rear.corner, quarter - rear.turn - a),
        *middle,
        (front.corner, quarter - front.turn - b),
        (front.face, b),
    ]
    return arcs(elements, np.pi, sag)


def split_at(half: Curve, x: float) -> tuple[Curve, int]:
    """Return the half outline with an added point of its flank at x [m], on the true arc, and the point's index.

    Raises: ValueError where the flank does not reach so far.
    """
    p, n = half.points, half.normals
    flank = np.flatnonzero(np.abs(n[:, 1]) > 0.7)
    if x > p[flank[-1], 0]:
        raise ValueError(f"at {x:.3g} m from the tail, where a door or a window ends, is no flank")
    i = int(flank[np.searchsorted(p[flank, 0], x)])
    turn = float(np.arctan2(n[i - 1, 0] * n[i, 1] - n[i - 1, 1] * n[i, 0], n[i - 1] @ n[i]))
    share = (x - p[i - 1, 0]) / (p[i, 0] - p[i - 1, 0])
    at, normal = p[i - 1] + share * (p[i] - p[i - 1]), n[i]
    if turn > 1e-9:
        radius = float(np.linalg.norm(p[i] - p[i - 1])) / (2.0 * np.sin(0.5 * turn))
        centre = p[i] - radius * n[i]
        along = (x - centre[0]) / radius
        if abs(along) > 1.0:
            raise ValueError(f"at {x:.3g} m from the tail, where a door or a window ends, is no flank")
        normal = np.array([along, -np.sqrt(1.0 - along**2)])
        at = centre + radius * normal
    return Curve(np.insert(p, i, at, axis=0), np.insert(n, i, normal, axis=0)), i


def mirrored(half: Curve) -> Curve:
    """Return the closed curve of a half (y <= 0, from and to the axis) and its reflection.

    Its 2 k + 1 points are the half's k, their reflections in reverse, and the first again.
    """
    flip = np.array([1.0, -1.0])
    points = np.concatenate([half.points, half.points[::-1] * flip, half.points[:1]])
    return Curve(points, np.concatenate([half.normals, half.normals[::-1] * flip, half.normals[:1]]))


def trimmed(half: Curve) -> Curve:
    """Return the half without points on the axis in the middle of a straight end, where a cap's strip has no width."""
    p = half.points
    keep = np.ones(len(p), bool)
    keep[0] = abs(p[1, 0] - p[0, 0]) > 1e-12
    keep[-1] = abs(p[-2, 0] - p[-1, 0]) > 1e-12
    exact = np.where((np.abs(p[:, 1]) < 1e-12)[:, None], p * [1.0, 0.0], p)
    return Curve(exact[keep], half.normals[keep])
