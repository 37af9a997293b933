"""The stages of a run as functions: trace, transfer, synthesize, range_doppler, detect. `simulate` uses the same."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.blas import on_one_blas_thread
from raychan.channel.paths import join, nothing, paths_of
from raychan.radar.declared import check_type
from raychan.radar.radar import Radar
from raychan.records import Cube, Detections, Facets, Paths, RangeDoppler
from raychan.run.instant import traced_at
from raychan.run.preview.frame import preview_noise, preview_rule
from raychan.run.preview.launch import preview_routes
from raychan.run.received import received
from raychan.run.receiver import (
    check_cube,
    check_map,
    detections_in,
    map_of,
    noise_amplitude,
    noise_equivalent_amplitude,
)
from raychan.run.refinement.scene_refinement import SceneRefinement
from raychan.run.rules import asked, check_rule, fine_rule, rule_of
from raychan.run.solver import Batch
from raychan.signal.baseband import synthesize as samples_of
from raychan.tracing.settings import PruneRule
from raychan.tracing.solver import launch_routes
from raychan.tracing.stats import Stats
from raychan.units import C0
from raychan.world.geometry import Geometry, geometry_of
from raychan.world.limits import SEED
from raychan.world.scene import Scene
from raychan.world.scene_files.schema import PREVIEW
from raychan.world.scene_given import check_scene

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SceneRoutes:
    """The routes of one launch over a scene: where waves go, no field yet.

    `geometry` of the scene at an instant of a frame, `rule` by which they were pruned, the routes in `batches`, and
    what they cost (`stats`). They serve any radar within the rule, and equal only themselves.
    """

    geometry: Geometry
    rule: PruneRule
    batches: tuple[Batch, ...]
    stats: Stats
    shift: Floats
    """By how much (2, 3) [m] transmitter and receivers have moved from the frame's start to that instant."""
    noise: float = 0.0
    """Amplitude of a path as strong as the noise of the radar that they were traced for, where that bounds paths."""

    def __len__(self) -> int:
        return sum(len(batch.kind) for batch in self.batches)

    def __copy__(self) -> SceneRoutes:
        return self  # nothing of it changes

    def __deepcopy__(self, memo: object) -> SceneRoutes:
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        # Embree's scene and the counts of threads stay here: what routes carry is asked of the facets alone.
        return _again, (self.geometry.facets, self.rule, self.batches, self.stats, self.shift, self.noise)

    def __repr__(self) -> str:
        return f"SceneRoutes({len(self):,} routes in {len(self.batches)} batches, {self.stats.rays:,} rays)"


def _again(facets: Facets, *rest: Any) -> SceneRoutes:
    """Return routes that were pickled."""
    return SceneRoutes(Geometry(facets), *rest)


@on_one_blas_thread
def trace(
    scene: Scene, tolerance_db: float | None = None, max_bounces: int | None = None, check: bool = False
) -> SceneRoutes:
    """Return the routes of a scene from its radar and back, refined where detections need it, as `simulate` does.

    Args: tolerance_db [dB] and max_bounces override the scene's; check: those of one launch, coarser and on another
    lattice. They are those of the frame's middle, from where their paths are carried back to its start.
    Raises: ValueError on a tolerance or a number of bounces out of range, SceneError for no Scene.
    """
    check_scene(scene)
    check_type("check", check, bool)
    model = asked(scene.model, tolerance_db, max_bounces)
    traced = traced_at(scene, model)
    scene, time = traced.scene, traced.time
    radar, settings, points = scene.radar, scene.processing, scene.points(0.0)
    geometry, shift = geometry_of(scene, model.tolerance_db, time), time * np.array([radar.velocity, radar.rx_motion])
    if model.mode == PREVIEW and not check:
        rule = preview_rule(radar, settings, model)
        stats = Stats()
        batches = tuple(preview_routes(geometry, points, radar, rule, stats, lambda batch: batch))
        return SceneRoutes(geometry, rule, batches, stats, shift, preview_noise(radar, settings))
    rule = (check_rule if check else fine_rule)(radar, settings, model)
    if not check and not traced.often:
        stats, launches = Stats(), list[list[Batch]]()
        refinement = SceneRefinement(geometry, points, radar, settings, model, lambda *_: None, stats, launches)
        if (first := refinement.first()) is not None:
            refinement.converged(first)
            batches = tuple(b for launch in launches for b in launch)
            return SceneRoutes(geometry, rule, batches, stats, shift, noise_amplitude(radar, settings))
    stats = Stats()
    batches = tuple(launch_routes(geometry, points, rule, stats))
    return SceneRoutes(geometry, rule, batches, stats, shift)


def _moved(radar: Radar, shift: Floats) -> Radar:
    """Return a radar whose transmitter and receivers are moved on by a shift (2, 3) [m]."""
    if not shift.any():
        return radar
    there = None if radar.rx_position is None else radar.rx_position + shift[1]
    return replace(radar, position=radar.position + shift[0], rx_position=there)


@on_one_blas_thread
def transfer(routes: SceneRoutes, radar: Radar) -> Paths:
    """Return what routes carry for a radar: gain, delay and rate of each path.

    Raises: ValueError for a radar that the routes were not traced for: elsewhere, of another carrier, of less noise, of
    more bandwidth, or with antennas that reach farther. Its polarisation, power and motion are free.
    """
    check_type("routes", routes, SceneRoutes)
    check_type("radar", radar, Radar)
    carrier, radar = radar.waveform.carrier, _moved(radar, routes.shift)
    own = replace(routes.rule.refinement, wavenumber=2.0 * np.pi * carrier / C0, cell=C0 / radar.waveform.bandwidth)
    noise = noise_equivalent_amplitude(radar, radar.processing)
    problem = routes.rule.refusal(rule_of(radar, noise, own, routes.rule.bounces))
    if problem:
        raise ValueError(f"these routes do not serve this radar: {problem}")
    facets = routes.geometry.facets
    every = (paths_of(batch, facets, radar, carrier, routes.noise) for batch in routes.batches)
    return join([nothing(facets, radar), *every])


@on_one_blas_thread
def synthesize(paths: Paths, radar: Radar, seed: int = 0) -> Cube:
    """Return the dechirped samples of a frame, with the radar's noise and impairments, without interferers.

    Args: seed of the noise: equal seeds give equal bytes. A radar with `noise=False` gives none.
    Targets are steady here: only `simulate`, which knows their bodies, draws those that fluctuate.
    """
    check_type("paths", paths, Paths)
    check_type("radar", radar, Radar)
    seed = SEED.check("seed", seed, whole=True)
    clean = samples_of(paths, radar)
    return received(clean, paths, radar, seed, clean=clean)[0]


@on_one_blas_thread
def range_doppler(cube: Cube, radar: Radar, cross: bool = False) -> RangeDoppler:
    """Return the range-Doppler map of samples, by the windows and padding of `radar.processing`.

    Args: cross: of the cross-polarised receivers of a radar with `rx_polarization="both"`, else of the co-polarised.
    Raises: ValueError for samples of another number of receivers, chirps or samples than the radar's. A cube knows no
    waveform: samples of another radar of as many give a map whose ranges and rates are wrong.
    """
    check_cube(cube, radar)
    check_type("cross", cross, bool)
    return map_of(cube, radar, radar.processing, cross)


@on_one_blas_thread
def detect(rdmap: RangeDoppler, radar: Radar) -> Detections:
    """Return what the radar's detector finds in a map, by the CFAR of `radar.processing`.

    Raises: ValueError for a map of other antennas or cells than the radar's.
    """
    check_map(rdmap, radar)
    return detections_in(rdmap, radar, radar.processing)
