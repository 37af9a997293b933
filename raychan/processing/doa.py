"""Directions of arrival from snapshots over any array: Bartlett, Capon, MUSIC, ESPRIT, phase monopulse."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from raychan.blas import on_one_blas_thread
from raychan.columns import Record, column
from raychan.processing.climb_kernels import refine_beams, snapshots_for
from raychan.processing.covariance import SUB_ARRAY, Covariance, covariance
from raychan.processing.esprit import esprit
from raychan.processing.joint_search import joint
from raychan.processing.monopulse import monopulse
from raychan.processing.near_field import NearAperture
from raychan.processing.rivals import searched
from raychan.processing.source_number import source_number
from raychan.processing.spectra import BEAMS_PER_BEAM, Bartlett, beams_of, capon, climb, music, peaks, squared
from raychan.processing.twins import ambiguous, nearer, nearest_boresight
from raychan.radar.aperture import ALIKE, Aperture
from raychan.radar.declared import check_type, reals
from raychan.scalars import is_one_of, meant, shown

Floats = NDArray[np.float64]
Complexes = NDArray[np.complexfloating[Any, Any]]

METHODS = ("bartlett", "capon", "music", "esprit", "monopulse")
_ROUNDS = 200  # of refining several echoes by turns: two a beam width apart need 3 to 10, some threes over 60
_STILL = 1e-5  # beam widths: an echo that moves less has arrived
_ROUNDING = 16.0  # times the rounding of a value: amplitudes below, relative to the strongest, are none (not measured)
_LARGEST = 1e150  # sqrt(W): its square is a power that a float holds
_EVEN = 1.0
"""Times the noise: beams whose powers differ by less leave open which is the echo's. Of 600 lone echoes before lines
and squares that elements stand off by up to 0.1 wavelengths 519 are right with 1, 475 with 12, 530 with 0, which gives
of equal ones any."""
_COUNTING = 0.5  # rows of a sub-array over the array's for counting echoes in few snapshots: MDL needs more of them


@dataclass(frozen=True)
class Directions(Record):
    """Directions of arrival in the antenna's frame, strongest first."""

    azimuth: Floats = column("n", unit="rad", doc="NaN where the array does not measure it", finite=False)
    elevation: Floats = column("n", unit="rad", doc="NaN where the array does not measure it", finite=False)
    power: Floats = column("n", unit="W", doc="mean over the snapshots, at one receiver")
    ambiguous: NDArray[np.bool_] = column("n", np.bool_, doc="another direction shows alike")


@on_one_blas_thread
def doa(
    snapshots: ArrayLike,
    elements: ArrayLike,
    wavelength: float,
    method: str = "bartlett",
    sources: int | None = None,
    criterion: str = "mdl",
    smoothing: float | None = None,
) -> Directions:
    """Return the directions of waves from their values at the elements.

    Args: snapshots (n, a) or (a,), complex [sqrt(W)]; elements (a, 3) [m] in the antenna's frame; wavelength [m];
    method: bartlett (each echo is subtracted before the next is sought), capon, music, esprit (uniform lines) or
    monopulse (one echo, uniform lines); sources, how many, or None: by criterion mdl or aic, which are asymptotic:
    of one snapshot they tell too many in about a third of cases; smoothing, rows of a sub-array over those of a uniform
    line or rectangle (1: no averaging); None takes 2/3 for fewer snapshots than elements, or coherent waves (the
    covariance shows fewer than there are), else 1. A direction whose power is below the rounding of the snapshots is
    left out. The noise is not known: `ambiguous` tells of equal ones only.
    Raises: ValueError on bad arguments, or an array that measures no angle or is unfit for the method.
    """
    check_type("wavelength", wavelength, float)
    check_type("sources", sources, int, or_none=True)
    check_type("smoothing", smoothing, float, or_none=True)
    aperture = Aperture(reals("elements", elements), float(wavelength))
    given = np.asarray(snapshots)
    if given.dtype.kind not in "iufc":
        raise ValueError(f"snapshots = {snapshots!r}: numbers are wanted")
    data = np.atleast_2d(given).astype(np.complex128)
    if data.ndim != 2 or data.shape[1] != len(aperture.elements) or not len(data) or not np.isfinite(data).all():
        raise ValueError(f"snapshots: finite numbers (n, {len(aperture.elements)}) wanted, {data.shape} given")
    if not is_one_of(method, METHODS):
        raise ValueError(f"method {shown(method)}: must be one of {', '.join(METHODS)}{meant(method, METHODS)}")
    if not any(aperture.scans):
        raise ValueError(
            "elements: too little spread along y and z, under a sixth of a wavelength; such an array measures no angle"
        )
    most = len(aperture.elements) - 1
    if sources is not None and not 0 <= sources <= most:
        raise ValueError(f"sources = {sources}: {len(aperture.elements)} elements tell 0 to {most} apart")
    if (largest := float(max(np.abs(data.real).max(), np.abs(data.imag).max()))) > _LARGEST:
        raise ValueError(f"snapshots: a value of {largest:.3g} sqrt(W); at most {_LARGEST:g}")
    size = float(np.abs(data).max())
    if size == 0.0:  # silence has no direction
        sources = 0
    data = data / (size or 1.0)
    count = _counted(data, aperture, criterion, smoothing) if sources is None else int(sources)
    made = _averaged(data, aperture, smoothing, count)
    found = estimate(data, aperture, method, count, made) if count else np.zeros((0, 2))
    waves = np.abs(amplitudes(data, aperture, found))
    share, power = (waves**2).mean(axis=0), ((size * waves) ** 2).mean(axis=0)
    order = np.argsort(-share, kind="stable")
    # What is weaker than the rounding of the snapshots is no wave.
    eps = float(np.finfo(given.dtype if given.dtype.kind in "fc" else np.float64).eps)
    order = order[share[order] > (_ROUNDING * eps) ** 2 * share.max(initial=0.0)]
    azimuth, elevation = aperture.angles(found[order])
    return Directions(azimuth, elevation, power[order], ambiguous(aperture, found[order]))


def _counted(data: Complexes, aperture: Aperture, criterion: str, smoothing: float | None) -> int:
    """Return the number of sources by a criterion; few snapshots are smoothed further than for directions."""
    if smoothing is not None or aperture.table is None:
        return source_number(covariance(data, aperture, smoothing), criterion)
    if len(data) < data.shape[1]:
        return source_number(covariance(data, aperture, _COUNTING), criterion)
    # Coherent waves are counted in sub-arrays, which share their noise: no more snapshots than there are.
    parts = replace(covariance(data, aperture, SUB_ARRAY), snapshots=len(data))
    return max(source_number(covariance(data, aperture), criterion), source_number(parts, criterion))


def _averaged(data: Complexes, aperture: Aperture, smoothing: float | None, count: int) -> Covariance:
    """Return the covariance for so many sources, averaged over sub-arrays where it shows fewer: they are coherent."""
    made = covariance(data, aperture, smoothing)
    if smoothing is not None or aperture.table is None or len(data) < data.shape[1] or source_number(made) >= count:
        return made
    return covariance(data, aperture, SUB_ARRAY)


def estimate(data: Complexes, aperture: Aperture, method: str, count: int, made: Covariance | None = None) -> Floats:
    """Return the cosines (k, 2) of at most `count` echoes in snapshots (n, a), by a method of METHODS; of directions
    alike to an array in a plane, or alike but for the noise to one nearly in a plane, those nearest boresight."""
    found = nearest_boresight(aperture, _sought(data, aperture, method, count, made))
    for k in range(len(found)):
        # Those of flat arrays, and of arrays in a tilted plane, are given so already.
        if len(near := nearer(aperture, found[k])) or len(near := _alias(aperture, found[k])):
            others = np.delete(found, k, axis=0)
            rest = data - amplitudes(data, aperture, others) @ aperture.steering(others)
            found[k] = _untold(rest, aperture, found[k], near, len(found))
    return found


def _alias(aperture: Aperture, one: Floats) -> Floats:
    """Return the direction (k, 2), none or one, nearest boresight that looks like one (2,) but for how waves bend."""
    other = aperture.far.canonical(one[None]) if isinstance(aperture, NearAperture) else one[None]
    return np.asarray(other[np.abs(other - one).max(axis=1) > 0.0])


def _untold(data: Complexes, aperture: Aperture, one: Floats, near: Floats, count: int) -> Floats:
    """Return, of cosines (2,) of one of `count` echoes and others (k, 2), nearest boresight first, the first whose beam
    sees no less of snapshots (n, a) than noise may take."""
    power = Bartlett(data)
    at, seen = climb(power, aperture, near, aperture.grid(BEAMS_PER_BEAM))
    own, size = float(power(aperture.steering(one[None]))[0]), data.shape[1]
    noise = max(float(squared(data).mean()) - own, 0.0) / max(size - count, 1)
    good = np.flatnonzero(own - seen < max(ALIKE * own, _EVEN / len(data) * noise))
    return np.asarray(at[good[0]] if len(good) else one)


def _sought(data: Complexes, aperture: Aperture, method: str, count: int, made: Covariance | None) -> Floats:
    if method == "bartlett":
        return by_turns(data, aperture, count)
    if method == "monopulse":
        start = peaks(Bartlett(data), aperture, 1, BEAMS_PER_BEAM)
        axis = 0 if aperture.scans[0] else 1
        found = np.zeros((1, 2))
        found[:, axis] = monopulse(data, aperture, np.full(len(data), start[0, axis])).mean()
        return aperture.visible(found)
    made = covariance(data, aperture) if made is None else made
    count = min(count, len(made.matrix) - 1)
    if method == "esprit":
        return esprit(made, count)
    return peaks(music(made, count) if method == "music" else capon(made), made.aperture, count)


def amplitudes(data: Complexes, aperture: Aperture, found: Floats) -> Complexes:
    """Return the least-squares amplitudes (n, k) of waves from cosines (k, 2) in snapshots (n, a)."""
    return np.asarray(data @ np.linalg.pinv(aperture.steering(found)))


def by_turns(data: Complexes, aperture: Aperture, count: int) -> Floats:
    """Return the cosines (k, 2) of `count` echoes: each is the strongest beam of what the others leave.

    All are refined by turns until none moves: for noise that is each receiver's own the maximum-likelihood estimate.
    Source: Li and Stoica 1996 (RELAX).
    """
    width = np.where(np.isfinite(aperture.beamwidth), aperture.beamwidth, 1.0)
    beams, held = beams_of(aperture, aperture.grid(2)), snapshots_for(data)
    found = np.zeros((0, 2))
    for k in range(count):
        rest = data - amplitudes(data, aperture, found) @ aperture.steering(found)
        found = np.concatenate([found, peaks(Bartlett(rest), aperture, 1, BEAMS_PER_BEAM)])
        if k > 0:
            refine_beams(found, held, beams, _ROUNDS, _STILL * width)
    if count > 1 and searched(aperture, count):
        found = joint(data, aperture, found)
    return aperture.canonical(found)
