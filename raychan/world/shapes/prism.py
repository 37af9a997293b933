"""Upright bodies from an outline: a closed polygon in plan, not necessarily convex, raised to a height."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from raychan.world.meshes.mesh import Floats, Ints, Mesh
from raychan.world.shapes.piece import Assembly, Piece, join, polygon

_SQUARE = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]
_FLAT = 1e-12  # of the outline's size squared: corners that turn by less are none
_SAME = 1e-9  # of the outline's size: neighbours closer than that are one corner


def prism(outline: Sequence[Sequence[float]] = _SQUARE, height: float = 1.0, material: str = "pec") -> Mesh:
    """Return the closed body on z = 0 whose plan is a polygon.

    Args: outline (n, 2) corners [m] in order, either way round, the last joined to the first (which may be given
    again at the end); height [m].
    Raises: ValueError for an outline of no area, that crosses or touches itself, or is no list of points.
    """
    plan = _corners(outline)
    n, faces = len(plan), ears(plan)
    bottom, top = np.column_stack([plan, np.zeros(n)]), np.column_stack([plan, np.full(n, height)])
    after = np.roll(np.arange(n), -1)
    walls = [polygon(np.array([bottom[i], bottom[j], top[j], top[i]])) for i, j in enumerate(after)]
    caps = [_cap(bottom, faces[:, ::-1], -1.0), _cap(top, faces, 1.0)]
    made = Assembly()
    made.add("body", material, join(*walls, *caps))
    return made.mesh()


def _cap(points: Floats, faces: Ints, up: float) -> Piece:
    normals = np.broadcast_to([0.0, 0.0, up], (len(faces), 3, 3)).copy()
    return Piece(points, faces, normals, np.zeros(len(faces), int))


def _corners(outline: Sequence[Sequence[float]]) -> Floats:
    """Return the corners (n, 2) counter-clockwise, each once, without those on a straight line between neighbours."""
    try:
        plan = np.array(outline, float)
    except (TypeError, ValueError):
        raise ValueError("outline is no list of points [x, y]") from None
    if plan.ndim != 2 or plan.shape[1] != 2 or len(plan) < 3 or not np.isfinite(plan).all():
        raise ValueError("outline: three or more points [x, y]")
    size = float(np.ptp(plan, axis=0).max()) ** 2
    area = 0.5 * float(_cross(plan, np.roll(plan, -1, axis=0)).sum())
    if abs(area) <= _FLAT * size:
        raise ValueError("outline has no area")
    if area < 0.0:
        plan = plan[::-1]
    # Neither of two equal neighbours turns: both would be taken for corners on a straight line.
    plan = plan[np.abs(plan - np.roll(plan, 1, axis=0)).max(axis=1) > _SAME * size**0.5]
    turns = _cross(plan - np.roll(plan, 1, axis=0), np.roll(plan, -1, axis=0) - plan)
    plan = plan[np.abs(turns) > _FLAT * size]
    if len(plan) < 3:
        raise ValueError("outline has no area")
    if _meets_itself(plan, _FLAT * size):
        raise ValueError("outline crosses or touches itself")
    return plan


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def _meets_itself(plan: Floats, least: float) -> bool:
    """Return whether two sides that are not neighbours have a point in common."""
    n, ends = len(plan), np.roll(plan, -1, axis=0)
    i, j = np.triu_indices(n, 2)
    apart = (j + 1) % n != i
    a, b, c, d = plan[i[apart]], ends[i[apart]], plan[j[apart]], ends[j[apart]]
    beside_first = _cross(b - a, c - a), _cross(b - a, d - a)
    beside_second = _cross(d - c, a - c), _cross(d - c, b - c)
    # Collinear sides have no side of each other: then their extents tell.
    low = np.maximum(np.minimum(a, b), np.minimum(c, d))
    near = (low <= np.minimum(np.maximum(a, b), np.maximum(c, d))).all(axis=1)
    split = [~(((x > least) & (y > least)) | ((x < -least) & (y < -least))) for x, y in (beside_first, beside_second)]
    return bool((near & split[0] & split[1]).any())


def ears(plan: Floats) -> Ints:
    """Return triangles (n - 2, 3) of a simple polygon (n, 2), counter-clockwise: its ears cut off one by one.

    Source: Meisters 1975, American Mathematical Monthly 82, 648-651 (every such polygon has two ears).
    """
    size = float(np.ptp(plan, axis=0).max()) ** 2
    left, made = list(range(len(plan))), []
    while len(left) > 3:
        made.append(_ear(plan, left, _FLAT * size))
        left.remove(made[-1][1])
    return np.array([*made, left], np.int64)


def _ear(plan: Floats, left: list[int], least: float) -> list[int]:
    """Return three neighbours among the corners that are left whose triangle holds no other."""
    points = plan[left]
    for k in range(len(left)):
        a, b, c = points[k - 1], points[k], points[(k + 1) % len(left)]
        if float(_cross(b - a, c - b)) <= least:
            continue
        inside = np.ones(len(left), bool)
        inside[[k - 1, k, (k + 1) % len(left)]] = False
        for start, stop in ((a, b), (b, c), (c, a)):
            inside &= _cross(stop - start, points - start) >= -least
        if not inside.any():
            return [left[k - 1], left[k], left[(k + 1) % len(left)]]
    raise ValueError("outline cannot be cut into triangles")
