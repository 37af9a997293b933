"""Street furniture: lamp post, guard rail, wall, bench, trash bin, bike rack."""

from __future__ import annotations

import numpy as np

from raychan.world.errors import SceneError
from raychan.world.meshes.mesh import Floats, Mesh
from raychan.world.shapes.curve import Curve, steps
from raychan.world.shapes.piece import SAG, Assembly, Piece, grid, join, polygon
from raychan.world.shapes.solid import block, capsule, pillar, rounded_block


def lamp_post(
    height: float = 6.0, radius: float = 0.07, arm: float = 1.2, material: str = "metal", max_sag: float = SAG
) -> Mesh:
    """Return a street lamp: pole of `radius`, arm of length `arm` towards +x (0: none), luminaire; height overall [m].

    Origin: foot of the pole on the ground, on its axis. Allowed: `height` above 0.47 m + 0.6 `radius`, without an arm
    above 0.37 m. Parts: pole, base, arm, luminaire.
    Raises: SceneError where the luminaire, or the arm, does not begin above the base, or the arm's foot, 0.6 `radius`,
    holds all of the arm.
    """
    made = Assembly()
    top, foot, thick, below = height - 0.12, 0.25, 0.6 * radius, 0.1
    least = foot + height - top + (below + thick if arm > 0.0 else 0.0)
    if not height > least:
        what = f"with an arm and a radius of {radius:g} m: the arm" if arm > 0.0 else "without an arm: the luminaire"
        allowed = f"above {least:.4g} m {what} begins above the base"
        raise SceneError(f"{height:g} is not possible", key="height", value=height, allowed=allowed)
    made.add("pole", material, pillar(radius, top, 0.01, max_sag))
    made.add("base", material, pillar(1.9 * radius, foot, 0.01, max_sag))
    if arm > 0.0:
        start, stop, thin = np.array([0.0, 0.0, top - below]), np.array([arm, 0.0, height - 0.05]), 0.035
        widest = (float(np.linalg.norm(stop - start)) + thin) / 0.6
        if radius >= widest:
            allowed = f"less than {widest:.4g} m with an arm of {arm:g} m, which its own foot would hold"
            raise SceneError(f"{radius:g} is not possible", key="radius", value=radius, allowed=allowed)
        made.add("arm", material, capsule(start, stop, thick, thin, max_sag))
    head = rounded_block(0.55, 0.24, 0.12, 0.03, max_sag)
    made.add("luminaire", material, head.moved(offset=(arm, 0.0, height - 0.12)))
    return made.mesh()


def guard_rail(length: float = 8.0, height: float = 0.75, material: str = "metal", max_sag: float = SAG) -> Mesh:
    """Return a W-beam guard rail along x on posts every 2 m; faces -y (the road); length and height [m] overall.

    Origin: middle of the rail's line on the ground, posts on +y. Allowed: `length` up to 10 km. Parts: beam, posts.
    Beam: two waves, 0.31 m tall, 0.08 m deep, sheet of 3 mm (after EN 1317 systems in common use).
    """
    made = Assembly()
    deep, tall, sheet = 0.08, 0.31, 3e-3
    count = 4 * max(8, int(np.ceil(0.5 * tall * np.pi * np.sqrt(deep / (16.0 * max_sag)) / tall)))
    u = np.linspace(0.0, 1.0, count + 1)
    y = 0.5 * deep * np.cos(4.0 * np.pi * u)
    slope = -2.0 * np.pi * deep * np.sin(4.0 * np.pi * u) / tall
    normal = np.stack([-np.ones_like(u), slope], axis=1) / np.hypot(slope, 1.0)[:, None]
    front = Curve(np.stack([y + 0.5 * deep, height - tall + tall * u], axis=1), normal)
    back = Curve(front.points[::-1] + np.array([sheet, 0.0]), -normal[::-1])
    made.add("beam", material, _extruded(front, back, length))
    if length > 10_000.0:
        raise ValueError("a rail of more than 10 km has too many posts")
    posts = np.linspace(-0.5 * length + 0.3, 0.5 * length - 0.3, max(2, int(length // 2.0)))
    for x in posts:
        made.add("posts", material, block((x - 0.05, deep - 0.01, 0.0), (x + 0.05, deep + 0.1, height - 0.01)))
    return made.mesh()


def _extruded(front: Curve, back: Curve, length: float) -> Piece:
    """Return the closed sheet between two curves in (y, z), front upward and back downward, along x."""
    x = np.array([-0.5, 0.5]) * length

    def sweep(points: Floats, normals: Floats) -> Piece:
        p = np.stack([np.column_stack([np.full(len(points), v), points]) for v in x])
        n = np.stack([np.column_stack([np.zeros(len(points)), normals])] * 2)
        return grid(p, n)

    ends = []
    for v, order in ((x[0], -1), (x[1], 1)):
        strip = np.stack([front.points, back.points[::-1]])[::order]
        p = np.concatenate([np.full((*strip.shape[:2], 1), v), strip], axis=2)
        ends.append(grid(p, np.broadcast_to([np.sign(v), 0.0, 0.0], p.shape)))
    rims = []
    for a, b, up in ((front.points[-1], back.points[0], 1.0), (back.points[-1], front.points[0], -1.0)):
        rims.append(sweep(np.stack([a, b]), np.broadcast_to([0.0, up], (2, 2))))
    return join(sweep(front.points, front.normals), sweep(back.points, back.normals), *ends, *rims)


def wall(length: float = 10.0, height: float = 6.0, thickness: float = 0.3, material: str = "concrete") -> Mesh:
    """Return a building wall along x, its face at y = 0 looking to -y; length, height, thickness [m].

    Origin: middle of the face's foot on the ground. Part: body.
    """
    made = Assembly()
    made.add("body", material, block((-0.5 * length, 0.0, 0.0), (0.5 * length, thickness, height)))
    return made.mesh()


def bench(length: float = 1.8, height: float = 0.85, depth: float = 0.6, material: str = "wood") -> Mesh:
    """Return a bench of slats that faces -y, along x; length, height, depth [m] overall.

    Origin: centre of the footprint on the ground. Parts: seat, back, legs.
    """
    made = Assembly()
    half, deep, seat = 0.5 * length, 0.5 * depth, 0.45
    for i in range(4):
        y = -deep + i * 0.24 * depth
        made.add("seat", material, block((-half, y, seat - 0.035), (half, y + 0.2 * depth, seat)))
    for i in range(3):
        z = height - (i + 1) * 0.13 + 0.03
        made.add("back", material, block((-half, deep - 0.035, z), (half, deep, z + 0.1)))
    for x in (-half + 0.15, half - 0.22):
        made.add("legs", "metal", block((x, -deep + 0.05, 0.0), (x + 0.06, -deep + 0.1, seat - 0.035)))
        made.add("legs", "metal", block((x, deep - 0.075, 0.0), (x + 0.06, deep - 0.036, height - 0.05)))
        # The bar shares no plane with the legs: two faces in one place hide each other by rounding.
        bar = (x + 0.005, -deep + 0.06, seat - 0.08), (x + 0.055, deep - 0.05, seat - 0.036)
        made.add("legs", "metal", block(*bar))
    return made.mesh()


def trash_bin(height: float = 0.95, radius: float = 0.25, material: str = "plastic", max_sag: float = SAG) -> Mesh:
    """Return a round litter bin with a lid; height and radius [m] overall. Origin: centre of its foot on the ground."""
    made = Assembly()
    made.add("body", material, pillar(0.92 * radius, height - 0.1, 0.015, max_sag))
    made.add("lid", material, pillar(radius, 0.12, 0.03, max_sag).moved(offset=(0.0, 0.0, height - 0.12)))
    return made.mesh()


def bike_rack(
    hoops: int = 4,
    spacing: float = 0.8,
    height: float = 0.85,
    width: float = 0.7,
    material: str = "metal",
    max_sag: float = SAG,
) -> Mesh:
    """Return a row of upside-down U hoops along x, each `width` across y, of tube 48 mm; sizes [m] overall.

    Origin: centre of the row on the ground. Allowed: `hoops` up to 1000. Part: hoop_1, hoop_2, ...
    """
    made = Assembly()
    r, bend = 0.024, 0.15
    for i in range(hoops):
        x = (i - 0.5 * (hoops - 1)) * spacing
        made.add(
            f"hoop_{i + 1}", material, _hoop(width - 2.0 * r, height - r, bend, r, max_sag).moved(offset=(x, 0.0, 0.0))
        )
    return made.mesh()


def _hoop(span: float, top: float, bend: float, r: float, sag: float) -> Piece:
    """Return a closed tube of radius r in the plane x = 0 along an upside-down U."""
    turns = np.linspace(0.0, 0.5 * np.pi, 9)
    half = 0.5 * span
    left = np.stack([half - bend + bend * np.cos(turns), top - bend + bend * np.sin(turns)], axis=1)
    heading = np.concatenate([[0.0], turns, np.pi - turns[::-1], [np.pi]])
    line = np.concatenate([[[half, 0.0]], left, left[::-1] * [-1.0, 1.0], [[-half, 0.0]]])
    around = np.linspace(0.0, 2.0 * np.pi, 4 * steps(r, 0.5 * np.pi, sag) + 1)
    around[-1] = 0.0
    n = np.empty((len(line), len(around), 3))
    n[..., 0] = np.sin(around)
    n[..., 1] = np.cos(heading)[:, None] * np.cos(around)
    n[..., 2] = np.sin(heading)[:, None] * np.cos(around)
    centre = np.column_stack([np.zeros(len(line)), line])[:, None]
    p = centre + r * n
    feet = [polygon(p[0, :-1]), polygon(p[-1, -2::-1])]
    return join(grid(p, n), *feet)
