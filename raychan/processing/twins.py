"""Which directions have a twin: another visible direction that the array cannot tell from it, exactly or in noise.

In white noise, with S the SNR in the beam, a beam towards a twin has less power by S L on average, with the deviation
sqrt(2 S L), in units of the noise; L is the share that it loses. At an end of what is visible, where a grating lobe
comes in beyond the other end, noise may push an echo over: S L is then half the square of how far, in standard
deviations of the cosine (the Cramer-Rao bound).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from raychan.processing.staggered import CLEAR
from raychan.processing.tilted import Plane, looks, plane_of
from raychan.radar.aperture import ALIKE, SAME_EDGE, Aperture
from raychan.radar.lobes import HALF

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Ints = NDArray[np.int64]
Complexes = NDArray[np.complexfloating[Any, Any]]

_UNKNOWN = 1e300  # an SNR at which no noise leaves anything open
_SIGMAS = 3.5  # of a cosine: an echo is pushed farther over an end in 0.02 % of cases (one side of a Gaussian)
_LITTLE = 1e-3  # of a cosine: a step by which the bend of a beam is told (not measured)
_PER_BEAM = 4  # directions tried per beam width of arrays with depth
_NEAR = 0.3  # of the power: a twin between the directions tried shows that much (cos^4(pi/8) of HALF, and a margin)
_SHRINKS = 8  # rounds of refining, each over half the distance: to 1/512 of a beam width, 4e-5 of the power
_BATCH = 1 << 20  # directions tried, or grating lobes, times echoes at once


def ambiguous(aperture: Aperture, cosines: Floats, snr: Floats | None = None) -> Bools:
    """Return whether each direction (n, 2) has a twin.

    Args: cosines along y and z; snr (n,) in the beam, a ratio of powers; None where it is unknown: twins are then those
    that lose less than ALIKE.
    """
    snr = np.full(len(cosines), _UNKNOWN) if snr is None else np.asarray(snr, np.float64)
    if not len(cosines):
        return np.zeros(0, bool)
    if aperture.flat or not any(aperture.scans):
        return _of_flat(aperture, cosines, snr)
    plane = plane_of(aperture)
    return _of_tilted(aperture, plane, cosines, snr) if plane.exact else _of_deep(aperture, plane, cosines, snr)


def nearest_boresight(aperture: Aperture, cosines: Floats) -> Floats:
    """Return, of directions (n, 2) and all those ahead that look quite like them to an array in a tilted plane, those
    nearest boresight."""
    if aperture.flat or not any(aperture.scans):
        return cosines
    plane = plane_of(aperture)
    return plane.nearest_boresight(cosines) if plane.exact else cosines


def nearer(aperture: Aperture, direction: Floats) -> Floats:
    """Return the directions (k, 2) nearer to boresight than one (2,), the nearest first, that look like it to an array
    nearly in a plane, but not quite: which of them it is only noise may leave open."""
    if aperture.flat or not any(aperture.scans) or (plane := plane_of(aperture)).exact:
        return np.zeros((0, 2))
    twin, at = plane.alike(direction[None], np.concatenate([np.zeros((1, 2)), plane.own.lobes.at]))
    twin = twin[(at**2).sum(axis=-1) < 1.0].reshape(-1, 3)
    own = np.sqrt(max(1.0 - float(direction @ direction), 0.0))
    twin = twin[twin[:, 0] > own + SAME_EDGE]
    twin = twin[np.argsort(-twin[:, 0], kind="stable"), 1:]
    near = _lost(aperture, np.broadcast_to(direction, twin.shape), twin) < HALF
    return np.asarray(twin[near & (_angle(direction[None], twin) > 0.5 * beam(aperture))])


def alike(aperture: Aperture) -> int:
    """Return how many directions at most, ahead or not, look quite like each."""
    if aperture.flat or not any(aperture.scans):
        return 1 + len(aperture.skewed)
    plane = plane_of(aperture)
    return 2 * (1 + int((plane.own.lobes.lost <= ALIKE).sum())) if plane.exact else 1


def neighbours(aperture: Aperture, at: Floats) -> Ints:
    """Return the directions (g, k) beside each (g, 2) of `Aperture.spread`, itself among them."""
    look = looks(at)
    return np.asarray(cKDTree(look).query(look, min(len(at), 3**2 if all(aperture.scans) else 3))[1], np.int64)


def _of_flat(aperture: Aperture, cosines: Floats, snr: Floats) -> Bools:
    """Return what `ambiguous` does of an array whose twins are its grating lobes away."""
    out, blocks = np.zeros(len(cosines), bool), -(-len(cosines) * len(aperture.lobes.at) // _BATCH)
    for some in np.array_split(np.arange(len(cosines)), max(1, blocks)):
        out[some] = _within_lobes(aperture, cosines[some], snr[some])
    return out


def _within_lobes(aperture: Aperture, cosines: Floats, snr: Floats) -> Bools:
    """Return what `_of_flat` does of directions few enough to be held with all lobes at once."""
    lobes = aperture.lobes
    enough = _alike(lobes.lost, snr[:, None])
    twin = cosines[:, None] + lobes.at
    size = (twin**2).sum(axis=-1)
    out = (enough & (size < 1.0 + SAME_EDGE)).any(axis=1)
    near = (1.0 + 0.5 * float(min(1.0, aperture.beamwidth.min()))) ** 2
    i, k = np.nonzero(enough & (size >= 1.0 + SAME_EDGE) & (size < near) & (snr < _UNKNOWN)[:, None])
    edge = twin[i, k] / np.sqrt(size[i, k, None])
    further = _lost(aperture, cosines[i], edge) - lobes.lost[k]
    out[i[further * snr[i] < 0.5 * _SIGMAS**2]] = True
    return out


def _of_tilted(aperture: Aperture, plane: Plane, cosines: Floats, snr: Floats) -> Bools:
    """Return the same of an array in a tilted plane, to which directions on both sides of it look alike."""
    known, out = plane.own.lobes, np.zeros(len(cosines), bool)
    lobes, lost = np.concatenate([np.zeros((1, 2)), known.at]), np.concatenate([[0.0], known.lost])
    for some in np.array_split(np.arange(len(cosines)), -(-len(cosines) * len(lobes) // _BATCH)):
        twin, at = plane.alike(cosines[some], lobes)
        inside = ((at**2).sum(axis=-1) < 1.0 + SAME_EDGE)[..., None] & (twin[..., 0] > -SAME_EDGE)
        # What lies behind, or beyond all waves, noise may push over the nearest end of what is visible.
        twin[..., 0] = np.maximum(twin[..., 0], 0.0)
        twin /= np.maximum(np.linalg.norm(twin, axis=-1, keepdims=True), 1e-9)
        edge = twin @ plane.axes[1:].T
        near = (np.abs(edge - at[:, :, None]) / plane.own.beamwidth < 0.5).all(axis=-1)
        own = (twin * looks(cosines[some])[:, None, None]).sum(axis=-1) >= np.cos(0.5 * beam(aperture))
        close = inside & _alike(lost, snr[some][:, None])[..., None] & ~own
        out[some] |= close.any(axis=(1, 2))
        i, k, side = np.nonzero(near & ~inside & (snr[some] < _UNKNOWN)[:, None, None])
        other, i = twin[i, k, side, 1:], some[i]
        other, least = _climbed(aperture, cosines[i], other)
        close = least * snr[i] < 0.5 * _SIGMAS**2
        out[i[close & (_angle(cosines[i], other) > 0.5 * beam(aperture))]] = True
    return out | _beside_plane(aperture, plane, cosines, snr)


def _beside_plane(aperture: Aperture, plane: Plane, cosines: Floats, snr: Floats) -> Bools:
    """Return which directions (n, 2) noise may have moved towards the plane of a tilted array from ones that have
    images half a beam width away."""
    at = plane.along(cosines)
    bend = _lost(plane.own, at, (1.0 - _LITTLE) * at) / _LITTLE**2
    moved = _SIGMAS * np.sqrt(0.5 / np.maximum(snr * bend, 1e-9))
    at *= np.maximum(1.0 - moved, 0.0)[:, None]
    off, ahead = np.sqrt(np.maximum(1.0 - (at**2).sum(axis=1), 0.0)), at @ plane.axes[1:, 0]
    seen = ahead > off * abs(plane.axes[0, 0])
    own = _angle(cosines, plane.mirrored(cosines)[0]) <= 0.5 * beam(aperture)
    return np.asarray(own & seen & (2.0 * np.arcsin(off) > 0.5 * beam(aperture)))


def _of_deep(aperture: Aperture, plane: Plane, cosines: Floats, snr: Floats) -> Bools:
    """Return the same of an array with depth, to which no two directions differ as others do: all are tried."""
    at, out = aperture.spread(_PER_BEAM), np.zeros(len(cosines), bool)
    beside, tried = neighbours(aperture, at), aperture.steering(at).conj() / len(aperture.elements)
    for some in np.array_split(np.arange(len(cosines)), -(-len(cosines) * len(at) // _BATCH)):
        wave = tried @ aperture.steering(cosines[some]).T
        power = wave.real**2 + wave.imag**2
        g, i = np.nonzero(power > _NEAR)
        top = power[g, i] >= power[beside[g], i[:, None]].max(axis=1)
        g, i = g[top], some[i[top]]
        image, ahead = plane.mirrored(cosines[some])
        start, i = np.concatenate([at[g], image[ahead]]), np.concatenate([i, some[ahead]])
        twin, lost = _climbed(aperture, cosines[i], start)
        inside = (twin**2).sum(axis=1) < 1.0 - SAME_EDGE
        close = np.where(inside, _alike(lost, snr[i]), (lost <= ALIKE) | (lost * snr[i] < 0.5 * _SIGMAS**2))
        out[i[close & (_angle(cosines[i], twin) > 0.5 * beam(aperture))]] = True
    return out


def _alike(lost: Floats, snr: Floats) -> Bools:
    """Return whether noise leaves open which of two beams is the echo's, one of which loses a share of its power."""
    return np.asarray((lost <= ALIKE) | ((lost < HALF) & (lost * snr < CLEAR)))


def _lost(aperture: Aperture, one: Floats, other: Floats) -> Floats:
    """Return the share (p,) that beams towards cosines (p, 2) lose of waves from others."""
    wave = (aperture.steering(one).conj() * aperture.steering(other)).mean(axis=1)
    return np.asarray(1.0 - wave.real**2 - wave.imag**2)


def beam(aperture: Aperture) -> float:
    """Return the beam width [rad] of the whole extent, deep or wide."""
    inverse = np.divide(1.0, aperture.beamwidth, out=np.zeros(2), where=np.array(aperture.scans))
    return 1.0 / float(np.linalg.norm([aperture.depth, *inverse]))


def _angle(one: Floats, other: Floats) -> Floats:
    """Return the angles (p,) [rad] between directions ahead, by their cosines (p, 2)."""
    return np.asarray(np.arccos(np.clip((looks(one) * looks(other)).sum(axis=1), -1.0, 1.0)))


def _climbed(aperture: Aperture, one: Floats, other: Floats) -> tuple[Floats, Floats]:
    """Return the visible cosines (p, 2) next to others where beams lose least of waves from `one`, and what share."""
    least = _lost(aperture, one, other)
    step = beam(aperture) / _PER_BEAM
    for _ in range(_SHRINKS):
        for axis in np.flatnonzero(aperture.scans):
            for way in (-step, step):
                tried = aperture.moved(other, int(axis), way)
                tried = tried / np.maximum(np.linalg.norm(tried, axis=1, keepdims=True), 1.0)
                lost = _lost(aperture, one, tried)
                better = lost < least
                other, least = np.where(better[:, None], tried, other), np.where(better, lost, least)
        step *= 0.5
    return other, least
