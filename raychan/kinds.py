"""Kinds: of interaction at a vertex, of material, of body; as enumerations and as plain integers for kernels."""

from __future__ import annotations

from enum import IntEnum

__all__ = ["InteractionType", "MaterialKind", "Role"]
__all__ += ["DIFFRACT", "DIFFUSE", "NONE", "POINT", "REFLECT", "SCATTER", "TRANSMIT"]
__all__ += ["BLOCKER", "HALF_SPACE", "LAYER", "MIRROR", "PEC", "SCATTERER"]


class InteractionType(IntEnum):
    """What happens at a vertex of a route."""

    NONE = 0  # an unused slot
    REFLECT = 1  # at a plane, by the image method
    TRANSMIT = 2  # straight through a thin layer
    SCATTER = 3  # by physical optics over a footprint
    POINT = 4  # at a target of given RCS
    DIFFRACT = 5  # at a wedge, by UTD
    DIFFUSE = 6  # at a rough surface, as speckle


class MaterialKind(IntEnum):
    """What a material is to a wave."""

    PEC = 0  # a perfect conductor
    HALF_SPACE = 1  # so thick that nothing returns from behind its surface
    LAYER = 2  # thin: reflects and passes


class Role(IntEnum):
    """What a body does besides blocking rays."""

    SCATTERER = 0  # scatters and reflects
    MIRROR = 1  # only reflects: the infinite ground
    BLOCKER = 2  # nothing else


# The same as plain integers: numba compiles a global integer into the code.
NONE, REFLECT, TRANSMIT, SCATTER, POINT, DIFFRACT, DIFFUSE = map(int, InteractionType)
PEC, HALF_SPACE, LAYER = map(int, MaterialKind)
SCATTERER, MIRROR, BLOCKER = map(int, Role)
