"""Physical constants and decibel arithmetic."""

from __future__ import annotations

from typing import Any

import numpy as np

C0 = 299_792_458.0
"""Speed of light in vacuum [m/s]."""
EPS0 = 8.854_187_8128e-12
"""Permittivity of vacuum [F/m]."""
K_BOLTZMANN = 1.380_649e-23
"""Boltzmann constant [J/K]."""
T0 = 290.0
"""Reference noise temperature [K] (IEEE)."""


def db(power: Any) -> Any:
    """Return 10 log10 of a power ratio; zero maps to -inf without a warning."""
    with np.errstate(divide="ignore"):
        return 10.0 * np.log10(power)


def undb(decibel: Any) -> Any:
    """Return the power ratio of a figure in dB."""
    return 10.0 ** (np.asarray(decibel) / 10.0)


def dbm(watt: Any) -> Any:
    """Return power in dBm of a power in W."""
    return db(watt) + 30.0


def watt(decibel_milliwatt: Any) -> Any:
    """Return power in W of a power in dBm."""
    return undb(np.asarray(decibel_milliwatt) - 30.0)
