"""Measures of the ship paper's laser scanner: hits, reach by reflectivity, the sea from a rolling deck, delays."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from raychan.run.cross_section.single_body import facets_of
from raychan.sensors.laser import NO_BODY, REFLECTIVITY, SEA, Scanner, SensorPoses, beams
from raychan.study.laser_deck import Deck, ranges, standing
from raychan.study.laser_detection import AMPLITUDES, BEARINGS, probability, tower
from raychan.study.laser_errors import skew
from raychan.study.validation.bench import Bench
from raychan.study.validation.measures import Seen, measure
from raychan.world.body import Body
from raychan.world.ray_caster import RayCaster

Floats = NDArray[np.float64]

_RAYS, _TRIANGLES = 100_000, 120
_SCANS = 400  # of a probability; a stratified share is right to about 1 %


@cache
def _random_hits() -> tuple[Floats, Floats]:
    """Return distances [m] of rays among random triangles: cast, and by Moeller and Trumbore in float64."""
    rng = np.random.default_rng(92)
    corners = rng.uniform(-40.0, 40.0, (_TRIANGLES, 1, 3)) + rng.uniform(-20.0, 20.0, (_TRIANGLES, 3, 3))
    mesh = trimesh.Trimesh(corners.reshape(-1, 3), np.arange(3 * _TRIANGLES).reshape(-1, 3), process=False)
    facets = facets_of(mesh, "pec", 77e9)
    origin, towards = rng.uniform(-40.0, 40.0, (_RAYS, 3)), rng.normal(size=(_RAYS, 3))
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    _, cast = RayCaster(facets).cast(origin, towards, np.full(_RAYS, -1, np.int32))
    exact = np.full(_RAYS, np.inf)
    for a, b, c in np.asarray(facets.vertices):
        met = _moller_trumbore(a, b - a, c - a, origin, towards)
        exact = np.minimum(exact, met)
    return cast, exact


def _moller_trumbore(corner: Any, one: Any, other: Any, origin: Floats, towards: Floats) -> Floats:
    """Return distances (n,) [m] to a triangle, inf beside it. Source: Moeller, Trumbore, J. Graphics Tools 2, 1997."""
    p = np.cross(towards, other)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = origin - corner
        u = np.einsum("ij,ij->i", s, p) / (p @ one)
        q = np.cross(s, one)
        v = np.einsum("ij,ij->i", towards, q) / (p @ one)
        t = q @ other / (p @ one)
        return np.where((u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t > 1e-6), t, np.inf)


@measure
def scanner_off_exact(bench: Bench) -> Seen:
    """Return how far [m] the worst of 100,000 hits is off an independent intersection; inf where one meets nothing."""
    cast, exact = _random_hits()
    if (np.isinf(cast) != np.isinf(exact)).any():
        return float("inf")
    met = np.isfinite(exact)
    return float(np.abs(cast[met] - exact[met]).max())


@measure
def scanner_front(bench: Bench) -> Seen:
    """Return the name of the body that the middle beam meets, of two boxes in line, the rear one given first."""
    names = "rear_box", "front_box"
    bodies = [
        Body(name=n, shape="box", params={"height": 9.0}, position=(x, 0.0, 0.0))
        for n, x in zip(names, (20, 10), strict=True)
    ]
    deck = _deck(0.0, standing(bodies, 1.0, 0.0))
    body = int(ranges(deck, deck.pose[None])[1][0, deck.scanner.count // 2])
    return names[body] if body >= 0 else None


def _deck(roll_deg: float, targets: Any = None) -> Deck:
    """Return a scanner 5 m over the sea at a roll."""
    pose = np.array([np.radians(roll_deg), 0.0, 0.0, 0.0, 0.0, 5.0])
    return Deck(targets or standing([], 1.0, 1.0), pose)


@measure
def scanner_spots(bench: Bench, step_deg: float, distance: float) -> Seen:
    """Return how far apart [cm] neighbouring spots are at a distance [m]."""
    scanner = Scanner(step_deg=step_deg)
    none = np.zeros(scanner.count)
    towards = beams(scanner, SensorPoses(position=np.zeros((scanner.count, 3)), yaw=none, pitch=none, roll=none))
    return float(100.0 * distance * np.linalg.norm(towards[1] - towards[0]))


@measure
def scanner_reach_rises(bench: Bench) -> Seen:
    """Return whether range never falls with the reflectivity of Table 2, and rises up to the scanner's own."""
    reach = Scanner().range_limit(np.array(sorted(REFLECTIVITY.values())))
    return bool((np.diff(reach) >= 0.0).all() and reach[0] < reach[-1] == Scanner().max_range)


@measure
def scanner_sea(bench: Bench, roll_deg: float, side: str) -> Seen:
    """Return the range [m] of the sea abeam to 'starboard' or 'port', 5 m below; None for no return."""
    deck = _deck(roll_deg)
    found = float(ranges(deck, deck.pose[None])[0][0, 0 if side == "starboard" else -1])
    return found if np.isfinite(found) else None


@measure
def scanner_returns(bench: Bench, roll_deg: float, side: str) -> Seen:
    """Return how many beams to one side of the bow meet the sea, or anything."""
    deck = _deck(roll_deg)
    _, (body,) = ranges(deck, deck.pose[None])
    half = deck.scanner.count // 2
    return int((body[:half] == SEA).sum() if side == "starboard" else (body[half:] != NO_BODY).sum())


@measure
def scanner_spread_rises(bench: Bench) -> Seen:
    """Return whether the deviation of the range of the sea abeam rises with that of the roll, 0 to 2 deg at 20 deg."""
    rng, spread = np.random.default_rng(98), []
    for sigma in np.radians([0.0, 0.5, 1.0, 1.5, 2.0]):
        deck = _deck(20.0)
        poses = np.tile(deck.pose, (_SCANS, 1))
        poses[:, 0] += sigma * rng.normal(size=_SCANS)
        spread.append(float(np.std(ranges(deck, poses)[0][:, 0])))
    return bool((np.diff(spread) > 0.0).all())


@measure
def scanner_skew(bench: Bench, rate_deg_s: float, delay: float) -> Seen:
    """Return the range error of the sea abeam by a late roll, over slope times rate times delay [s]."""
    seen, first = skew(rate_deg_s, np.array([delay]))
    return float(seen[0] / first[0])


@measure
def scanner_detection(bench: Bench, roll_deg: float, bearing_deg: float = BEARINGS[-1]) -> Seen:
    """Return the detection probability of a tower 40 m off at a bearing [deg] to port, at an amplitude of roll."""
    return probability(tower(bearing_deg), roll_deg, 0.0, _SCANS, np.random.default_rng(100))


@measure
def scanner_detection_falls(bench: Bench, along: str) -> Seen:
    """Return whether the detection probability never rises with the amplitude of 'roll' or 'pitch' up to 20 deg, and
    falls, of a tower at 45 deg."""
    deck, rng = tower(BEARINGS[1]), np.random.default_rng(100)
    both = [(a, 0.0) if along == "roll" else (0.0, a) for a in AMPLITUDES[::2]]
    found = np.array([probability(deck, float(r), float(p), _SCANS, rng) for r, p in both])
    return bool((np.diff(found) <= 0.0).all() and found[-1] < found[0])
