"""Exact specular paths between two points: which planes a ray can meet, then the image method in float64."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from raychan.channel.corner_rays import departures
from raychan.channel.rates import rates
from raychan.channel.transfer import transfer
from raychan.poses import theta_phi
from raychan.radar.array import numbers
from raychan.records import NONE, REFLECT, TRANSMIT, Facets, Routes, SpecularPaths
from raychan.tracing.legs import Leg
from raychan.tracing.mirrors import Mirror
from raychan.tracing.routes import Interactions, ray_routes
from raychan.trajectories import ExactTrajectories
from raychan.world.geometry import Geometry
from raychan.world.limits import BOUNCES, PLACE, SPEED
from raychan.world.point_in_body import Place, place_of
from raychan.world.scene import Scene
from raychan.world.scene_given import check_scene

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Chain = tuple[tuple[int, int], ...]
"""Planes in order of travel: (facet, +1 or -1 for the side that is lit)."""

_ALL_PAIRS = 2_000_000  # image tests that are cheaper than looking for candidates with rays
_SEARCH_RAYS = 200_000


def specular_routes(geometry: Geometry, tx: Floats, rx: Floats, bounces: int, layers: int = 2, seed: int = 0) -> Routes:
    """Return every specular route from tx to rx with at most `bounces` reflections, line of sight included.

    All chains of planes are tried where that is affordable; else those that rays from both ends find.
    """
    tx, rx = np.asarray(tx, float), np.asarray(rx, float)
    chains: list[Chain] = [()]
    planes = _planes(geometry)
    if bounces and len(planes):
        if float(len(planes)) ** bounces <= _ALL_PAIRS:
            chains += _every_chain(geometry, planes, tx, bounces)
        else:
            chains += _found_chains(geometry, tx, rx, bounces, seed)
    return exact_routes(geometry, tx, rx, chains, bounces + layers, layers)


def _planes(geometry: Geometry) -> Ints:
    """Return the largest facet of each plane."""
    order = np.argsort(geometry.area, kind="stable")
    largest = np.full(len(geometry.plane), -1, np.int64)
    largest[geometry.plane[order]] = order
    return largest[largest >= 0]


def _every_chain(geometry: Geometry, planes: Ints, tx: Floats, bounces: int) -> list[Chain]:
    """Return all chains whose images lie in front of the planes that mirror them; level by level."""
    normal, point = geometry.normal[planes], geometry.first[planes]
    # A body about the transmitter is met from within.
    body = geometry.facets.body
    around = [place_of(geometry.facets.vertices[body == b], tx) for b in range(len(geometry.facets.role))]
    both = geometry.both_sides[planes] | (np.array(around) == Place.INSIDE)[body[planes]]
    images, last = tx[None], np.full(1, -1)
    chains: list[Chain] = [()]
    out: list[Chain] = []
    for _ in range(bounces):
        height = np.einsum("ij,nj->ni", normal, images) - np.einsum("ij,ij->i", normal, point)
        usable = np.where(both[None], np.abs(height) > 1e-9, height > 1e-9)
        usable &= np.arange(len(planes))[None] != last[:, None]
        rows, cols = np.nonzero(usable)
        images = images[rows] - 2.0 * height[rows, cols, None] * normal[cols]
        side = np.where(height[rows, cols] > 0.0, 1, -1)
        chains = [(*chains[r], (int(planes[c]), int(s))) for r, c, s in zip(rows, cols, side, strict=True)]
        last = cols
        out += chains
    return out


def _found_chains(geometry: Geometry, tx: Floats, rx: Floats, bounces: int, seed: int) -> list[Chain]:
    """Return the chains that rays from either end meet: towards points spread over all facets, and all around."""
    rng = np.random.default_rng(seed)
    found: set[Chain] = set()
    largest = np.full(len(geometry.plane), -1, np.int64)
    order = np.argsort(geometry.area, kind="stable")
    largest[geometry.plane[order]] = order
    for end, backwards in ((tx, False), (rx, True)):
        facet = rng.integers(len(geometry.plane), size=_SEARCH_RAYS // 2)
        bary = rng.dirichlet(np.ones(3), size=len(facet))
        aim = np.einsum("ni,nij->nj", bary, geometry.facets.vertices[facet]) - end
        d = np.concatenate([aim, rng.normal(size=(_SEARCH_RAYS // 2, 3))])
        d /= np.linalg.norm(d, axis=1, keepdims=True)
        p, skip = np.broadcast_to(end, d.shape).copy(), np.full(len(d), -1, np.int32)
        met = np.zeros((len(d), 0, 2), np.int64)
        for _ in range(bounces):
            hit, t = geometry.cast(p, d, skip)
            ok = hit >= 0
            if not ok.any():
                break
            p, d, hit, met = p[ok] + t[ok, None] * d[ok], d[ok], hit[ok], met[ok]
            n = geometry.normal[hit]
            slope = np.einsum("ij,ij->i", d, n)
            step = np.column_stack([largest[geometry.plane[hit]], np.where(slope < 0.0, 1, -1)])
            met = np.concatenate([met, step[:, None]], axis=1)
            d, skip = d - 2.0 * slope[:, None] * n, hit
            for row in np.unique(met.reshape(len(met), -1), axis=0).reshape(-1, met.shape[1], 2):
                chain = tuple((int(f), int(s)) for f, s in row)
                found.add(chain[::-1] if backwards else chain)
    return sorted(found, key=lambda c: (len(c), c))


def exact_routes(geometry: Geometry, tx: Floats, rx: Floats, chains: list[Chain], slots: int, layers: int) -> Routes:
    """Return the routes of the chains that are real: bounce points on their planes, in order, nothing in between."""
    rows = []
    known = {step: Mirror.of(geometry, *step) for step in {s for chain in chains for s in chain}}
    for chain in chains:
        mirrors = tuple(known[step] for step in chain)
        row = _one(geometry, Leg(end=tx, mirrors=mirrors), rx, slots, layers)
        if row is not None:
            rows.append(row)
    n = len(rows)
    length = np.array([r[0] for r in rows])
    column = [np.array([r[i] for r in rows]) for i in range(1, 5)]
    shape = (n, slots)
    facet = column[2].reshape(shape).astype(np.int32)
    body = geometry.facets.body[np.maximum(facet, 0)] if len(geometry.facets.body) else facet
    vertices, normals = (x.reshape(*shape, 3).astype(float) for x in column[:2])
    bodies, kind = np.where(facet >= 0, body, -1).astype(np.int16), column[3].reshape(shape).astype(np.int8)
    return ray_routes(tx, rx, Interactions(vertices, normals, facet, bodies, kind), length)


def _one(geometry: Geometry, leg: Leg, rx: Floats, slots: int, layers: int):  # type: ignore[no-untyped-def]
    """Return (length, vertices, normals, facets, kinds) of one chain, or None if it is not real."""
    if np.linalg.norm(rx - leg.image) == 0.0 or not leg.may_reach(rx[None], np.zeros(1))[0]:
        return None
    stops = [leg.end, *leg.mirror_points(rx[None])[0], rx]
    vertices: list[Floats] = []
    normals: list[Floats] = []
    facets: list[int] = []
    kinds: list[int] = []
    skip = np.array([-1], np.int32)
    for i, (a, b) in enumerate(pairwise(stops)):
        gap = float(np.linalg.norm(b - a))
        if gap < 1e-9:
            return None
        d = (b - a)[None] / gap
        last = i == len(leg.mirrors)
        before, mirror = leg.mirrors[i - 1] if i else None, None if last else leg.mirrors[i]
        # Both ends of a stretch lie on the lit sides of its mirrors: else an image is met beyond its mirror, or before.
        if any((p - m.point) @ m.normal <= 0.0 for p, m in ((b, before), (a, mirror)) if m is not None):
            return None
        near = np.array([max(gap * 1e-7, 1e-6)])
        aim = np.array([-1], np.int32)
        reached, passed, _ = geometry.walk(a[None], d, np.array([gap]), near, skip, aim, layers - _passes(kinds))
        if not reached[0]:
            return None
        for f in passed[0][passed[0] >= 0]:
            t = geometry.distance(np.array([f]), a[None], d)[0]
            vertices.append(a + t * d[0])
            normals.append(geometry.normal[f])
            facets.append(int(f))
            kinds.append(TRANSMIT)
        if mirror is None:
            break
        hit = _there(geometry, b, d[0], gap, mirror)
        if hit < 0:
            return None
        vertices.append(b)
        normals.append(mirror.normal)
        facets.append(hit)
        kinds.append(REFLECT)
        skip = np.array([hit], np.int32)
    free = slots - len(kinds)
    return (
        float(np.linalg.norm(rx - leg.image)),
        np.array(vertices + [rx] * free).reshape(slots, 3),
        np.array(normals + [np.zeros(3)] * free).reshape(slots, 3),
        np.array(facets + [-1] * free),
        np.array(kinds + [0] * free),
    )


def _there(geometry: Geometry, at: Floats, d: Floats, gap: float, mirror: Mirror) -> int:
    """Return the facet of a mirror that a ray, `gap` [m] long along d (3,), meets at its end, or -1.

    -1: there is none, or another body's facet lies in the same place and counts instead.
    """
    step = min(1e-3, 0.5 * gap)
    hit, t = geometry.cast((at - step * d)[None], d[None], np.array([-1], np.int32))
    if hit[0] >= 0 and geometry.plane[hit[0]] == geometry.plane[mirror.facet]:
        return int(hit[0])
    if hit[0] >= 0 and abs(t[0] - step) < geometry.touch:
        return -1
    # A layer just before the mirror was met, or float32 let the ray through an edge.
    rows = np.flatnonzero(geometry.plane == geometry.plane[mirror.facet])
    v = geometry.facets.vertices[rows]
    inward = np.cross(geometry.normal[rows, None], np.roll(v, -1, axis=1) - v)
    held = (np.einsum("fqc,fqc->fq", at - v, inward) >= 0.0).all(axis=1)
    return int(rows[np.argmax(held)]) if held.any() else -1


def _passes(kinds: list[int]) -> int:
    return sum(k == TRANSMIT for k in kinds)


def jones(routes: Routes, facets: Facets, frequency: float) -> NDArray[np.complex128]:
    """Return gains (n, 2, 2) of specular routes, rows rx V, H and columns tx V, H.

    V, H are theta-hat, phi-hat of the direction of travel at each end, so that line of sight is the identity times
    lambda / 4 pi L exp(-jkL).
    """

    def leaving(look: Floats) -> NDArray[np.complex128]:
        return np.stack(theta_phi(look), axis=1).astype(complex)

    def arriving(look: Floats) -> NDArray[np.complex128]:
        return np.stack(theta_phi(-look), axis=1).astype(complex)

    return transfer(routes, facets, frequency, leaving, arriving)


def specular_paths(
    scene: Scene,
    tx: ArrayLike,
    rx: ArrayLike,
    max_bounces: int = 3,
    tx_velocity: ArrayLike = (0.0, 0.0, 0.0),
    rx_velocity: ArrayLike = (0.0, 0.0, 0.0),
) -> SpecularPaths:
    """Return the exact specular paths between two points of a scene, line of sight included, isotropic ends.

    Of one point, tx = rx, they are those that return to it, as to a radar: then there is no line of sight.

    Args: scene; tx, rx (3,) [m]; max_bounces the most reflections; tx_velocity, rx_velocity (3,) [m/s] of the ends.
    Returns: SpecularPaths, shortest first: length [m] and length_rate [m/s] of the whole way, gain (n, 2, 2) with
    lambda / 4 pi L and the carrier phase exp(-jkL), rows the receiver's V, H, columns the transmitter's (theta-hat and
    phi-hat of the direction of travel), bodies and kind (n, d), vertices (n, d + 2, 3) [m]. Gain 0 is left out.
    Raises: ValueError for points or velocities that cannot be, SceneError for no Scene.
    Source: image method, McKown, Hamilton 1991.
    """
    check_scene(scene)
    given = {"tx": tx, "rx": rx, "tx_velocity": tx_velocity, "rx_velocity": rx_velocity}
    ends = [numbers(name, value, "(3,)") for name, value in given.items()]
    for name, end in zip(given, ends, strict=True):
        for x in end:
            (SPEED if name.endswith("velocity") else PLACE).check(name, float(x))
    max_bounces = replace(BOUNCES, low=0).check("max_bounces", max_bounces, whole=True)
    facets = scene.facets(0.0, scene.frequency)
    routes = specular_routes(Geometry(facets), ends[0], ends[1], max_bounces, scene.model.max_transmissions)
    gain = jones(routes, facets, scene.frequency)
    order = np.argsort(routes.length, kind="stable")
    order = order[np.abs(gain[order]).max(axis=(1, 2), initial=0.0) > 0.0]
    used = (routes.kind != NONE)[order]
    deep = int(used.sum(axis=1).max(initial=0))
    part = facets.part[np.maximum(routes.facet, 0)] if len(facets.part) else routes.facet
    away, look = departures(routes)
    trajectories = ExactTrajectories.of(
        departure=away[order],
        arrival=look[order],
        body=np.where(used, routes.body[order], -1)[:, :deep],
        part=np.where(used, part[order], -1).astype(np.int16)[:, :deep],
        kind=routes.kind[order, :deep],
        vertices=routes.vertices[order, :deep],
    )
    return SpecularPaths(
        length=routes.length[order],
        length_rate=2.0 * rates(routes, facets, ends[2], ends[3])[order],
        gain=gain[order],
        trajectory=np.arange(len(order), dtype=np.int32),
        trajectories=trajectories,
        body_names=facets.body_names,
        part_names=facets.part_names,
        tx=ends[0],
        rx=ends[1],
    )
