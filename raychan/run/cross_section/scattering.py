"""Scattering matrix of a body by itself: launches of tubes, and the fields that their routes bring back."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from raychan.channel.transfer import transfer
from raychan.poses import theta_phi
from raychan.records import Routes
from raychan.run.cross_section.first_surface import first_surface
from raychan.tracing.contributions import Budget, Contributions
from raychan.tracing.images import Images
from raychan.tracing.legs import Leg
from raychan.tracing.shooting import Wanted, numbered_routes
from raychan.tracing.sources import Sources, depth_of, launches, source_of, sources_of
from raychan.tracing.tubes import Refinement, Tubes
from raychan.units import C0
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


@dataclass(frozen=True)
class BySource:
    """Scattering amplitudes (s, 2, 2) [m] of a launch by the source (s,) of their tubes, ascending, and the rays (s,)
    of each: those of the launch in proportion to tubes."""

    source: Sources
    amplitude: Complexes
    rays: Floats

    @staticmethod
    def of(source: Sources, gains: Complexes, rays: Floats) -> BySource:
        """Return the sums of gains (n, 2, 2) and rays (n,) of each source (n,)."""
        own, at = np.unique(source, return_inverse=True)
        flat, n = gains.reshape(-1, 4), len(own)
        sums = [np.bincount(at, x.real, n) + 1j * np.bincount(at, x.imag, n) for x in flat.T]
        return BySource(own, np.stack(sums, axis=1).reshape(n, 2, 2), np.bincount(at, rays, n).astype(float))

    @staticmethod
    def join(parts: list[BySource]) -> BySource:
        """Return the sums of several parts of a launch as one."""
        return BySource.of(
            np.concatenate([np.zeros(0, np.int64), *(p.source for p in parts)]),
            np.concatenate([np.zeros((0, 2, 2), complex), *(p.amplitude for p in parts)]),
            np.concatenate([np.zeros(0), *(p.rays for p in parts)]),
        )

    def by_bounce(self, bounces: int) -> Complexes:
        """Return the amplitudes (bounces, 2, 2) [m] by number of bounces."""
        total = np.zeros((bounces, 2, 2), complex)
        np.add.at(total, depth_of(self.source) - 1, self.amplitude)
        return total


class BodyLaunch:
    """The launches over one body, seen from two ends: `whole` ones, and further ones of some of their sources.

    Over several bounces physical optics is not reciprocal; the mean over both directions is, and that is what they
    return. For one and the same end the other direction is the transposed matrix.
    """

    def __init__(self, geometry: Geometry, ends: tuple[Leg, Leg], frequency: float, bounces: int) -> None:
        self.geometry, self.frequency, self.bounces = geometry, frequency, bounces
        leg, out = ends
        self._ways = [(leg, out)] if leg == out else [(leg, out), (out, leg)]
        self._found: dict[int, Contributions] = {}
        self._sum = np.inf  # 1/m, by the last launch

    def whole(self, rule: Refinement) -> BySource:
        """Return the amplitudes of all tubes."""
        parts = []
        for i in range(len(self._ways)):
            self._found[i] = Contributions(rule.for_depth(self.bounces), whole=self._sum)
            parts += self._over(i, self._found[i])
        found = BySource.join(parts)
        self._sum = float(np.abs(found.amplitude.sum(axis=0)).max()) / _reach(*self._ways[0])
        return found

    def again(self, rule: Refinement, source: Sources) -> BySource:
        """Return the amplitudes of some sources (s,), whose tubes are cut by another rule; what is too weak to be cut
        is judged by what the last whole launch found."""
        budget, parts = Budget(rule.for_depth(self.bounces)), list[BySource]()
        for i, wanted in launches(source, len(self.geometry.facets.body)):
            parts += self._over(i, self._found[i].frozen(budget), wanted)
        return BySource.join(parts)

    def _over(self, i: int, found: Contributions, wanted: Wanted | None = None) -> list[BySource]:
        leg, out = self._ways[i]
        parts, start = [], self.geometry.rays
        for source, gains in _gains(self.geometry, leg, out, self.frequency, self.bounces, found, (i, wanted)):
            gains = gains.transpose(0, 2, 1) if i else gains
            gains = 0.5 * (gains + gains.transpose(0, 2, 1)) if len(self._ways) == 1 else 0.5 * gains
            parts.append(BySource.of(source, gains, np.ones(len(source))))
        # Of a source before curved parts that hide each other a tube takes ten times the rays of another.
        each = (self.geometry.rays - start) / max(sum(float(p.rays.sum()) for p in parts), 1.0)
        return [replace(p, rays=each * p.rays) for p in parts]


def scattering(geometry: Geometry, leg: Leg, out: Leg, frequency: float, bounces: int, rule: Refinement) -> Complexes:
    """Return the scattering amplitudes (bounces, 2, 2) [m] of one launch, by number of bounces; sigma = 4 pi |sum|^2.

    Rows are the receiver's V, H and columns the transmitter's; V, H are theta-hat, phi-hat of the direction to which
    each end looks. Amplitudes of ends at a finite distance are scaled by their distances from the origin.
    """
    found, total = Contributions(rule.for_depth(bounces)), np.zeros((bounces, 2, 2), complex)
    for source, gains in _gains(geometry, leg, out, frequency, bounces, found, (0, None)):
        if len(source):
            total[int(depth_of(source[:1])[0]) - 1] += gains.sum(axis=0)
    return total


def _gains(
    geometry: Geometry,
    leg: Leg,
    out: Leg,
    frequency: float,
    bounces: int,
    found: Contributions,
    which: tuple[int, Wanted | None],
) -> Iterator[tuple[Sources, Complexes]]:
    """Yield the sources (n,) and amplitudes (n, 2, 2) [m] of tubes from one end to the other, batch by batch.

    Args: which number of the leg in, and what is wanted of it, if not all.
    """
    way, wanted = which
    every = np.ones(len(geometry.piece_role), bool)
    bistatic, shallow = out != leg, wanted is None or wanted.depth == 1
    scale = 4.0 * np.pi * frequency / C0 * _reach(leg, out)
    firsts: list[tuple[Sources, Complexes]] = []

    def first(tubes: Tubes, found: Contributions) -> None:
        if shallow:
            for facet, gains in first_surface(geometry, leg, out, tubes, found, frequency, _basis):
                firsts.append((source_of(way, 0, 1, facet), scale * gains))

    def each(routes: Routes, depth: int, *_: int) -> tuple[Sources, Complexes]:
        gains = transfer(routes, geometry.facets, frequency, _basis, _basis)
        return sources_of(routes, way, 0, 0, depth), scale * gains

    own, images = first if bistatic else None, Images.of(geometry, [out], [out])
    for one in numbered_routes(geometry, leg, [out], images, every, bounces, found, each, own, wanted):
        yield from firsts
        firsts.clear()
        yield one
    yield from firsts


def _reach(leg: Leg, out: Leg) -> float:
    """Return the product of the distances [m] of both ends from the origin, without those that are far."""
    return math.prod(float(np.linalg.norm(x.end)) for x in (leg, out) if not x.far)


def rounding(geometry: Geometry, ends: tuple[Leg, Leg], frequency: float, amplitude: Complexes) -> float:
    """Return what rounding may leave [m], about, where sources of amplitudes (s, 2, 2) [m] add up to nothing: their
    phases are as fine as the longest way, and so is the slope of faces seen edge on."""
    centre, radius, _ = geometry.body_spheres
    farthest = float((np.linalg.norm(centre, axis=1) + radius).max())
    way = sum(farthest + (0.0 if x.far else float(np.linalg.norm(x.end))) for x in ends)
    brought = np.abs(amplitude).sum(axis=0).max(initial=0.0)
    # A flat face that is seen square on returns its area over the wavelength.
    whole = float(geometry.area.sum()) * frequency / C0
    return float(np.finfo(float).eps * (2.0 * np.pi * frequency / C0 * way * brought + whole))


def _basis(look: Floats) -> Complexes:
    return np.stack(theta_phi(look), axis=1).astype(np.complex128)
