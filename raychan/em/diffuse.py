"""Diffuse scattering of rough surfaces: the law of sigma-nought over angle, and how the level fluctuates.

Sigma-nought is the bistatic RCS of a surface over its area; all laws are reciprocal.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan import limits
from raychan.scalars import is_number, is_one_of, meant, plain, shown

Floats = NDArray[np.float64]

_MAY_MISS = ("cross_db", "k_shape")
_LIMITS = {
    "level_db": limits.DIFFUSE_DB,
    "exponent": limits.EXPONENT,
    "cross_db": limits.CROSS_DB,
    "k_shape": limits.K_SHAPE,
    "texture_m": limits.TEXTURE_M,
}
LAWS = ("constant", "gamma", "lambert", "lobe")


@dataclass(frozen=True)
class Diffuse:
    """How a surface scatters diffusely.

    Args: law of sigma-nought over angle: "constant", equal for all; "gamma", gamma times the sine of the grazing angle;
    "lambert", Lambert's law; "lobe", a lobe about the mirrored direction. level_db [dB]: sigma-nought, gamma, or for
    "lambert" and "lobe" the share S^2 of the incident power that is scattered. exponent of the lobe, larger is
    narrower. cross_db [dB] of the cross-polarised return under the co-polarised one, None for none. k_shape of the
    texture of a K distribution (gamma), None for Rayleigh statistics; texture_m [m], the side of a square of one
    texture. Raises: ValueError for values that cannot be.
    Source: constant gamma, Long, Radar Reflectivity of Land and Sea, 2001, ch. 5; Lambert and lobe, Degli-Esposti et
    al., IEEE Trans. AP 55(1), 2007, eq. 3 to 11; K distribution, Ward, IEE Proc. 18(14), 1981.
    """

    law: str
    level_db: float
    exponent: int = 4
    cross_db: float | None = None
    k_shape: float | None = None
    texture_m: float = 1.0

    def __post_init__(self) -> None:
        if not is_one_of(self.law, LAWS):
            raise ValueError(f"law = {self.law!r}: must be one of {', '.join(LAWS)}{meant(self.law, LAWS)}")
        for name in _LIMITS:
            value = plain(getattr(self, name))
            if not ((value is None and name in _MAY_MISS) or is_number(value)):
                raise ValueError(f"{name} = {shown(value)}: a number is wanted")
            held = value if value is None else _LIMITS[name].check(name, value, whole=name == "exponent")
            object.__setattr__(self, name, held)
        if self.law in ("lambert", "lobe") and self.level_db > 0.0:
            raise ValueError(f"level_db = {self.level_db:g} dB: a surface cannot scatter more than it receives (0 dB)")

    @property
    def power(self) -> int:
        """Power of the cosine of incidence with which sigma-nought back to the radar falls, about: of the lobe that of
        cos psi = 2 cos^2 - 1 and of the surface seen."""
        return {"constant": 0, "gamma": 1, "lambert": 2, "lobe": 2 * self.exponent + 1}[self.law]

    def sigma0(self, cos_in: Floats, cos_out: Floats, cos_lobe: Floats) -> Floats:
        """Return sigma-nought (n,) [m^2/m^2] of cosines (n,): of incidence and scattering angle off the normal, and of
        the angle between the scattered and the mirrored direction."""
        level = 10.0 ** (0.1 * self.level_db)
        if self.law == "constant":
            return np.full(np.shape(cos_in), level)
        if self.law == "gamma":
            return np.asarray(level * np.sqrt(cos_in * cos_out))
        if self.law == "lambert":
            return np.asarray(4.0 * level * cos_in * cos_out)
        lobe = (0.5 * (1.0 + cos_lobe)) ** self.exponent
        # The geometric mean of both ways makes the published law, which is not reciprocal off backscatter, so.
        ways = np.sqrt(cos_in * cos_out / (lobe_power(self.exponent, cos_in) * lobe_power(self.exponent, cos_out)))
        return np.asarray(4.0 * np.pi * level * lobe * ways)


def lobe_power(exponent: int, cos_in: Floats) -> Floats:
    """Return the integral (n,) [sr] over the half sphere of ((1 + cos psi) / 2)^exponent, psi counted from the mirrored
    direction of a wave at cosine of incidence (n,).

    Source: Degli-Esposti et al., IEEE Trans. AP 55(1), 2007, eq. 8 and 9.
    """
    sine2 = 1.0 - np.asarray(cos_in) ** 2
    total = np.zeros(np.shape(cos_in))
    for j in range(exponent + 1):
        part = np.full(np.shape(cos_in), 2.0 * np.pi / (j + 1))
        if j % 2:
            terms = [math.comb(2 * w, w) / 4.0**w * sine2**w for w in range((j - 1) // 2 + 1)]
            part = part * cos_in * sum(terms)
        total += math.comb(exponent, j) * part
    return np.asarray(total / 2.0**exponent)


def texture(shape: float | None, square: NDArray[np.int64], rng: np.random.Generator) -> Floats:
    """Return factors (n,) of mean 1 on the power of patches: one draw for each square that patches (n, d) lie in.

    Args: shape of the gamma distribution, None: no texture.
    """
    if shape is None or not len(square):
        return np.ones(len(square))
    unique, index = np.unique(square, axis=0, return_inverse=True)
    drawn = rng.gamma(shape, 1.0 / shape, len(unique))
    return np.asarray(drawn[index.ravel()])
