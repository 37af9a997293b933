"""A run of a scene, stage by stage: its channel, samples, detections, and where each came from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from raychan.blas import on_one_blas_thread
from raychan.parallel import run_pair
from raychan.radar.radar import Radar
from raychan.records import MIRROR, Cube, Detections, Facets, MapError, RangeDoppler
from raychan.run.clock import Clock, Progress
from raychan.run.explanation.directions import beam_to
from raychan.run.explanation.labels import Chains, chains, provenance
from raychan.run.explanation.no_echoes import NoEcho, all_named, no_echoes_of
from raychan.run.explanation.rate_spread import claimed, launch_share, motion, without
from raychan.run.interferers import Sent, interference, never_heard
from raychan.run.ledger_entry import Entry
from raychan.run.messages.launches import overrun
from raychan.run.messages.results import counts, told
from raychan.run.path_stream import Launched
from raychan.run.preview.frame import preview_error, preview_ledger
from raychan.run.realization import realized
from raychan.run.received import notes, received
from raychan.run.receiver import detections_in, map_error, map_of, noise_of_cell, quiet_map
from raychan.run.result import ExplainedDetections, Explanation, Receiver, Result
from raychan.run.rounding import Rounding, coarse
from raychan.run.scene_channel import Channel, channel_of
from raychan.run.unmodelled import ledger
from raychan.scalars import as_text
from raychan.signal.baseband import synthesize
from raychan.signal.delay_profile import profile_of
from raychan.world.limits import SEED
from raychan.world.scene import Scene
from raychan.world.scene_files.schema import PREVIEW
from raychan.world.scene_given import check_scene

Detected = tuple[RangeDoppler, Detections, MapError]

_BELOW = 0.3  # of the amplitude of a cell's noise, a dB of tolerance: what tubes that no launch cuts may bring


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
    Returns: Result. Raises: ValueError on a tolerance or a number of bounces out of range, SceneError for no Scene.
    """
    check_scene(scene)
    seed = SEED.check("seed", seed, whole=True)
    clock = Clock(progress)
    channel = channel_of(scene, tolerance_db, max_bounces, clock)
    return result_of(scene, channel, seed, clock)


@on_one_blas_thread
def result_of(scene: Scene, channel: Channel, seed: int, clock: Clock) -> Result:
    """Return what the receiver makes of a channel, and how each detection came about."""
    radar, settings = scene.radar, scene.processing
    with clock.stage("synthesize"):
        then = scene.at(channel.geometry.facets.since)
        quiet, launched = realized(then, channel.geometry, channel.model, channel.quiet, channel.launched, seed)
        noise = radar.noise_power if radar.noise else 0.0
        others = interference(then, channel.geometry, seed)
        pdp, (cube, heard, rounding) = run_pair(
            lambda: profile_of(launched.response, radar.waveform, noise, settings.range_window),
            lambda: _received(then, channel, launched, quiet, seed, others),
        )
    names = background(channel.geometry.facets)
    with clock.stage("detect"):
        # The chains of a preview take as long as its detection; those of other runs are found beside the ledger.
        preview = channel.model.mode == PREVIEW
        (rdmap, detections, error), (by_chain, warnings) = run_pair(
            lambda: _detected(scene, channel, cube),
            lambda: (chains(launched.paths, names) if preview else None, scene.warnings),
        )
    channel = replace(channel, launched=launched)
    windows = settings.range_window, settings.rate_window
    receiver = Receiver(radar.channel_waveform, *windows, radar.power, radar.ego_speed, names)
    with clock.stage("explain"):
        no_echo = no_echoes_of(cube, rdmap, error.power, radar, settings, others)
        reasons, left_out = _explained(then, channel, (rdmap, detections, error), receiver, by_chain, no_echo)
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
        stats=channel.stats | counts(known, None if preview else tolerance),
        warnings=(
            *warnings,
            *channel.launched.notes(),
            *channel.warnings,
            *_remaining(channel, known, radar),
            *heard,
            *coarse(rounding, known, reasons, radar, settings),
            *told(known, reasons, tolerance, rdmap, left_out, radar),
            *overrun(sum(clock.timings.values()), channel.model.max_seconds),
        ),
        scene=scene.without_caches(),
        text=scene.text,
        path=as_text(scene.path.resolve()) if scene.path else "",
    )


def _remaining(channel: Channel, found: ExplainedDetections, radar: Radar) -> list[str]:
    """Return lines on what the refinement did not reach, given what was detected."""
    wave = radar.channel_waveform
    size = wave.range_resolution, wave.rate_resolution
    if channel.remains is None:
        return []
    carried = "bodies that are carried on over the frame"
    also = [what for what, held in (("merged facets", channel.geometry.merged), (carried, channel.turned)) if held]
    return channel.remains.notes((found.range, found.rate), size, found.error_db, also)


def _received(
    scene: Scene,
    channel: Channel,
    launched: Launched,
    quiet: Cube,
    seed: int,
    others: Sent,
) -> tuple[Cube, list[str], Rounding | None]:
    """Return what the receiver records of noise-free samples and what `others` send, what a user should know of it, and
    its rounding."""
    turned = channel.turned
    paths = without(launched.paths, turned.turns) if turned else launched.paths
    # Without turning bodies, fluctuation, clutter or sums in batches the quiet samples are those of the paths.
    clean = quiet if turned is None and launched.whole and quiet is channel.quiet else None
    sent = np.sum([*others.values()], axis=0) if others else None
    cube, said, rounding = received(quiet, paths, scene.radar, seed, sent, clean, turned)
    return cube, said + notes(scene.radar, launched.whole) + never_heard(scene), rounding


def _detected(scene: Scene, channel: Channel, cube: Cube) -> Detected:
    """Return the map of samples, what the receiver detects in it, and how wrong it may be."""
    radar, settings = scene.radar, scene.processing
    rdmap = map_of(cube, radar, settings)
    found, preview = detections_in(rdmap, radar, settings), channel.model.mode == PREVIEW
    return rdmap, found, preview_error(rdmap, radar, settings) if preview else _error_of(channel, radar, settings)


def _explained(
    scene: Scene,
    channel: Channel,
    detected: Detected,
    receiver: Receiver,
    by_chain: Chains | None,
    no_echo: Sequence[NoEcho],
) -> tuple[tuple[Explanation, ...], dict[str, Entry]]:
    """Return where each detection came from, and the ledger of what the run left out."""
    radar, settings, turned = scene.radar, scene.processing, channel.turned
    rdmap, found, error = detected
    paths, model, carried = channel.launched.paths, channel.model, turned.turns if turned else None
    weakest = float(found.power.min(initial=np.inf)) if len(found.power) else 0.0

    def explained() -> tuple[Explanation, ...]:
        return provenance(paths, rdmap, found, receiver, error.power, beam_to(radar, found, paths), by_chain)

    if model.mode == PREVIEW:
        return all_named(explained(), found, no_echo), preview_ledger(channel.geometry, radar, model)
    reasons, left_out = run_pair(
        explained,
        lambda: ledger(paths, channel.geometry, channel.points, radar, settings, model, weakest, scene.bodies, carried),
    )
    if turned:
        if not turned.once:
            left_out["intra-frame motion"] = motion(turned)
        reasons = claimed(reasons, paths, turned, detected, receiver, radar, settings)
    return all_named(reasons, found, no_echo), left_out


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
    share = launch_share(paths, others, turned.turns, brought, radar, settings)
    rest, others_rest = (without(x, turned.turns) for x in (paths, others))
    standing = map_error(synthesize(rest, radar), synthesize(others_rest, radar), radar, settings)
    return MapError(standing.power + doubt + share * brought + below)


def background(facets: Facets) -> tuple[str, ...]:
    """Return the names of bodies that are never targets: mirrors (the ground) and the radar's carrier 'ego...'."""
    names = zip(facets.body_names, facets.role, strict=True)
    return tuple(name for name, role in names if role == MIRROR or name.startswith("ego"))
