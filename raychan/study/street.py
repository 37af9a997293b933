"""The scene of the trade-off study: each method's paths give a map by the same noise-free receiver."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.processing.range_doppler import range_doppler
from raychan.records import MIRROR, SCATTERER, Facets, Paths
from raychan.run.receiver import noise_equivalent_amplitude
from raychan.run.solver import solve
from raychan.signal.baseband import synthesize
from raychan.study.cases import Street
from raychan.study.methods import ADAPTIVE, MIRRORS, POINT, POINTS, UNIFORM, Run, mean_rcs
from raychan.study.ray_lattice import Echo, Window, echoes
from raychan.study.specular_points import specular_points
from raychan.tracing.legs import Leg
from raychan.tracing.mirrors import Mirror
from raychan.tracing.settings import refinement
from raychan.units import C0
from raychan.world.geometry import Geometry
from raychan.world.ray_caster import RayCaster
from raychan.world.scene import Scene

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

_FINE_SAG = 1e-4  # m: largest distance of flat facets from the surface, for the lattice methods (not measured)
_NEAR = 3.0  # m: below it, and as much from the far end, to which ranges fold, the map holds ground clutter only
_OWN = "ego"  # prefix of bodies that carry the radar


class Road:
    """A loaded scene, its facets, and the receiver."""

    def __init__(self, case: Street) -> None:
        self.scene = Scene.load(case.path)
        self.radar: Any = dataclasses.replace(self.scene.radar, noise=False)
        self.frequency = float(self.radar.waveform.middle)
        self.bounces = self.scene.model.max_bounces
        self.tolerance_db = float(self.scene.model.tolerance_db)
        self.facets = self.scene.facets(0.0)
        self.floor = noise_equivalent_amplitude(self.scene.radar, self.scene.processing)
        curved = [b.name for b in self.scene.bodies if b.name and self._takes_sag(b)]
        changes = [f"bodies.{name}.params.max_sag={_FINE_SAG}" for name in curved]
        self.fine = (self.scene.override(changes) if changes else self.scene).facets(0.0)

    def _takes_sag(self, body: Any) -> bool:
        return getattr(body, "shape", None) in ("car", "suv", "van", "lamp_post")

    @property
    def end(self) -> Floats:
        """Where the radar stands [m]."""
        return np.asarray(self.radar.position, float)

    def map_of(self, paths: Paths) -> Floats:
        """Return the noiseless range-Doppler map [W] of paths."""
        cube = synthesize(paths, self.radar)
        p = self.scene.processing
        found = range_doppler(cube, self.radar.waveform, p.range_window, p.rate_window, p.pad)
        return np.asarray(found.power[:, (found.range > _NEAR) & (found.range < found.range[-1] - _NEAR)])

    def paths_of(self, parts: list[Echo]) -> Paths:
        """Return echoes as paths without the bodies that they met."""
        wave = C0 / self.frequency / (4.0 * np.pi)
        columns = {f.name: np.concatenate([getattr(e, f.name) for e in parts]) for f in dataclasses.fields(Echo)}
        keep = columns["amplitude"] != 0.0
        n, none = int(keep.sum()), np.full((int(keep.sum()), 1), -1, np.int16)
        length, swept = columns["length"][keep], self.radar.waveform.swept
        return Paths.of(
            length=length,
            amplitude=wave * columns["amplitude"][keep] * np.exp(2j * np.pi * swept / C0 * length),
            length_rate=2.0 * columns["rate"][keep],
            departure=columns["away"][keep],
            arrival=columns["look"][keep],
            body=none,
            part=none,
            kind=np.ones((n, 1), np.int8),
            vertices=np.zeros((n, 1, 3), np.float32),
            body_names=self.facets.body_names,
            part_names=self.facets.part_names,
            tx=self.end,
            rx=self.end,
        )

    def targets(self, facets: Facets) -> Bools:
        """Return which facets belong to bodies that scatter, without the radar's own vehicle."""
        own = np.array([name.startswith(_OWN) for name in facets.body_names])
        return (facets.role[facets.body] == SCATTERER) & ~own[facets.body]


def tubes(road: Road, tolerance_db: float, checked: bool = True) -> Run:
    """Return the map by adaptive tubes as `raychan run` does: refined for a tolerance, with a check launch for the
    error."""
    since = perf_counter()
    f, s, points, geometry = road.frequency, road.radar, road.scene.points(0.0), Geometry(road.facets)
    cell = C0 / s.waveform.bandwidth
    rules = [refinement(f, tolerance_db, road.floor, cell=cell)]
    if checked:
        rules.append(refinement(f, 3.0 * tolerance_db, road.floor, jitter=0.13, cell=cell))
    paths = [solve(geometry, points, s, s.waveform.carrier, rule, road.bounces)[0] for rule in rules]
    return Run(road.map_of(paths[0]), geometry.rays, perf_counter() - since)


def converged(road: Road, tolerance_db: float) -> Floats:
    """Return the reference map, by a launch on a lattice of cuts that no method uses."""
    cell = C0 / road.radar.waveform.bandwidth
    rule = refinement(road.frequency, tolerance_db, road.floor, jitter=0.2, cell=cell)
    paths, _ = solve(road.facets, road.scene.points(0.0), road.radar, road.radar.waveform.carrier, rule, road.bounces)
    return road.map_of(paths)


def lattice(road: Road, rays: int, phased: bool) -> Run:
    """Return the map by rays on a lattice over the bodies and their images in the ground."""
    since = perf_counter()
    tracer = RayCaster(road.fine)
    outs = [Leg(end=road.end)]
    v = road.fine.vertices[road.targets(road.fine)].reshape(-1, 3)
    for facet in np.flatnonzero(road.fine.role[road.fine.body] == MIRROR)[:1]:
        first, normal = tracer.first[facet], tracer.normal[facet]
        endless = np.full(2, -np.inf), np.full(2, np.inf), np.zeros((2, 3))
        mirror = Mirror(first, normal, int(facet), int(road.fine.body[facet]), first, 1e3, *endless)
        outs.append(Leg(end=road.end, mirrors=(mirror,)))
        image = v - 2.0 * ((v - mirror.point) @ mirror.normal)[:, None] * mirror.normal
        v = np.concatenate([v, image])
    window = Window.onto(road.end, v, np.array([1.0, 0.0, 0.0]))
    s = road.radar
    found = echoes(
        tracer, window, outs, s.tx_field, s.rx_field, road.frequency, rays, road.bounces, phased, np.asarray(s.velocity)
    )  # fmt: skip
    return Run(road.map_of(road.paths_of(list(found))), tracer.rays, perf_counter() - since)


def specular(road: Road, fine: int) -> Run:
    """Return the map by specular points of single reflections, with conducting bodies."""
    since = perf_counter()
    facets = road.fine if fine else road.facets
    tracer = RayCaster(facets)
    k = 2.0 * np.pi * road.frequency / C0
    found = specular_points(tracer, road.end, k)
    mine = road.targets(facets)[found.facet]
    parts = [_direct(road, found.point[mine], found.field[mine], facets.velocity[facets.body[found.facet[mine]]])]
    return Run(road.map_of(road.paths_of(parts)), max(tracer.rays, 1), perf_counter() - since)


def as_points(road: Road, aspects: int) -> Run:
    """Return the map with each body as a point of its mean RCS at its nearest place; tables are made beforehand."""
    facets = road.facets
    mine = road.targets(facets)
    places, sigma, speed = [], [], []
    for body in np.unique(facets.body[mine]):
        v = facets.vertices[facets.body == body].reshape(-1, 3)
        near = v[np.argmin(np.linalg.norm(v - road.end, axis=1))]
        named = next(b for b in road.scene.bodies if b.name == facets.body_names[body])
        places.append(near)
        sigma.append(mean_rcs(named.geometry, aspects, 20.0, road.bounces))
        speed.append(facets.velocity[body])
    since = perf_counter()
    p = np.array(places)
    r = np.linalg.norm(p - road.end, axis=1)
    k = 2.0 * np.pi * road.frequency / C0
    field = np.sqrt(np.array(sigma) / (4.0 * np.pi)) / r**2 * np.exp(-2j * k * r)
    value = road.map_of(road.paths_of([_direct(road, p, field, np.array(speed))]))
    return Run(value, len(p), perf_counter() - since)


def _direct(road: Road, point: Floats, field: Any, velocity: Floats) -> Echo:
    """Return echoes straight from points (n, 3) of scattered field (n,) [1/m] moving at `velocity` (n, 3) [m/s]."""
    d = point - road.end
    r = np.linalg.norm(d, axis=1)
    d = d / r[:, None]
    s = road.radar
    couple = np.einsum("ij,ij->i", s.tx_field(d), s.rx_field(d))
    rate = np.einsum("ij,ij->i", velocity - np.asarray(s.velocity), d)
    return Echo(field * couple, 2.0 * r, rate, d, d)


def error_db(value: Floats, truth: Floats, depth_db: float = 30.0) -> float:
    """Return the rms error [dB] of map cells within `depth_db` of the true peak; cells without power count 90 dB below
    the peak."""
    rows = truth > truth.max() * 10.0 ** (-depth_db / 10.0)
    floor = truth.max() * 1e-9
    return float(np.sqrt(np.mean((10.0 * np.log10(np.maximum(value[rows], floor) / truth[rows])) ** 2)))


@dataclass(frozen=True)
class Effort:
    """One setting of a method for the scene."""

    method: str
    label: str
    default: bool
    run: Callable[[Road], Run]


def efforts(default_db: float, quick: bool) -> list[Effort]:
    """Return all settings of all methods for the scene whose default tolerance is `default_db`."""
    made = []
    for t in () if quick else (8.0 * default_db, default_db):
        made.append(Effort(ADAPTIVE, f"launch, {t:g} dB", False, lambda road, t=t: tubes(road, t, checked=False)))  # type: ignore[misc]
    made.append(Effort(ADAPTIVE, f"{default_db:g} dB", True, lambda road: tubes(road, default_db)))
    for method, phased in ((UNIFORM, True), (POINT, False)):
        for n in (8_000, 64_000) if quick else (8_000, 32_000, 128_000, 512_000):
            made.append(Effort(method, f"{n}", False, lambda road, n=n, phased=phased: lattice(road, n, phased)))  # type: ignore[misc]
    for i, mesh in enumerate(("plain mesh", "fine mesh")):
        made.append(Effort(MIRRORS, mesh, False, lambda road, i=i: specular(road, i)))  # type: ignore[misc]
    for n in (1, 4) if quick else (1, 4, 16):
        made.append(Effort(POINTS, f"{n} aspects", False, lambda road, n=n: as_points(road, n)))  # type: ignore[misc]
    return made


__all__ = ["Road", "converged", "efforts", "error_db", "lattice", "tubes"]
