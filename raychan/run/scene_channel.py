"""The channel of a scene: its paths from launches of tubes, and how wrong they may be."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from raychan.blas import on_one_blas_thread
from raychan.parallel import run_pair
from raychan.radar.beam_table import beam_of
from raychan.radar.radar import Radar
from raychan.records import Cube, Points
from raychan.run.clock import Clock
from raychan.run.fluctuation import check
from raychan.run.instant import Instant, traced_at
from raychan.run.ledger_entry import ModelChoice
from raychan.run.mechanisms import choose
from raychan.run.messages.launches import merged, uncut
from raychan.run.micro_doppler import carried_from_middle, retraced
from raychan.run.path_stream import MOST, Launched, PathStream
from raychan.run.preview.frame import preview_notes, preview_of
from raychan.run.refinement.scene_refinement import SceneRefinement
from raychan.run.refinement.unreached import Remains
from raychan.run.rules import asked, check_demand, check_rule, fine_rule
from raychan.run.segments import Retraced, Traced
from raychan.run.solver import Batch, solve_into
from raychan.run.turning import carried_on, passing_phases, unfollowed
from raychan.tracing.settings import PruneRule
from raychan.tracing.stats import Stats
from raychan.world.geometry import Geometry, geometry_of
from raychan.world.scene import Scene
from raychan.world.scene_files.schema import PREVIEW

_WHOLE = (
    f"the first launch brings more than {MOST:,} paths, as one for 1 dB or more does: the frame is launched twice as a "
    "whole, not refined where detections need it, and no budget (model.max_rays, max_seconds, max_memory_mb) ends that"
)


@dataclass(frozen=True)
class Channel:
    """What the tracing of a scene gives: the same whatever the noise."""

    geometry: Geometry
    points: Points
    launched: Launched
    others: Launched
    """What the newest launches are held against, to tell how wrong they may be."""
    model: Any
    """The scene's, with what was asked for and what mode = "auto" chose."""
    chosen: ModelChoice | None
    stats: dict[str, Any]
    warnings: tuple[str, ...] = ()
    turned: Retraced | None = None
    """Samples of a frame of which something is carried on, from one tracing or several."""
    remains: Remains | None = None
    """How its refinement ended."""

    @property
    def quiet(self) -> Cube:
        """The samples of the frame without noise, of steady targets and without clutter."""
        return self.turned.cube if self.turned else self.launched.quiet


@on_one_blas_thread
def channel_of(scene: Scene, tolerance_db: float | None, max_bounces: int | None, clock: Clock) -> Channel:
    """Return the channel of a scene; arguments and errors as those of `simulate`.

    It is refined where detections need it. A frame with bodies that turn, or with more paths than can be held, is
    launched twice instead, as a whole; a preview once.
    """
    said = check_demand(scene)
    model = asked(scene.model, tolerance_db, max_bounces)
    with clock.stage("geometry"):
        traced = traced_at(scene, model)
        scene, time = traced.scene, traced.time
        geometry, points = geometry_of(scene, model.tolerance_db, time), scene.points(0.0)
        beam_of(scene.radar)
    said += [*merged(geometry), *traced.notes]
    if model.mode == PREVIEW:
        with clock.stage("trace"):
            launched, stats = preview_of(geometry, points, scene.radar, scene.processing, model)
        cost = _cost(stats, stats.rays, 1, model, time)
        return Channel(geometry, points, launched, launched, model, None, cost, (*said, *preview_notes()))
    channel = None
    if not traced.often:
        channel = _refined(traced, geometry, points, model, clock)
        if channel is None:
            said.append(_WHOLE)
            if traced.carried is not None:
                said += unfollowed(traced.start, passing_phases(traced.start), None, "so many paths")
    if channel is None:
        channel = _launched_twice(traced, geometry, points, model, clock)
    return replace(channel, warnings=(*said, *channel.warnings))


def _refined(traced: Instant, geometry: Geometry, points: Points, model: Any, clock: Clock) -> Channel | None:
    """Return the channel of a scene refined where detections need it; None where it has too many paths to be held."""
    stats, radar, settings = Stats(), traced.scene.radar, traced.scene.processing
    routes: list[list[Batch]] | None = None if traced.carried is None else []
    refinement = SceneRefinement(geometry, points, radar, settings, model, clock.tell, stats, routes, begun=clock.begun)
    with clock.stage("trace"):
        first = refinement.first()
        if first is None:
            return None
        found = refinement.converged(first)
    cost = _cost(stats, stats.rays, 1, found.model, geometry.facets.since) | {"refinements": found.remains.steps}
    launched, others, said, remains = found.launched, found.others, uncut(geometry, stats), found.remains
    if refinement.coarser:
        said = (*said, _coarser(model, 2**refinement.coarser))
    turned = None
    if traced.carried is not None and routes is not None:
        with clock.stage("retrace"):
            known = Traced(launched.paths, tuple(batch for launch in routes for batch in launch))
            rule = fine_rule(radar, settings, found.model)
            tell = partial(clock.tell, "retrace")
            turned = carried_from_middle(traced.start, rule, found.model, known, traced.carried, tell)
    return Channel(geometry, points, launched, others, found.model, found.chosen, cost, said, turned, remains)


def _launched_twice(traced: Instant, geometry: Geometry, points: Points, model: Any, clock: Clock) -> Channel:
    """Return the channel of a scene by a fine launch and a coarser one on another lattice, which tells its error."""
    scene, again, chosen = traced.scene, traced.often, None
    radar, settings = scene.radar, scene.processing
    checked = check_rule(radar, settings, model)
    launch = partial(_launch, geometry, points, radar, settings.range_window)

    if model.mode == "auto":
        # The check launch, with all mechanisms, tells which of them the fine one needs.
        with clock.stage("check"):
            others, more = launch(replace(checked, diffraction=radar.rx_position is None))
            chosen = choose(others.paths, radar, settings, model.tolerance_db)
            model = chosen.applied_to(model)
    rule = fine_rule(radar, settings, model)
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
            known = Traced(launched.paths, tuple(routes))
            turned = retraced(traced.start, rule, model, known, partial(clock.tell, "retrace"))
    rays = stats.rays + more.rays + (turned.rays if turned else 0)
    cost = _cost(stats, rays, len(turned.times) if turned else 1, model, geometry.facets.since)
    return Channel(geometry, points, launched, others, model, chosen, cost, uncut(geometry, stats, more), turned)


def _coarser(model: Any, factor: int) -> str:
    return (
        f"a first launch for {model.tolerance_db:g} dB brings more than {MOST:,} paths: it is one for "
        f"{factor * model.tolerance_db:g} dB, refined where detections need it; weak echoes over several bodies may be "
        "lost"
    )


def _cost(stats: Stats, rays: int, tracings: int, model: Any, time: float) -> dict[str, Any]:
    return {
        "rays": rays,
        "tubes": stats.tubes,
        "mirror_chains": stats.legs,
        "tracings": tracings,
        "traced_at_s": time,
        "tolerance_db": model.tolerance_db,
    }


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
