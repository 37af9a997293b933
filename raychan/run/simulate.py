"""A run of a scene, stage by stage: geometry, two launches, samples, detections, and where each came from."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from raychan.parallel import run_pair
from raychan.radar.beam_table import beam_of
from raychan.radar.radar import Radar
from raychan.records import MIRROR, Cube, Detections, Facets, MapError, Points, RangeDoppler
from raychan.run.clock import Clock, Progress
from raychan.run.directions import beam_to
from raychan.run.fluctuation import check
from raychan.run.interferers import interference
from raychan.run.labels import provenance
from raychan.run.ledger import Entry, ModelChoice
from raychan.run.mechanisms import choose
from raychan.run.messages import counts, merged, told, uncut
from raychan.run.micro_doppler import retraced
from raychan.run.path_stream import Launched, PathStream
from raychan.run.rate_spread import claimed, launch_share, motion, without
from raychan.run.realization import realized
from raychan.run.received import notes, received
from raychan.run.receiver import detections_in, map_error, map_of, noise_of_beam, noise_of_cell, quiet_map
from raychan.run.result import ExplainedDetections, Explanation, Receiver, Result
from raychan.run.rules import asked, check_demand, check_rule, fine_rule
from raychan.run.segments import Retraced, Traced
from raychan.run.solver import Batch, solve_into
from raychan.run.streams import Stage, stream
from raychan.run.turning import carried_on, needed
from raychan.run.unmodelled import ledger
from raychan.signal.baseband import synthesize
from raychan.signal.delay_profile import profile_of
from raychan.tracing.settings import PruneRule
from raychan.tracing.solver import Stats
from raychan.world.geometry import Geometry, geometry_of
from raychan.world.limits import SEED
from raychan.world.scene import Scene

_BELOW = 0.3  # of the amplitude of a cell's noise, a dB of tolerance: what tubes that no launch cuts may bring


@dataclass(frozen=True)
class Channel:
    """What the tracing of a scene gives: the same whatever the noise."""

    geometry: Geometry
    points: Points
    launched: Launched
    others: Launched
    """The check launch, coarser and on another lattice: it tells how wrong the fine one may be."""
    model: Any
    """The scene's, with what was asked for and what mode = "auto" chose."""
    chosen: ModelChoice | None
    stats: dict[str, Any]
    warnings: tuple[str, ...] = ()
    turned: Retraced | None = None
    """Samples of a frame that was traced more than once."""

    @property
    def quiet(self) -> Cube:
        """The samples of the frame without noise, of steady targets and without clutter."""
        return self.turned.cube if self.turned else self.launched.quiet


def simulate(
    scene: Scene,
    seed: int = 0,
    tolerance_db: float | None = None,
    max_bounces: int | None = None,
    progress: Progress | None = None,
) -> Result:
    """Run a scene from its geometry to its detections.

    Args: seed of all that is random, one stream a stage, so that equal seeds give equal bytes; tolerance_db [dB] and
    max_bounces override the scene's; progress is told how far each stage is.
    Returns: Result. Raises: ValueError on a tolerance or a number of bounces out of range.
    """
    SEED.check("seed", seed, whole=True)
    clock = Clock(progress)
    channel = channel_of(scene, tolerance_db, max_bounces, clock)
    return result_of(scene, channel, seed, clock)


def channel_of(scene: Scene, tolerance_db: float | None, max_bounces: int | None, clock: Clock) -> Channel:
    """Return the channel of a scene, from two launches; arguments and errors as those of `simulate`."""
    check_demand(scene)
    model, chosen = asked(scene.model, tolerance_db, max_bounces), None
    radar, settings = scene.radar, scene.processing
    with clock.stage("geometry"):
        geometry, points = geometry_of(scene, model.tolerance_db), scene.points(0.0)
        beam_of(radar)
    checked = check_rule(radar, settings, model)
    launch = partial(_launch, geometry, points, radar, settings.range_window)

    if model.mode == "auto":
        # The check launch, with all mechanisms, tells which of them the fine one needs.
        with clock.stage("check"):
            others, more = launch(replace(checked, diffraction=True))
            chosen = choose(others.paths, radar, settings, noise_of_beam(radar, settings), model.tolerance_db)
            model = chosen.applied_to(model)
    rule = fine_rule(radar, settings, model)
    again = needed(scene, model.retrace, rule.refinement.max_edge)
    routes: list[Batch] = []
    with clock.stage("trace"):
        fine = partial(launch, rule, progress=clock.tell, keep=routes.append if again else None)
        if chosen:
            launched, stats = fine()
        else:
            (launched, stats), (others, more) = run_pair(fine, lambda: launch(checked, heard=not again))
    turned = None
    if again:
        check(scene, carried_on(scene, model.retrace))
        with clock.stage("retrace"):
            traced = Traced(launched.paths, tuple(routes))
            turned = retraced(scene, rule, model, traced, partial(clock.tell, "retrace"))
    cost = {
        "rays": stats.rays + more.rays + (turned.rays if turned else 0),
        "tubes": stats.tubes,
        "mirror_chains": stats.legs,
        "tracings": len(turned.times) if turned else 1,
        "tolerance_db": model.tolerance_db,
    }
    said = (*uncut(geometry, stats, more), *merged(geometry))
    return Channel(geometry, points, launched, others, model, chosen, cost, said, turned)


def _launch(
    geometry: Geometry, points: Points, radar: Radar, window: str, rule: PruneRule, heard: bool = False, **options: Any
) -> tuple[Launched, Stats]:
    """Return the paths of one launch; with `heard` their samples are made at once, beside another launch."""
    stream = PathStream(radar, window)
    stats = solve_into(stream.add, geometry, points, radar, radar.waveform.carrier, rule, **options)
    launched = stream.done()
    if heard:
        _ = launched.quiet
    return launched, stats


def result_of(scene: Scene, channel: Channel, seed: int, clock: Clock) -> Result:
    """Return what the receiver makes of a channel, and how each detection came about."""
    radar, settings = scene.radar, scene.processing
    with clock.stage("synthesize"):
        quiet, launched = realized(scene, channel.geometry, channel.model, channel.quiet, channel.launched, seed)
        noise = radar.noise_power if radar.noise else 0.0
        pdp = profile_of(launched.response, radar.waveform, noise, settings.range_window)
        cube, heard = _received(scene, channel, launched, quiet, seed)
    with clock.stage("detect"):
        rdmap = map_of(cube, radar, settings)
        detections = detections_in(rdmap, radar, settings)
        error = _error_of(channel, radar, settings)
    channel = replace(channel, launched=launched)
    windows = settings.range_window, settings.rate_window
    names = background(channel.geometry.facets)
    receiver = Receiver(radar.channel_waveform, *windows, radar.power, radar.ego_speed, names)
    with clock.stage("explain"):
        reasons, left_out = _explained(scene, channel, rdmap, detections, receiver, error)
    known = ExplainedDetections.of(detections, reasons)
    tolerance = channel.model.tolerance_db
    return Result(
        paths=launched.paths,
        profile=pdp,
        cube=cube,
        rdmap=rdmap,
        detections=known,
        provenance=reasons,
        receiver=receiver,
        error=error,
        seed=seed,
        timings=clock.timings,
        ledger=left_out if channel.chosen is None else {**left_out, "model": channel.chosen},
        stats=channel.stats | counts(known, tolerance),
        warnings=(
            *scene.warnings,
            *check_demand(scene),
            *channel.launched.notes(),
            *channel.warnings,
            *heard,
            *told(known, tolerance, rdmap, left_out),
        ),
        scene=scene.without_caches(),
        text=scene.text,
        path=str(scene.path.resolve()) if scene.path else "",
    )


def _received(scene: Scene, channel: Channel, launched: Launched, quiet: Cube, seed: int) -> tuple[Cube, list[str]]:
    """Return what the receiver records of noise-free samples, and what a user should know of it."""
    turned = channel.turned
    paths = without(launched.paths, turned.turns) if turned else launched.paths
    others = interference(scene, channel.geometry, stream(seed, Stage.INTERFERENCE))
    cube, said = received(quiet, paths, scene.radar, seed, others)
    return cube, said + notes(scene.radar, launched.whole, turned is not None)


def _explained(
    scene: Scene, channel: Channel, rdmap: RangeDoppler, found: Detections, receiver: Receiver, error: MapError
) -> tuple[tuple[Explanation, ...], dict[str, Entry]]:
    """Return where each detection came from, and the ledger of what the run left out."""
    radar, settings, turned = scene.radar, scene.processing, channel.turned
    paths, model = channel.launched.paths, channel.model
    weakest = float(found.power.min(initial=np.inf)) if len(found.power) else 0.0
    reasons, left_out = run_pair(
        lambda: provenance(paths, rdmap, found, receiver, error.power, beam_to(radar, found, paths)),
        lambda: ledger(paths, channel.geometry, channel.points, radar, settings, model, weakest, scene.bodies),
    )
    if turned:
        left_out["intra-frame motion"] = motion(turned)
        brought = quiet_map(turned.turning, radar, settings)
        reasons = claimed(reasons, paths, turned.turns, brought, error.power, found, receiver)
    return reasons, left_out


def _error_of(channel: Channel, radar: Radar, settings: Any) -> MapError:
    """Return how wrong the map may be: what the two launches differ by, and what no launch cuts."""
    below = (_BELOW * channel.model.tolerance_db) ** 2 * noise_of_cell(radar, settings)
    turned, simplified = channel.turned, channel.geometry.merged
    if simplified:
        share = simplified.share(channel.model.max_bounces)
        below = below + share**2 * quiet_map(channel.quiet.samples, radar, settings)
    if turned is None:
        return MapError(map_error(channel.quiet, channel.others.quiet, radar, settings).power + below)
    paths, others = channel.launched.paths, channel.others.paths
    brought, doubt = (quiet_map(x, radar, settings) for x in (turned.turning, turned.error))
    share = launch_share(paths, others, turned.turns, radar)
    rest, others_rest = (without(x, turned.turns) for x in (paths, others))
    standing = map_error(synthesize(rest, radar), synthesize(others_rest, radar), radar, settings)
    return MapError(standing.power + doubt + share * brought + below)


def background(facets: Facets) -> tuple[str, ...]:
    """Return the names of bodies that are never targets: mirrors (the ground) and the radar's carrier 'ego...'."""
    names = zip(facets.body_names, facets.role, strict=True)
    return tuple(name for name, role in names if role == MIRROR or name.startswith("ego"))
