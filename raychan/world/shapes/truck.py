"""A box truck: cab, cargo box with its flat tail and locking bars, frame and wheels."""

from __future__ import annotations

import numpy as np

from raychan.world.errors import SceneError
from raychan.world.meshes.mesh import Mesh
from raychan.world.shapes.piece import BODY_SAG, Assembly
from raychan.world.shapes.solid import block, capsule, ellipsoid, rounded_block
from raychan.world.shapes.vehicle import wheel


def truck(
    length: float = 8.0,
    width: float = 2.5,
    height: float = 3.5,
    tail_bottom: float = 0.4,
    front_axle: float | None = None,
    lock_bars: bool = True,
    metal: str = "metal",
    max_sag: float = BODY_SAG,
) -> Mesh:
    """Return a box truck; sizes [m] are overall, without the mirrors; `metal` names the bodywork's material.

    Args: tail_bottom height to which the flat tail reaches down; front_axle its distance from the tail (default 0.66 of
    the length); lock_bars four upright bars on the tail. Origin: centre of the footprint; front = +x.
    Allowed: `front_axle` from 0.22 `length` + 0.96 m to `length` - 0.48 m.
    Parts: tail, lock_bars, box, frame, cab, windscreen, window_*, mirror_*, tyre_front_*, tyre_rear_*, rim_*, plate.
    Raises: SceneError for a front axle of which the wheels stand ahead of the body or run into the rear ones.
    """
    made = Assembly()
    cab = min(2.2, 0.28 * length)
    bar = 0.034 if lock_bars else 0.0
    box_end = length - cab - 0.25
    half, floor, edge = 0.5 * width, 1.0, 0.01
    radius, rear = 0.48, 0.22 * length
    if front_axle is not None and not rear + 2.0 * radius <= front_axle <= length - radius:
        least, most = rear + 2.0 * radius, length - radius
        span = f"between {least:.4g} and {most:.4g} m with a length of {length:g} m"
        allowed = f"{span}: wheels under the body, none in another"
        raise SceneError(f"{front_axle:g} is not possible", key="front_axle", value=front_axle, allowed=allowed)
    shell = rounded_block(box_end - bar - 0.06, width, height - floor, edge, max_sag)
    made.add("box", metal, shell.moved(offset=(0.5 * (box_end + bar + 0.06), 0.0, floor)))
    plate = rounded_block(0.08, width, height - tail_bottom - 0.02, edge, max_sag)
    made.add("tail", metal, plate.moved(offset=(bar + 0.04, 0.0, tail_bottom)))
    for y in (-0.36, -0.09, 0.09, 0.36) if lock_bars else ():
        low, high = (np.array([0.5 * bar, y * width, z]) for z in (tail_bottom + 0.03, height - 0.1))
        made.add("lock_bars", metal, capsule(low, high, 0.5 * bar, 0.5 * bar, max_sag))
    made.add("frame", metal, block((0.2, -0.42, 0.62), (length - 0.4, 0.42, 0.9)))
    proud = 6e-3
    cabin = rounded_block(cab - proud, width - 0.1, min(height - 0.3, 2.9) - 0.45, 0.14, max_sag)
    ahead = length - 0.5 * cab
    middle = ahead - 0.5 * proud
    made.add("cab", metal, cabin.moved(offset=(middle, 0.0, 0.45)))
    pane = length - 2.0 * proud
    made.add("windscreen", "glass", block((pane, -0.4 * width, 1.75), (length, 0.4 * width, 2.45)))
    side = half - 0.05
    window = block((ahead - 0.3, side - 2e-3, 1.75), (ahead + 0.65, side + 4e-3, 2.4))
    made.pair("window", "glass", window)
    mirror = ellipsoid((0.07, 0.12, 0.22), 2.0 * max_sag).moved(offset=(length - 0.25, half + 0.13, 2.1))
    arm = capsule(np.array([length - 0.3, side - 0.05, 2.0]), np.array([length - 0.25, half + 0.1, 2.1]), 0.02, 0.02)
    made.pair("mirror", metal, mirror, arm)
    front = 0.66 * length if front_axle is None else front_axle
    for end, x in (("rear", rear), ("front", front)):
        tyre, rim = wheel(radius, 0.3, half - 0.01, 2.5 * max_sag)
        made.pair(f"tyre_{end}", "rubber", tyre.moved(offset=(x, 0.0, 0.0)))
        made.pair(f"rim_{end}", metal, rim.moved(offset=(x, 0.0, 0.0)))
        made.add("frame", metal, block((x - 0.06, 0.3 - half, radius - 0.06), (x + 0.06, half - 0.3, radius + 0.06)))
    made.add("plate", "metal", block((bar - 4e-3, -0.26, tail_bottom + 0.25), (bar + 4e-3, 0.26, tail_bottom + 0.36)))
    made.pieces[:] = [(name, p.moved(offset=(-0.5 * length, 0.0, 0.0))) for name, p in made.pieces]
    return made.mesh()
