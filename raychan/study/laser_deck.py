"""A laser scanner on a ship's deck, its pose and how it moves: ranges at many poses at once, and their slopes.

A pose is (roll, pitch, yaw [rad], x, y, z [m]), angles as in `raychan.poses`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.poses import direction, rotation
from raychan.sensors.laser import NO_BODY, Scanner, Targets, first_hits
from raychan.world.body import Body
from raychan.world.ray_caster import RayCaster
from raychan.world.scene import Scene

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

POSE = ("roll", "pitch", "yaw", "x", "y", "z")
_CARRIER = 77e9  # [Hz]: bodies have materials at a carrier, which a laser does not ask for
_CHUNK = 256  # poses cast at once: 181 beams of each take 5 MB


@dataclass(frozen=True)
class Deck:
    """A scanner at a pose (6,), moving at rates (6,) [1/s], among targets."""

    targets: Targets
    pose: Floats
    rates: Floats = field(default_factory=lambda: np.zeros(6))
    scanner: Scanner = field(default_factory=Scanner)


def standing(bodies: Sequence[Body], reflectivity: float, sea_reflectivity: float) -> Targets:
    """Return bodies of one reflectivity that stand in a flat sea."""
    facets = Scene(bodies=list(bodies), frequency=_CARRIER).facets()
    return Targets(RayCaster(facets), np.full(len(bodies), reflectivity), sea_reflectivity)


def rays(scanner: Scanner, poses: Floats) -> tuple[Floats, Floats]:
    """Return origins and directions (m * n, 3) of the n beams at each of the poses (m, 6), all beams at one time."""
    angles: Any = poses[:, 2], poses[:, 1], poses[:, 0]
    turn = np.moveaxis(rotation(*angles), -1, 0)
    towards = np.einsum("mij,nj->mni", turn, direction(scanner.angles))
    origin = np.broadcast_to(poses[:, None, 3:], towards.shape)
    return np.ascontiguousarray(origin.reshape(-1, 3)), np.ascontiguousarray(towards.reshape(-1, 3))


def ranges(deck: Deck, poses: Floats) -> tuple[Floats, Ints]:
    """Return range [m], inf for none, and body (m, n) of n beams at each of the poses (m, 6)."""
    scanner, n = deck.scanner, deck.scanner.count
    found, bodies = np.full((len(poses), n), np.inf), np.full((len(poses), n), NO_BODY, np.int32)
    for i in range(0, len(poses), _CHUNK):
        some = slice(i, min(i + _CHUNK, len(poses)))
        origin, towards = rays(scanner, poses[some])
        distance, body, reflects = first_hits(scanner, deck.targets, origin, towards, np.zeros(len(origin)))
        seen = distance <= scanner.range_limit(reflects)
        found[some] = np.where(seen, distance, np.inf).reshape(-1, n)
        bodies[some] = np.where(seen, body, np.int32(NO_BODY)).reshape(-1, n)
    return found, bodies


def slopes(deck: Deck) -> Floats:
    """Return the derivatives (n, 6) [m/rad, m/m] of each beam's range by the pose, NaN where nothing is met.

    On a plane of normal N, met by a beam u from o: dr = -N.(do + r du) / (N.u), and du = w x u for a turn about w.
    """
    if deck.targets.waves is not None:
        raise ValueError("slopes on waves are not modelled: a flat sea")
    met, body = (x[0] for x in ranges(deck, deck.pose[None]))
    origin, towards = rays(deck.scanner, deck.pose[None])
    normal = np.tile([0.0, 0.0, 1.0], (len(met), 1))
    caster = deck.targets.caster
    if caster is not None:
        assert isinstance(caster, RayCaster)  # bodies of a deck stand still
        facet, _ = caster.cast(origin, towards, np.full(len(met), -1, np.int32))
        normal[body >= 0] = caster.normal[facet[body >= 0]]
    _, pitch, yaw = deck.pose[:3]
    axes = rotation(yaw, pitch)[:, 0], rotation(yaw)[:, 1], np.array([0.0, 0.0, 1.0])
    found = np.full((len(met), 6), np.nan)
    hit = body != NO_BODY
    u, n, r = towards[hit], normal[hit], met[hit]
    along = np.einsum("ij,ij->i", n, u)
    for k, axis in enumerate(axes):
        found[hit, k] = -r * np.einsum("ij,ij->i", n, np.cross(axis, u)) / along
    found[hit, 3:] = -n / along[:, None]
    return found


def stratified(count: int, rng: np.random.Generator) -> Floats:
    """Return `count` standard normal draws in random order, one from each of as many strata of equal probability.

    Their deviation scatters far less than that of independent draws. Source: McKay, Beckman and Conover 1979,
    Technometrics 21, 239-245 (Latin hypercubes).
    """
    from scipy.special import ndtri

    return np.asarray(ndtri((rng.permutation(count) + rng.uniform(size=count)) / count))
