"""The tables of materials in a scene file."""

from __future__ import annotations

from typing import Literal

from pydantic import model_validator

from raychan.world.scene_files.base import Table
from raychan.world.scene_files.quantities import (
    Conductivity,
    CrossLevel,
    DiffuseLevel,
    Exponent,
    KShape,
    Permittivity,
    Roughness,
    Switch,
    Texture,
    Thickness,
)


class DiffuseTable(Table):
    """Table [materials.NAME.diffuse]: a surface that scatters diffusely, as speckle."""

    law: Literal["constant", "gamma", "lambert", "lobe"]
    level_db: DiffuseLevel
    """constant: sigma-nought; gamma: sigma-nought over the sine of the grazing angle; lambert, lobe: the share of the
    incident power that is scattered."""
    exponent: Exponent = 4
    """Of a lobe: larger is narrower."""
    cross_db: CrossLevel | None = None
    """Cross-polarised return under the co-polarised one; none: no cross-polarised return."""
    k_shape: KShape | None = None
    """Shape of a K distribution; none: Rayleigh."""
    texture_m: Texture = 1.0
    """Side of a square of one texture."""

    @model_validator(mode="after")
    def _fits(self) -> DiffuseTable:
        if self.law in ("lambert", "lobe") and self.level_db > 0.0:
            raise ValueError(f"level_db at most 0 for law = '{self.law}': it is a share of the incident power")
        return self


class MaterialTable(Table):
    """Table [materials.NAME]."""

    eps_r: Permittivity = 1.0
    sigma: Conductivity = 0.0
    """S/m."""
    thickness_mm: Thickness | None = None
    roughness_mm: Roughness = 0.0
    pec: Switch = False
    source: str = ""
    diffuse: DiffuseTable | None = None
