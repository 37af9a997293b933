"""The unit phasor exp(-j 2 pi x) by its series, which in a loop is faster than a library's sine and cosine."""

from __future__ import annotations

import math

from raychan.compile.jit import njit


@njit(cache=True, nogil=True, forceinline=True)
def unit_phasor(turn):  # type: ignore[no-untyped-def]
    """Return cosine and sine of -2 pi times a number of turns, by their series about the nearest quarter turn."""
    quarter = math.floor(4.0 * turn + 0.5)
    x = 2.0 * math.pi * (turn - 0.25 * quarter)
    q = quarter - 4.0 * math.floor(0.25 * quarter)
    s = x * x
    sine = -1.0 / 39916800.0 + s * (1.0 / 6227020800.0 - s * (1.0 / 1307674368000.0))
    sine = x * (1.0 + s * (-1.0 / 6.0 + s * (1.0 / 120.0 + s * (-1.0 / 5040.0 + s * (1.0 / 362880.0 + s * sine)))))
    cosine = 1.0 / 40320.0 + s * (-1.0 / 3628800.0 + s * (1.0 / 479001600.0 - s * (1.0 / 87178291200.0)))
    cosine = 1.0 + s * (-0.5 + s * (1.0 / 24.0 + s * (-1.0 / 720.0 + s * cosine)))
    odd = q == 1.0 or q == 3.0
    re = sine if odd else cosine
    im = cosine if odd else sine
    return (-re if q == 1.0 or q == 2.0 else re), (im if q >= 2.0 else -im)
