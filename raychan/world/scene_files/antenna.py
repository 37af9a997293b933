"""The tables of an antenna, in a scene or in a file of its own."""

from __future__ import annotations

from typing import Literal

from pydantic import model_validator

from raychan.world.limits import ROW_WAVELENGTHS
from raychan.world.scene_files.base import Table
from raychan.world.scene_files.quantities import Beam, FileName, Gain, Level, Loss, Row, Spacing, Switch, Window


class PublishedTable(Table):
    """[published] of an antenna: figures that its source prints; `raychan info` shows them beside the computed ones."""

    gain_dbi: Gain | None = None
    hpbw_h_deg: Beam | None = None
    hpbw_v_deg: Beam | None = None
    sll_h_db: Level | None = None
    sll_v_db: Level | None = None


class AntennaTable(Table):
    """An antenna: a kind with what that kind takes, in a scene or in a TOML file of its own."""

    kind: Literal["isotropic", "cosine", "array", "measured"]
    source: str = ""
    published: PublishedTable | None = None
    gain_dbi: Gain | None = None
    """At boresight; the loss follows."""
    loss_db: Loss | None = None
    """Default 0 dB."""
    hpbw_h_deg: Beam | None = None
    hpbw_v_deg: Beam | None = None
    ny: Row = 1
    nz: Row = 1
    spacing_y: Spacing = 0.5
    """Wavelengths."""
    spacing_z: Spacing = 0.5
    taper_y: Window = "rect"
    taper_z: Window = "rect"
    element: AntennaTable | None = None
    """Default: isotropic ahead."""
    front: Switch = False
    file: FileName | None = None

    @model_validator(mode="after")
    def _fits(self) -> AntennaTable:
        own = _OF_KIND[self.kind]
        if strange := sorted(self.model_fields_set - own - _OF_ANY):
            known = ", ".join(sorted(own | _OF_ANY))
            raise ValueError(f"{strange[0]} is no key of kind = '{self.kind}', which takes {known}")
        if self.gain_dbi is not None and self.loss_db is not None:
            raise ValueError("either gain_dbi or loss_db")
        if self.kind == "cosine" and (self.hpbw_h_deg is None or self.hpbw_v_deg is None):
            raise ValueError("hpbw_h_deg and hpbw_v_deg for kind = 'cosine'")
        if self.kind == "measured" and self.file is None:
            raise ValueError("file for kind = 'measured'")
        if max(self.ny * self.spacing_y, self.nz * self.spacing_z) > ROW_WAVELENGTHS:
            raise ValueError(f"elements times spacing at most {ROW_WAVELENGTHS:g} wavelengths, along y and z")
        return self


_OF_KIND = {
    "isotropic": {"front"},
    "cosine": {"hpbw_h_deg", "hpbw_v_deg"},
    "array": {"ny", "nz", "spacing_y", "spacing_z", "taper_y", "taper_z", "element"},
    "measured": {"file"},
}
_OF_ANY = {"kind", "source", "published", "gain_dbi", "loss_db"}
