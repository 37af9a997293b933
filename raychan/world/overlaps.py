"""Warnings on the layout of a scene: bodies that overlap, and whether any body is in view of the radar."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations, product
from typing import Any

import numpy as np

from raychan.geometry.closed_surfaces import winding
from raychan.records import MIRROR
from raychan.world.body import Body
from raychan.world.limbs import alike
from raychan.world.meshes.mesh import Floats, Mesh

Kept = dict[tuple[str, ...], tuple[tuple[Body, ...], Any]]
"""Bodies by their names, and what was found of them: a body that does not move is the same object at all times."""

_SAMPLES = 400  # points on a body's surface
_TESTS = 48  # most of these that are tested against another body
_WORK = 1_000_000  # most facets times points: bounds the time (not measured)
_DEPTH = 1e-3  # m: bodies that only touch, within rounding, do not overlap
_INSIDE = 0.75  # winding number: 1 inside a closed body, 1/2 on its surface, 0 outside
_SAME = 0.75  # share of each surface inside the other: two equal boxes have it up to a tenth of their length apart
_CROSSED = 1e-9  # of a whole wave: what rounding leaves of crossed ones
_NAMED = 10  # pairs told by name
_BEAM = 1e-6  # of the two-way peak gain, -60 dB: below, a body is outside the beam


def surface_sample(body: Body, count: int = _SAMPLES, depth: float = 0.0) -> Floats:
    """Return points (count, 3) [m], world axes, spread over a body's surface, `depth` [m] below it; always the same."""
    name = f"surface sample {count} {depth}"
    if name not in body.geometry.memo:
        body.geometry.memo[name] = _sample(body.geometry, count, depth)
    return np.asarray(body.motion.to_world(body.geometry.memo[name]))


def _sample(mesh: Mesh, count: int, depth: float) -> Floats:
    """Return the points of `surface_sample` (count, 3) [m] in the body's frame."""
    rng = np.random.default_rng(0)
    share = np.cumsum(mesh.areas)
    face = np.minimum(np.searchsorted(share, rng.random(count) * share[-1]), len(share) - 1)
    u, v = rng.random((2, count, 1))
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    a, b, c = np.moveaxis(mesh.corners[face], 1, 0)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return np.asarray(a + u * (b - a) + v * (c - a) - depth * normal)


def overlaps(bodies: Sequence[Body], opaque: Sequence[bool], kept: Kept | None = None) -> list[str]:
    """Return a line for each pair of bodies that overlap, and for each body hidden inside another; where these are
    many, for the first, and one that counts the others.

    Args: opaque: which bodies let no wave through. A body wholly inside one that lets waves in is intended; two that
    fill nearly the same space are not. kept: what was found of the same bodies at another time.
    """
    said, kept = [], {} if kept is None else kept
    solid = [i for i, body in enumerate(bodies) if body.resolved_role != MIRROR]
    around = {i: _box(bodies[i], _corners(bodies[i].geometry.bounds)) for i in solid}
    for i, k in combinations(solid, 2):
        # Only where the boxes about those of the body frames meet, all vertices are worth the time.
        if not _meet(around[i], around[k]) or alike(bodies[i], bodies[k]):
            continue
        if _meet(*(_found(kept, (bodies[j],), lambda b: _box(b, b.geometry.vertices)) for j in (i, k))):
            said += _found(kept, (bodies[i], bodies[k]), lambda a, b, i=i, k=k: _told(a, b, opaque[i], opaque[k]))
    if len(said) > _NAMED:
        others = len(said) - _NAMED
        said[_NAMED:] = [f"{others} more pairs of bodies overlap, are copies or lie in one another (bodies)"]
    return said


def _found(kept: Kept, of: tuple[Body, ...], make: Callable[..., Any]) -> Any:
    """Return what `make` finds of bodies, or found when they stood where they stand."""
    names = tuple(body.name for body in of)
    known = kept.get(names)
    if known is None or any(a is not b for a, b in zip(known[0], of, strict=True)):
        known = kept[names] = of, make(*of)
    return known[1]


def _told(one: Body, other: Body, one_opaque: bool, other_opaque: bool) -> list[str]:
    shares = _inside(one, other), _inside(other, one)
    if max(shares) == 0.0:
        return []
    inner, outer, share = (one, other, shares[0]) if shares[0] >= shares[1] else (other, one, shares[1])
    key = f"(bodies.{inner.name}.position)"
    if min(shares) > _SAME:
        return [f"bodies '{inner.name}' and '{outer.name}' fill nearly the same space: is one a copy? {key}"]
    if share == 1.0:
        hidden = other_opaque if outer is other else one_opaque
        text = f"body '{inner.name}' is wholly inside '{outer.name}', which lets nothing through {key}"
        return [text] if hidden else []
    percent = max(1, round(100.0 * share))
    return [
        f"bodies '{inner.name}' and '{outer.name}' overlap: about {percent} % of the surface of '{inner.name}' is "
        f"inside '{outer.name}' {key}"
    ]


def _meet(one: Floats, other: Floats) -> bool:
    """Return whether two boxes (2, 3) [m] overlap by more than rounding."""
    return bool((np.minimum(one[1], other[1]) - np.maximum(one[0], other[0]) > _DEPTH).all())


def _box(body: Body, points: Floats) -> Floats:
    """Return the box (2, 3) [m], world axes, about points (n, 3) [m] of a body in its own frame."""
    at = body.motion.to_world(points)
    return np.array([at.min(axis=0), at.max(axis=0)])


def _corners(bounds: Floats) -> Floats:
    """Return the corners (8, 3) of a box (2, 3)."""
    return np.array(list(product(*bounds.T)))


def _inside(body: Body, other: Body) -> float:
    """Return the approximate share of a body's surface that lies inside another body."""
    size = min(max(body.geometry.report.size), max(other.geometry.report.size))
    places = other.motion.to_body(surface_sample(body, depth=min(_DEPTH, 0.01 * size)))
    low, high = other.geometry.bounds
    near = places[((places > low) & (places < high)).all(axis=1)]
    asked = near[: max(8, min(_TESTS, _WORK // len(other.geometry.faces)))]
    if not len(asked):
        return 0.0
    corners = np.ascontiguousarray(other.geometry.corners)
    return float(np.mean([winding(corners, p) > _INSIDE for p in asked])) * len(near) / len(places)


def unseen(bodies: Sequence[Body], radar: Any) -> list[str]:
    """Return a line where no body is in view of the radar, in its beam, or within its unambiguous range."""
    things = [b for b in bodies if b.resolved_role != MIRROR and not b.name.startswith("ego")]
    if not things:
        return ["no body is in view: the scene has none but ground and the radar's own car (bodies)"]
    if unseen not in radar.kept:
        looks = _around() @ radar.axes.T, _around() @ radar.rx_axes.T
        apart = radar.rx_position is not None
        gains = _gain(radar.tx_field, looks[0]), _gain(radar.rx_field, looks[1])
        radar.kept[unseen] = float(gains[0].max() * gains[1].max() if apart else (gains[0] * gains[1]).max())
    if lost := _cross_polarized(things, radar):
        return lost
    peak, limit = radar.kept[unseen], radar.waveform.unambiguous_range
    ends = np.array([radar.position, radar.position if radar.rx_position is None else radar.rx_position], float)
    boresights = np.stack([radar.boresight, radar.rx_axes[:, 0]])
    gain, nearest, ahead = 0.0, np.inf, False
    for body in things:
        points = surface_sample(body)
        if body.rcs_dbsm is not None:
            points = np.concatenate([points, body.motion.to_world(body.target_point())[None]])
        ways = points - ends[:, None]
        far = np.maximum(np.linalg.norm(ways, axis=2), 1e-12)
        looks = ways / far[..., None]
        gain = max(gain, float((_gain(radar.tx_field, looks[0]) * _gain(radar.rx_field, looks[1])).max(initial=0.0)))
        nearest = min(nearest, float(far.mean(axis=0).min()))
        ahead = ahead or bool((np.einsum("enc,ec->en", ways, boresights) > 0.0).all(axis=0).any())
        if gain > _BEAM * peak and nearest <= limit:
            return []
    if not gain > 0.0 and not ahead:
        return ["no body is in view: all are behind the antenna (radar.yaw_deg, radar.position, bodies.*.position)"]
    if not gain > _BEAM * peak:
        return ["no body is in the beam: all are 60 dB or more under its peak (radar.yaw_deg, radar.antenna)"]
    if nearest > limit:
        return [f"no body is within the unambiguous range of {limit:.4g} m (radar.waveform.samples, bandwidth_mhz)"]
    return []


def _cross_polarized(things: Sequence[Body], radar: Any) -> list[str]:
    """Return a line where all bodies are point targets, which keep the polarisation, and the receivers hear none of
    what is sent."""
    if radar.rx_polarization == "both" or radar.rx_position is not None or any(b.rcs_dbsm is None for b in things):
        return []
    way = np.array([b.motion.to_world(b.target_point()) for b in things]) - radar.position
    far = np.linalg.norm(way, axis=1)
    look = way[far > 0.0] / far[far > 0.0, None]
    sent, heard = radar.tx_field(look), radar.rx_field(look)
    whole = np.linalg.norm(sent, axis=1) * np.linalg.norm(heard, axis=1)
    if not whole.any() or (np.abs(np.einsum("nc,nc->n", sent, heard)) > _CROSSED * whole).any():
        return []
    return [
        "no body is heard: receivers are cross-polarised to the transmitter, and targets given by rcs_dbsm return the "
        "polarisation that they meet (radar.rx_polarization, radar.polarization)"
    ]


def _gain(field: Callable[[Floats], Any], look: Floats) -> Floats:
    return np.asarray(np.linalg.norm(field(look), axis=1) ** 2)


def _around() -> Floats:
    """Return a grid of directions (n, 3) ahead, 2 deg apart, finer than practical beams."""
    azimuth, elevation = np.meshgrid(np.radians(np.arange(-90.0, 91.0, 2.0)), np.radians(np.arange(-60.0, 61.0, 2.0)))
    level = np.cos(elevation.ravel())
    return np.stack(
        [level * np.cos(azimuth.ravel()), level * np.sin(azimuth.ravel()), np.sin(elevation.ravel())], axis=1
    )
