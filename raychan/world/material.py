"""What bodies are made of: permittivity, conductivity, thickness and roughness, each row with its source.

Building materials follow ITU-R P.2040-3 (2023), table 3: eps_r = a f^b, sigma = c f^d with f in GHz.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from raychan.em.diffuse import Diffuse
from raychan.records import LAYER, MaterialKind, Materials
from raychan.scalars import plain
from raychan.units import EPS0
from raychan.world.errors import SceneError, nearest, shown
from raychan.world.limits import EPS_R, ROUGHNESS_MM, SIGMA, THICKNESS_MM

_ROUGHNESS, _THICKNESS = ROUGHNESS_MM.times(1e-3, "m"), THICKNESS_MM.times(1e-3, "m")

_TYPES = {
    "pec": (bool, "true or false"),
    "name": (str, "a text"),
    "source": (str, "a text"),
    "diffuse": (Diffuse | None, "a Diffuse, or None"),
}


@dataclass(frozen=True)
class Material:
    """A material at one frequency; `raychan.world.material.names()` lists the built-in ones.

    Args: eps_r relative permittivity; sigma [S/m]; thickness [m] of a thin layer that reflects and passes, None for an
    opaque half space; roughness rms height [m]; pec perfect conductor; diffuse, how it scatters diffusely, None: not.
    Raises: SceneError for values no passive material has.
    """

    eps_r: float = 1.0
    sigma: float = 0.0
    thickness: float | None = None
    roughness: float = 0.0
    pec: bool = False
    name: str = ""
    source: str = ""
    diffuse: Diffuse | None = None

    def __post_init__(self) -> None:
        for key, limit in (("eps_r", EPS_R), ("sigma", SIGMA), ("roughness", _ROUGHNESS), ("thickness", _THICKNESS)):
            value = getattr(self, key)
            if limit.problem(value) if value is not None else key != "thickness":
                raise SceneError(f"{shown(value)} is not possible", key=key, value=value, allowed=limit.allowed)
            object.__setattr__(self, key, plain(value))
        object.__setattr__(self, "pec", plain(self.pec))
        for key, (kind, allowed) in _TYPES.items():
            value = getattr(self, key)
            if not isinstance(value, kind):
                raise SceneError(f"{shown(value)} is not possible", key=key, value=value, allowed=allowed)

    @property
    def kind(self) -> MaterialKind:
        """What it is to a wave."""
        if self.pec:
            return MaterialKind.PEC
        return MaterialKind.HALF_SPACE if self.thickness is None else MaterialKind.LAYER

    def eps(self, frequency: float) -> complex:
        """Return eps_r - j sigma / (omega eps0) at a frequency [Hz]; 1 for a perfect conductor."""
        return 1.0 + 0.0j if self.pec else complex(self.eps_r, -self.sigma / (2.0 * np.pi * frequency * EPS0))


PEC = Material(pec=True, name="pec", source="ideal")


class _Law(NamedTuple):
    a: float
    b: float
    c: float
    d: float
    low: float
    high: float


_ITU = {
    "concrete": _Law(5.24, 0.0, 0.0462, 0.7822, 1, 100),
    "brick": _Law(3.91, 0.0, 0.0238, 0.16, 1, 40),
    "plasterboard": _Law(2.73, 0.0, 0.0085, 0.9395, 1, 100),
    "wood": _Law(1.99, 0.0, 0.0047, 1.0718, 0.001, 100),
    "glass": _Law(6.31, 0.0, 0.0036, 1.3394, 0.1, 100),
    "ceiling_board": _Law(1.48, 0.0, 0.0011, 1.0750, 1, 100),
    "chipboard": _Law(2.58, 0.0, 0.0217, 0.7800, 1, 100),
    "plywood": _Law(2.71, 0.0, 0.33, 0.0, 1, 40),
    "marble": _Law(7.074, 0.0, 0.0055, 0.9262, 1, 60),
    "floorboard": _Law(3.66, 0.0, 0.0044, 1.3515, 50, 100),
    "metal": _Law(1.0, 0.0, 1e7, 0.0, 1, 100),
    "very_dry_ground": _Law(3.0, 0.0, 0.00015, 2.52, 1, 10),
    "medium_dry_ground": _Law(15.0, -0.1, 0.035, 1.63, 1, 10),
    "wet_ground": _Law(30.0, -0.4, 0.15, 1.30, 1, 10),
}

_ROUGH_GUESS = "engineering value, not measured for this project: expect +-20 % in eps_r and a factor 2 in sigma"
_FIXED = {
    "asphalt": Material(
        3.18,
        0.52,
        roughness=0.35e-3,
        source="eps 3.18 - 0.1j for dry asphalt near 94 GHz after Li and Sarabandi 1999 (IEEE TAP 47), quoted "
        "second-hand; roughness of a smooth road; both vary much between roads",
    ),
    "rubber": Material(4.0, 1.3, source=f"tyre rubber filled with carbon black, loss tangent 0.075; {_ROUGH_GUESS}"),
    "plastic": Material(2.3, 0.01, source=f"polypropylene, opaque; {_ROUGH_GUESS}"),
    "bumper": Material(2.5, 0.05, thickness=3e-3, source=f"painted polypropylene skin of 3 mm; {_ROUGH_GUESS}"),
    "foam": Material(1.3, 0.2, source=f"upholstery over foam, taken as opaque (lossy in depth); {_ROUGH_GUESS}"),
    "skin": Material(6.57, 38.2, source="dry skin at 77 GHz, four Cole-Cole terms of Gabriel, Lau and Gabriel 1996"),
    "clothing": Material(1.7, 0.1, thickness=1e-3, source=f"one layer of cotton of 1 mm; {_ROUGH_GUESS}"),
}
_PANES = {
    "car_glass": (4.0e-3, "tempered side or rear pane of 4 mm"),
    "windscreen": (5.0e-3, "laminated pane of 5 mm taken as solid glass"),
}


def names() -> tuple[str, ...]:
    """Return the names of the built-in materials."""
    return ("pec", *_ITU, *_FIXED, *_PANES)


@lru_cache(maxsize=256)
def material(name: str, frequency: float) -> Material:
    """Return a built-in material at a frequency [Hz]; SceneError with the nearest name for an unknown one."""
    if name == "pec":
        return PEC
    if name in _ITU:
        law, ghz = _ITU[name], frequency / 1e9
        source = f"ITU-R P.2040-3 table 3 ({law.low:g} to {law.high:g} GHz)"
        return Material(law.a * ghz**law.b, law.c * ghz**law.d, name=name, source=source)
    if name in _FIXED:
        return replace(_FIXED[name], name=name)
    if name in _PANES:
        thickness, what = _PANES[name]
        glass = material("glass", frequency)
        return replace(glass, thickness=thickness, name=name, source=f"{what}; glass after {glass.source}")
    raise SceneError(f"unknown material '{name}'", value=name, allowed=nearest(name, names()))


def validity(name: str, frequency: float) -> str:
    """Return a warning where a built-in material is used outside the range of its source, or ''."""
    law = _ITU.get("glass" if name in _PANES else name)
    ghz = frequency / 1e9
    if law is None or law.low <= ghz <= law.high:
        return ""
    return (
        f"material '{name}' at {ghz:g} GHz is outside {law.low:g} to {law.high:g} GHz of ITU-R P.2040-3: extrapolated"
    )


def resolve(materials: Iterable[str | Material], frequency: float) -> Materials:
    """Return the record of materials, given by name or as Material, at a frequency [Hz]; a row each, in order."""
    rows = [material(m, frequency) if isinstance(m, str) else m for m in materials]
    return Materials(
        kind=np.array([m.kind for m in rows], np.int8),
        eps=np.array([m.eps(frequency) for m in rows], np.complex128),
        thickness=np.array([m.thickness or 0.0 for m in rows], float) * [m.kind == LAYER for m in rows],
        roughness=np.array([m.roughness for m in rows], float),
        diffuse=tuple(m.diffuse for m in rows),
    )
