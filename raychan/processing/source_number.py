"""How many echoes a covariance shows: the minimum description length and Akaike's criterion on its eigenvalues."""

from __future__ import annotations

import numpy as np

from raychan.processing.covariance import Covariance
from raychan.scalars import is_one_of, shown

CRITERIA = ("mdl", "aic")
_LEAST = 1e-13  # of the greatest eigenvalue: rounding of double precision stands for noise where there is none


def source_number(found: Covariance, criterion: str = "mdl") -> int:
    """Return the number of sources, from 0 to p - 1, whose criterion is least.

    Args: criterion mdl (consistent for many snapshots) or aic (misses fewer weak sources, invents some).
    Raises: ValueError on another criterion. Source: Wax and Kailath 1985, eqs. 16 and 17; averaged forwards and
    backwards, half as many parameters are free (Xu, Roy and Kailath 1994).
    """
    if not is_one_of(criterion, CRITERIA):
        raise ValueError(f"criterion {shown(criterion)}: must be one of {', '.join(CRITERIA)}")
    values = np.maximum(found.eigen[0], _LEAST * max(float(found.eigen[0][0]), 1e-300))
    p, n = len(values), found.snapshots
    costs = []
    for k in range(p):
        rest = values[k:]
        fit = -n * (p - k) * (np.log(rest).mean() - np.log(rest.mean()))
        free = 0.5 * k * (2 * p - k + 1) if found.backward else k * (2 * p - k)
        costs.append(fit + (0.5 * free * np.log(n) if criterion == "mdl" else free))
    return int(np.argmin(costs))
