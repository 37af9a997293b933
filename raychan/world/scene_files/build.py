"""From a scene file to its text, its bodies and its materials."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from os import PathLike
from pathlib import Path

from raychan.em.diffuse import Diffuse
from raychan.world.body import Body
from raychan.world.errors import SceneError, nearest, shown
from raychan.world.material import Material
from raychan.world.scene_files import bundled, overrides
from raychan.world.scene_files.materials import MaterialTable
from raychan.world.scene_files.schema import BodyTable

_FORM = ("shape", "params", "mesh", "unit", "up", "forward", "scale", "crease_deg")


SHIP_TABLES = ("ship", "steering", "programme", "avoidance", "scanner", "sea", "run", "replay")
"""Tables that scenes of ships have and those of radars have not."""
_LARGEST = 16 << 20  # bytes of a scene file; 10,000 bodies take 2 MB


def _near(file: Path, known: Sequence[str]) -> str:
    """Return a text that names the scenes beside a missing file, or those known, whose names are close to its own; all
    that are known where none is."""
    beside = [f.stem for f in file.parent.glob("*.toml")] if file.parent.is_dir() else []
    close = [f"{name}.toml" for name in get_close_matches(file.stem, beside, n=2)]
    close += get_close_matches(file.stem, known, n=1)
    if close:
        return "did you mean " + " or ".join(f"'{name}'" for name in close) + "?"
    return "a scene file that exists" + (f", or {nearest(file.stem, known)}" if known else "")


def scene_text(path: str | Path, known: Sequence[str] = ()) -> tuple[str, Path]:
    """Return the text of a scene file, or of the scene of that name that comes with raychan, and the file.

    Args: known names that a message proposes; none: those of the bundled scenes of radars.
    Raises: SceneError where there is none, or where it cannot be read.
    """
    if not isinstance(path, str | PathLike):
        allowed = "a scene file, or the name of a bundled scene"
        raise SceneError(f"{shown(path)} is not possible", key="path", value=path, allowed=allowed)
    known = known or bundled.names()
    if "\0" in str(path):
        raise SceneError(f"{shown(str(path))} is not possible", value=str(path), allowed="a name without a zero byte")
    if not str(path).strip() or str(path) == ".":  # Path("") is the current directory
        problem = "no scene file is named: '.', or an empty name, is the current folder"
        raise SceneError(problem, value=str(path), allowed=_near(Path("?"), known))
    file = bundled.found(path)
    overrides.refuse_mesh(file)
    try:
        if file.exists() and not file.is_file():
            problem = "is a folder" if file.is_dir() else "is not a file"
            raise SceneError(problem, file=file, allowed="a scene file, which is a text in TOML")
        if file.exists() and file.stat().st_size > _LARGEST:
            raise SceneError("is too large for a scene file", file=file, allowed=f"at most {_LARGEST >> 20} MB")
        # Some editors begin a text with a byte order mark.
        return file.read_text(encoding="utf-8-sig"), file
    except FileNotFoundError:
        raise SceneError("file not found: there is none of that name", file=file, allowed=_near(file, known)) from None
    except UnicodeDecodeError as e:
        raise overrides.no_toml(e, file) from e
    except OSError as e:
        raise SceneError(f"cannot be read ({e.strerror or e})", file=file, allowed="a text in TOML") from e


def refuse_ship(data: object, file: Path | None) -> None:
    """Raise SceneError for the tables of a ship's scene; it may leave [ship] itself out."""
    if isinstance(data, Mapping) and ("ship" in data or "radar" not in data):
        for key in (name for name in SHIP_TABLES if name in data):
            raise SceneError("is a scene of a ship, not of a radar", file=file, key=key, allowed="raychan ship")


def body_of(t: BodyTable, folder: Path, like: tuple[BodyTable, Body] | None = None) -> Body:
    """Return the body of a table.

    Args: like another table and its body, which is returned if both tables are equal, and whose mesh is shared if they
    describe the same shape.
    """
    # true equals 1.0, but is no length.
    same = like is not None and repr(t.params) == repr(like[0].params)
    if like is not None and same and t == like[0]:
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
        rcs_dbsm=t.rcs_dbsm,
        rcs_point=t.rcs_point,
        swerling=t.swerling,
        role=t.role,
        unit=t.unit,
        up=t.up,
        forward=t.forward,
        scale=t.scale,
        crease_deg=t.crease_deg,
    )
    if like is not None and same and all(getattr(t, name) == getattr(like[0], name) for name in _FORM):
        body.__dict__["geometry"] = like[1].geometry
    return body


def material_of(name: str, t: MaterialTable, file: Path | None) -> Material:
    """Return the material of a table; SceneError where it cannot be."""
    thickness = None if t.thickness_mm is None else t.thickness_mm * 1e-3
    try:
        diffuse = None if t.diffuse is None else Diffuse(**t.diffuse.model_dump())
        return Material(t.eps_r, t.sigma, thickness, t.roughness_mm * 1e-3, t.pec, name, t.source, diffuse)
    except SceneError as e:
        raise e.at(file=file, key=f"materials.{name}") from None
