"""Windows: tapers over samples, chirps or array elements, by name."""

from __future__ import annotations

import re
import warnings

import numpy as np
from numpy.typing import NDArray

from raychan.scalars import shown

Floats = NDArray[np.float64]

NAMES = ("rect", "hann", "hamming", "blackman", "taylor", "chebyshev")
_SIDE_LOBE = {"taylor": 35.0, "chebyshev": 80.0}
_TAYLOR_NBAR = 5
_COSINES = {"hann": (0.5, 0.5), "hamming": (0.54, 0.46), "blackman": (0.42, 0.5, 0.08)}


def window(name: str, n: int) -> Floats:
    """Return a symmetric window (n,) with no weight wasted on zeros at its ends.

    Args: name one of NAMES; taylor and chebyshev take a side-lobe level in dB: "taylor(40)".
    Raises: ValueError on an unknown name. Source: Harris 1978.
    """
    match = re.fullmatch(r"([a-z]+)(?:\((\d+(?:\.\d*)?)\))?", name) if isinstance(name, str) else None
    kind = match[1] if match else ""
    level = float(match[2]) if match and match[2] else _SIDE_LOBE.get(kind, 0.0)
    if kind not in NAMES or (match and match[2] and not (kind in _SIDE_LOBE and 10.0 <= level <= 200.0)):
        raise ValueError(
            f"window {shown(name)}: must be one of {', '.join(NAMES)}; taylor and chebyshev may name their side lobes, "
            "as taylor(40), from 10 to 200 dB"
        )
    if n == 1 or kind == "rect":
        return np.ones(n)
    if kind in _COSINES:
        # Hann's and Blackman's windows are zero at both ends: these samples are left out.
        k = np.arange(n) if kind == "hamming" else np.arange(1, n + 1)
        turn = 2.0 * np.pi * k / (n - 1 if kind == "hamming" else n + 1)
        return np.asarray(sum((-1) ** i * a * np.cos(i * turn) for i, a in enumerate(_COSINES[kind])), np.float64)
    from scipy.signal import windows  # takes as long to import as the rest of scipy that a run needs

    if kind == "taylor":
        return np.asarray(windows.taylor(n, _TAYLOR_NBAR, level), np.float64)
    with warnings.catch_warnings():
        # Below 45 dB scipy warns about spectra; over the elements of an array such levels are common.
        warnings.simplefilter("ignore", UserWarning)
        return np.asarray(windows.chebwin(n, level), np.float64)


def check_window(where: str, name: str) -> None:
    """Raise ValueError that names the field unless it names a window."""
    try:
        window(name, 2)
    except ValueError as e:
        raise ValueError(f"{where} = {shown(name)}: {str(e).partition(': ')[2]}") from None


def processing_gain(taper: Floats) -> float:
    """Return (sum w)^2 / sum w^2: by how much a window raises a tone above white noise."""
    return float(taper.sum() ** 2 / (taper**2).sum())
