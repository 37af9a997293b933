"""Attenuation in air, rain and fog, in dB over a kilometre of path.

Sources: Recommendations ITU-R P.676-13 (2022), Annex 1 (gases, line by line); P.838-3 (2005) (rain); P.840-8 (2019),
section 2 (cloud and fog, Rayleigh scattering by water droplets of double-Debye permittivity).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from raychan.em.gas_lines import OXYGEN, WATER
from raychan.limits import CELSIUS, FOG_GM3, PRESSURE_HPA, RAIN_MMH, VAPOUR_GM3
from raychan.scalars import is_one_of, meant, shown

_NP_M = math.log(10.0) / 20.0 / 1e3  # Np/m of a field over dB/km of its power
_LOWEST, _HIGHEST, _FOG_HIGHEST = 1.0, 1000.0, 200.0  # GHz for which the Recommendations hold

_K_H = ((-5.33980, -0.10008, 1.13098), (-0.35351, 1.26970, 0.45400), (-0.23789, 0.86036, 0.15354),
        (-0.94158, 0.64552, 0.16817))  # fmt: skip
_K_V = ((-3.80595, 0.56934, 0.81061), (-3.44965, -0.22911, 0.51059), (-0.39902, 0.73042, 0.11899),
        (0.50167, 1.07319, 0.27195))  # fmt: skip
_ALPHA_H = ((-0.14318, 1.82442, -0.55187), (0.29591, 0.77564, 0.19822), (0.32177, 0.63773, 0.13164),
            (-5.37610, -0.96230, 1.47828), (16.1721, -3.29980, 3.43990))  # fmt: skip
_ALPHA_V = ((-0.07771, 2.33840, -0.76284), (0.56727, 0.95545, 0.54039), (-0.20238, 1.14520, 0.26809),
            (-48.2991, 0.791669, 0.116226), (48.5833, 0.791459, 0.116479))  # fmt: skip
_RAIN = {
    "H": ((_K_H, -0.18961, 0.71147), (_ALPHA_H, 0.67849, -1.95537)),
    "V": ((_K_V, -0.16398, 0.63297), (_ALPHA_V, -0.053739, 0.83433)),
}
"""P.838-3, Tables 1 to 4: rows (a_j, b_j, c_j), then m and c, of log10 k and of alpha."""
_LIMITS = {
    "temperature_c": CELSIUS,
    "pressure_hpa": PRESSURE_HPA,
    "vapour_gm3": VAPOUR_GM3,
    "rain_mmh": RAIN_MMH,
    "fog_gm3": FOG_GM3,
}


@dataclass(frozen=True)
class Atmosphere:
    """The air between radar and targets, the same everywhere; by default that of the ITU's reference, dry of rain.

    Raises: ValueError for values beyond the limits of scene files.
    """

    temperature_c: float = 15.0
    """[deg C]"""
    pressure_hpa: float = 1013.25
    """Of the dry air [hPa]; P.676-13 adds that of the vapour to it."""
    vapour_gm3: float = 7.5
    """Water vapour [g/m3]."""
    rain_mmh: float = 0.0
    """Rain rate [mm/h]."""
    fog_gm3: float = 0.0
    """Liquid water of fog [g/m3]: about 0.05 where one sees 300 m, 0.5 where one sees 50 m (P.840-8, section 1)."""

    def __post_init__(self) -> None:
        for name, limit in _LIMITS.items():
            object.__setattr__(self, name, float(limit.check(f"Atmosphere.{name}", getattr(self, name))))

    def specific(self, frequency: float, polarization: str = "V") -> dict[str, float]:
        """Return the specific attenuation [dB/km] by cause: gas, rain, fog.

        Args: frequency [Hz]; polarization V or H of a horizontal path. Raises: ValueError for another
        polarization, and outside 1 GHz to 1 THz, with fog 200 GHz.
        """
        if not is_one_of(polarization, tuple(_RAIN)):
            raise ValueError(f"polarization = {shown(polarization)}: must be V or H{meant(polarization, _RAIN)}")
        ghz = frequency / 1e9  # times 1e-9, 1000 GHz is a hair above
        return {
            "gas": gas(ghz, self.temperature_c + 273.15, self.pressure_hpa, self.vapour_gm3),
            "rain": rain(ghz, self.rain_mmh, polarization),
            "fog": fog(ghz, self.fog_gm3, self.temperature_c + 273.15),
        }

    def attenuation(self, frequency: float, polarization: str = "V") -> float:
        """Return by what a field falls along its path, exp(-alpha L): alpha [1/m]. Args and raises as `specific`."""
        return _NP_M * sum(self.specific(frequency, polarization).values())


def gas(ghz: float, kelvin: float, dry_hpa: float, vapour_gm3: float) -> float:
    """Return the specific attenuation of oxygen and water vapour [dB/km] (P.676-13, eqs. 1 to 9).

    Args: ghz frequency [GHz]; kelvin temperature [K]; dry_hpa pressure of dry air [hPa]; vapour_gm3 [g/m3].
    Raises: ValueError outside 1 to 1000 GHz.
    """
    return oxygen(ghz, kelvin, dry_hpa, vapour_gm3) + vapour(ghz, kelvin, dry_hpa, vapour_gm3)


def oxygen(ghz: float, kelvin: float, dry_hpa: float, vapour_gm3: float) -> float:
    """Return the specific attenuation of oxygen and pressure-induced nitrogen [dB/km]; args and raises as `gas`."""
    _check(ghz, _HIGHEST, "gaseous attenuation")
    theta, e = 300.0 / kelvin, vapour_gm3 * kelvin / 216.7
    total = 0.0
    for f0, a1, a2, a3, a4, a5, a6 in OXYGEN:
        strength = a1 * 1e-7 * dry_hpa * theta**3 * math.exp(a2 * (1.0 - theta))
        width = a3 * 1e-4 * (dry_hpa * theta ** (0.8 - a4) + 1.1 * e * theta)
        overlap = (a5 + a6 * theta) * 1e-4 * (dry_hpa + e) * theta**0.8
        # Zeeman splitting widens the lines (eq. 6b).
        total += strength * _shape(ghz, f0, math.sqrt(width**2 + 2.25e-6), overlap)
    if dry_hpa == 0.0:
        return 0.0
    debye = 5.6e-4 * (dry_hpa + e) * theta**0.8
    nitrogen = 1.4e-12 * dry_hpa * theta**1.5 / (1.0 + 1.9e-5 * ghz**1.5)
    total += ghz * dry_hpa * theta**2 * (6.14e-5 / (debye * (1.0 + (ghz / debye) ** 2)) + nitrogen)
    return 0.1820 * ghz * total


def vapour(ghz: float, kelvin: float, dry_hpa: float, vapour_gm3: float) -> float:
    """Return the specific attenuation of water vapour [dB/km]; args and raises as `gas`."""
    _check(ghz, _HIGHEST, "gaseous attenuation")
    theta, e = 300.0 / kelvin, vapour_gm3 * kelvin / 216.7
    total = 0.0
    for f0, b1, b2, b3, b4, b5, b6 in WATER:
        strength = b1 * 1e-1 * e * theta**3.5 * math.exp(b2 * (1.0 - theta))
        width = b3 * 1e-4 * (dry_hpa * theta**b4 + b5 * e * theta**b6)
        # Doppler broadening (eq. 6b).
        width = 0.535 * width + math.sqrt(0.217 * width**2 + 2.1316e-12 * f0**2 / theta)
        total += strength * _shape(ghz, f0, width, 0.0)
    return 0.1820 * ghz * total


def _shape(f: float, f0: float, width: float, overlap: float) -> float:
    """Return the shape of a line (P.676-13, eq. 5)."""
    below, above = f0 - f, f0 + f
    near = (width - overlap * below) / (below**2 + width**2)
    return f / f0 * (near + (width - overlap * above) / (above**2 + width**2))


def rain(ghz: float, rate_mmh: float, polarization: str = "V") -> float:
    """Return the specific attenuation of rain [dB/km], k R^alpha (P.838-3, eqs. 1 to 3), over a horizontal path.

    Args: ghz frequency [GHz]; rate_mmh [mm/h]; polarization V or H. Raises: ValueError outside 1 to 1000 GHz.
    """
    if rate_mmh == 0.0:
        return 0.0
    _check(ghz, _HIGHEST, "attenuation by rain")
    k, alpha = rain_coefficients(ghz, polarization)
    return float(k * rate_mmh**alpha)


def rain_coefficients(ghz: float, polarization: str) -> tuple[float, float]:
    """Return k and alpha of rain at a frequency [GHz] for polarization V or H (P.838-3, eqs. 2 and 3)."""
    x = math.log10(ghz)
    (k_rows, k_m, k_c), (alpha_rows, alpha_m, alpha_c) = _RAIN[polarization]
    k, alpha = (sum(a * math.exp(-(((x - b) / c) ** 2)) for a, b, c in rows) for rows in (k_rows, alpha_rows))
    return 10.0 ** (k + k_m * x + k_c), alpha + alpha_m * x + alpha_c


def fog(ghz: float, liquid_gm3: float, kelvin: float) -> float:
    """Return the specific attenuation of fog [dB/km]: coefficient K_l times liquid water (P.840-8, eqs. 1 to 11).

    Args: ghz frequency [GHz]; liquid_gm3 liquid water [g/m3]; kelvin temperature [K].
    Raises: ValueError outside 1 to 200 GHz, where droplets are no longer small in wavelengths.
    """
    if liquid_gm3 == 0.0:
        return 0.0
    _check(ghz, _FOG_HIGHEST, "attenuation by fog")
    off = 300.0 / kelvin - 1.0
    static = 77.66 + 103.3 * off
    between, last = 0.0671 * static, 3.52
    first = 20.20 - 146.0 * off + 316.0 * off**2
    second = 39.8 * first
    a, b = (static - between) / (1.0 + (ghz / first) ** 2), (between - last) / (1.0 + (ghz / second) ** 2)
    real, imaginary = a + b + last, ghz * (a / first + b / second)
    eta = (2.0 + real) / imaginary
    return 0.819 * ghz / (imaginary * (1.0 + eta**2)) * liquid_gm3


def _check(ghz: float, highest: float, what: str) -> None:
    if not _LOWEST <= ghz <= highest:
        raise ValueError(f"{what} is known from {_LOWEST:g} to {highest:g} GHz, not at {ghz:g} GHz")
