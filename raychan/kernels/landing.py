"""Landing: how the phase of a tube will run on the surfaces that its rays meet."""

from __future__ import annotations

import numpy as np

from raychan.kernels.jit import njit
from raychan.kernels.patch import length_to


@njit(cache=True, nogil=True, error_model="numpy")
def landing_span(points, k, length, hit, first, normal, out_image, out_far, wavenumber):  # type: ignore[no-untyped-def]
    """Return by how much (n,) [rad] the two-way phase of tubes runs where they land: the least over the planes met.

    Args: k (n, 4, 3) directions after the mirror; hit (n, 4) facets met, -1 for none; first, normal (m, 3) of planes.
    """
    out = np.full(len(points), np.inf)
    p = np.empty(3)
    for i in range(len(points)):
        for r in range(4):
            f = hit[i, r]
            if f < 0 or (r > 0 and f == hit[i, r - 1]):
                continue
            low, high = np.inf, -np.inf
            for q in range(3):
                height, slope = 0.0, 0.0
                for c in range(3):
                    height += (first[f, c] - points[i, q, c]) * normal[f, c]
                    slope += k[i, q, c] * normal[f, c]
                if height * slope <= 0.0:
                    # Not all of the tube can land there: how much of it does is not known yet.
                    low, high = 0.0, 0.0
                    break
                t = height / slope
                for c in range(3):
                    p[c] = points[i, q, c] + t * k[i, q, c]
                phase = wavenumber * (length[i, q] + t + length_to(p, out_image, out_far))
                low, high = min(low, phase), max(high, phase)
            out[i] = min(out[i], high - low)
    return out
