"""Bodies and materials as the tables of a scene file say."""

from __future__ import annotations

from pathlib import Path

from raychan.world.body import Body
from raychan.world.errors import SceneError
from raychan.world.material import Material
from raychan.world.schema import BodyTable, MaterialTable

_FORM = ("shape", "params", "mesh", "unit", "up", "forward", "scale", "crease_deg")


def body_of(t: BodyTable, folder: Path, like: tuple[BodyTable, Body] | None = None) -> Body:
    """Return the body of a table: that of another table if both say the same, and at least with its mesh if they are of
    one form."""
    if like is not None and t == like[0]:
        return like[1]
    body = Body(
        name=t.name,
        mesh=None if t.mesh is None else folder / t.mesh,
        shape=t.shape,
        params=t.params,
        material=t.material,
        materials=t.materials,
        position=t.position,
        yaw_deg=t.yaw_deg,
        pitch_deg=t.pitch_deg,
        roll_deg=t.roll_deg,
        velocity=t.velocity_mps,
        turn_rate_dps=t.turn_rate_dps,
        spin_dps=t.spin_dps,
        rcs=t.rcs_dbsm,
        rcs_point=t.rcs_point,
        role=t.role,
        unit=t.unit,
        up=t.up,
        forward=t.forward,
        scale=t.scale,
        crease_deg=t.crease_deg,
    )
    if like is not None and all(getattr(t, name) == getattr(like[0], name) for name in _FORM):
        body.__dict__["geometry"] = like[1].geometry
    return body


def material_of(name: str, t: MaterialTable, file: Path | None) -> Material:
    """Return the material of a table; SceneError where it cannot be."""
    thickness = None if t.thickness_mm is None else t.thickness_mm * 1e-3
    try:
        return Material(t.eps_r, t.sigma, thickness, t.roughness_mm * 1e-3, t.pec, name, t.source)
    except SceneError as e:
        raise e.at(file=file, key=f"materials.{name}") from None
