"""Solids from plane curves: surfaces of revolution, and plan outlines with an inset that follows a section."""

from __future__ import annotations

import numpy as np

from raychan.world.meshes.mesh import Floats
from raychan.world.shapes.curve import Curve, arcs, mirrored, split_at, steps, trimmed
from raychan.world.shapes.piece import SAG, Piece, grid, join, polygon


def revolve(profile: Curve, sag: float = SAG, start: float = 0.0, stop: float = 2.0 * np.pi) -> Piece:
    """Return the profile (r, z) turned about z from `start` to `stop` [rad], closed where it ends on the axis."""
    r, n = profile.points[:, 0], profile.normals
    # Whole quarters, so that the width along x and y is exact.
    count = 4 * int(np.ceil(steps(float(r.max()), stop - start, sag) / 4.0))
    turn = np.linspace(start, stop, count + 1)
    if np.isclose(stop - start, 2.0 * np.pi):
        turn[-1] = start
    c, s = np.cos(turn)[:, None], np.sin(turn)[:, None]
    points = np.stack([r * c, r * s, np.broadcast_to(profile.points[:, 1], (len(turn), len(r)))], axis=2)
    normals = np.stack([n[:, 0] * c, n[:, 0] * s, np.broadcast_to(n[:, 1], (len(turn), len(r)))], axis=2)
    return grid(points, normals)


def ellipsoid(semi: tuple[float, float, float], sag: float = SAG) -> Piece:
    """Return an ellipsoid of semi-axes (3,) [m] about the origin."""
    largest = max(semi)
    steps(largest, 2.0 * np.pi, min(sag, 0.05 * largest))  # where these are too many, it names the radius given
    profile = arcs([(1.0, np.pi / 2.0)] * 2, -np.pi / 2.0, min(sag / largest, 0.05))
    profile.points[:] += [0.0, -1.0]
    profile.points[[0, -1], 0] = 0.0
    return revolve(profile, min(sag / largest, 0.05)).moved(np.diag(semi))


def pillar(radius: float, height: float, edge: float = 0.0, sag: float = SAG) -> Piece:
    """Return a closed upright cylinder on z = 0 with edges rounded by `edge` [m] (0: sharp)."""
    q = np.pi / 2.0
    elements = [(np.inf, radius - edge), (edge, q), (np.inf, height - 2.0 * edge), (edge, q), (np.inf, radius - edge)]
    profile = arcs(elements, -q, sag)
    profile.points[-1, 0] = 0.0
    return revolve(profile, sag)


def capsule(start: Floats, stop: Floats, r0: float, r1: float, sag: float = SAG) -> Piece:
    """Return a closed capsule between two points (3,) with radii r0 and r1 [m] at its ends."""
    a, b = np.asarray(start, float), np.asarray(stop, float)
    length = float(np.linalg.norm(b - a))
    tilt = np.arcsin((r0 - r1) / length)
    q = np.pi / 2.0
    profile = arcs([(r0, q + tilt), (np.inf, length * np.cos(tilt)), (r1, q - tilt)], -q, sag)
    profile.points[[0, -1], 0] = 0.0
    axis = (b - a) / length
    side = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    side /= np.linalg.norm(side)
    turn = np.stack([side, np.cross(axis, side), axis], axis=1)
    at = a - r0 * axis
    return revolve(profile, sag).moved(turn, (at[0], at[1], at[2]))


def offset_solid(half: Curve, section: Curve, groove: dict[float, tuple[float, float]] | None = None) -> Piece:
    """Return the closed solid whose outline at height z is the plan with an inset d, by the section's points (-d, z).

    Args: half right half of the plan outline; section from bottom (normal down) to top (normal up); groove maps
    x [m] of an upright groove in each side to its (width, depth) [m]. Caps are strips across the axis.
    """
    plan, wall = _columns(half, groove or {})
    n = plan.normals
    d, z, out, up = section.points[:, 0], section.points[:, 1], section.normals[:, 0], section.normals[:, 1]
    points = np.empty((len(n), len(d), 3))
    points[..., :2] = plan.points[:, None] + n[:, None] * d[:, None]
    points[..., 2] = z
    normals = np.empty_like(points)
    normals[..., :2] = n[:, None] * out[:, None]
    normals[..., 2] = up
    steep = np.flatnonzero(np.any(wall != 0.0, axis=1))
    # The groove's wall runs along a plan line of normal w; its inset is along n as everywhere.
    w = wall[steep]
    opening = np.einsum("ij,ij->i", w, n[steep])
    raw = np.concatenate([w[:, None] * out[:, None], (opening[:, None] * up)[:, :, None]], axis=2)
    normals[steep] = raw / np.linalg.norm(raw, axis=2, keepdims=True)
    half_count = len(n) // 2
    right, left = np.arange(half_count), np.arange(2 * half_count - 1, half_count - 1, -1)
    caps = []
    for row, z_normal, first, second in ((0, -1.0, left, right), (-1, 1.0, right, left)):
        across = np.stack([points[first, row], points[second, row]], axis=1)
        caps.append(grid(across, np.broadcast_to([0.0, 0.0, z_normal], across.shape)))
    return join(grid(points, normals), *caps)


def _columns(half: Curve, groove: dict[float, tuple[float, float]]) -> tuple[Curve, Floats]:
    """Return the closed plan with its grooves, and for groove walls their normal (n, 2), else 0.

    Insets are along the plan's normal, so that a groove has the same width at every height.
    """
    half = trimmed(half)
    wall = np.zeros_like(half.points)
    for x, (width, depth) in groove.items():
        cut, j = split_at(half, x)
        at, normal = cut.points[j], cut.normals[j]
        along, none = np.array([-normal[1], normal[0]]), np.zeros(2)
        first, last = at - 0.5 * width * along, at + 0.5 * width * along
        # A trapezoid: x grows along the outline, so that the caps' strips do not overlap.
        lean = 0.25 * width * along
        deep = (first + lean - depth * normal, last - lean - depth * normal)
        points = [first, first, deep[0], deep[0], deep[1], deep[1], last, last]
        face = (along * depth + 0.25 * width * normal) / np.hypot(depth, 0.25 * width)
        back = (-along * depth + 0.25 * width * normal) / np.hypot(depth, 0.25 * width)
        walls = [none, face, face, none, none, back, back, none]
        half = Curve(np.insert(half.points, j, points, axis=0), np.insert(half.normals, j, [normal] * 8, axis=0))
        wall = np.insert(wall, j, walls, axis=0)
    return mirrored(half), np.concatenate([wall, wall[::-1] * [1.0, -1.0], wall[:1]])


def block(low: tuple[float, float, float], high: tuple[float, float, float]) -> Piece:
    """Return a closed box with sharp edges between two corners."""
    a, b = np.asarray(low, float), np.asarray(high, float)
    corner = [np.where([i & 1, i & 2, i & 4], b, a) for i in range(8)]
    sides = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
    return join(*(polygon(np.array([corner[i] for i in side])) for side in sides))


def rounded_block(length: float, width: float, height: float, edge: float, sag: float = SAG) -> Piece:
    """Return a closed box on z = 0, centred in x and y, all edges and corners rounded by `edge` [m]."""
    q = np.pi / 2.0
    e = min(edge, 0.499 * min(length, width, height))
    plan = arcs(
        [(np.inf, width / 2 - e), (e, q), (np.inf, length - 2 * e), (e, q), (np.inf, width / 2 - e)], np.pi, sag
    )
    section = arcs([(e, q), (np.inf, height - 2.0 * e), (e, q)], -q, sag).shifted(-e, 0.0)
    return offset_solid(plan, section).moved(offset=(-length / 2.0, 0.0, 0.0))
