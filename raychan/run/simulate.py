"""The chain: a scene becomes paths, a profile, a cube, a map and detections that know where they came from."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from raychan.parallel import run_pair
from raychan.poses import direction
from raychan.processing.cfar import Grid, fitting_guard
from raychan.processing.detection import detect
from raychan.processing.range_doppler import range_doppler
from raychan.radar.beam_table import beam_of
from raychan.radar.radar import Radar
from raychan.radar.windows import processing_gain, window
from raychan.records import MIRROR, Cube, Detections, Facets, MapError, Points, RangeDoppler, Routes
from raychan.run.labels import provenance
from raychan.run.mechanisms import Choice, choose
from raychan.run.messages import counts, told, uncut
from raychan.run.micro_doppler import needed, retraced
from raychan.run.path_stream import Launched, PathStream
from raychan.run.rate_spread import claimed, launch_share, motion, without
from raychan.run.resources import check_demand
from raychan.run.result import ExplainedDetections, Receiver, Result
from raychan.run.segments import Retraced, Traced
from raychan.run.solver import Stats, refinement, solve_into
from raychan.run.unmodelled import ledger
from raychan.signal.baseband import noisy, synthesize
from raychan.signal.delay_profile import profile_of
from raychan.tracing.tubes import Refinement
from raychan.units import C0
from raychan.world.geometry import Geometry, geometry_of
from raychan.world.limits import BOUNCES, SEED, TOLERANCE_DB
from raychan.world.scene import Scene

Progress = Callable[[str, float], None]
"""Called with the name of a stage and the share of it that is done, 0 to 1."""

_BELOW = 0.3  # of the amplitude of a cell's noise, a dB of tolerance: what tubes that no launch cuts may bring

STAGES = ("geometry", "check", "trace", "profile", "receive", "explain")


class Clock:
    """Seconds by stage; tells the progress of each."""

    def __init__(self, progress: Progress | None = None) -> None:
        self.tell = progress or (lambda stage, share: None)
        self.timings: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time a stage."""
        self.tell(name, 0.0)
        start = time.perf_counter()
        yield
        self.timings[name] = time.perf_counter() - start
        self.tell(name, 1.0)


@dataclass(frozen=True)
class Channel:
    """What the tracing of a scene gives: the same whatever the noise."""

    geometry: Geometry
    points: Points
    launched: Launched
    others: Launched
    """The coarse launch, which tells how wrong the fine one may be."""
    model: Any
    """The scene's, with what was asked for and what mode = "auto" chose."""
    chosen: Choice | None
    stats: dict[str, Any]
    warnings: tuple[str, ...] = ()
    turned: Retraced | None = None
    """Samples of a frame that was traced more than once."""


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
    return result_of(scene, trace(scene, tolerance_db, max_bounces, clock), seed, clock)


def trace(scene: Scene, tolerance_db: float | None, max_bounces: int | None, clock: Clock) -> Channel:
    """Return the channel of a scene; arguments and errors as those of `simulate`."""
    if tolerance_db is not None:
        TOLERANCE_DB.check("tolerance_db", tolerance_db)
    if max_bounces is not None:
        BOUNCES.check("max_bounces", max_bounces, whole=True)
    check_demand(scene)
    radar, settings = scene.radar, scene.processing
    changes = {k: v for k, v in (("tolerance_db", tolerance_db), ("max_bounces", max_bounces)) if v is not None}
    model = _changed(scene.model, changes)
    carrier = radar.waveform.carrier
    floor, cell = noise_equivalent_amplitude(radar, settings), C0 / radar.waveform.bandwidth
    with clock.stage("geometry"):
        geometry, points = geometry_of(scene), scene.points(0.0)
        beam_of(radar)
    rule = refinement(carrier, 3.0 * model.tolerance_db, floor, model.max_transmissions, 0.13, cell)
    bounces, chosen = model.max_bounces, None

    def launch(rule: Refinement, bounces: int, diffraction: bool, **more: Any) -> tuple[Launched, Stats]:
        gather = PathStream(radar, settings.range_window)
        stats = solve_into(gather.add, geometry, points, radar, carrier, rule, bounces, diffraction=diffraction, **more)
        return gather.done(), stats

    def coarse(diffraction: bool, heard: bool = False) -> tuple[Launched, Stats]:
        """Launch on another lattice: it tells how wrong the fine launch may be; `heard`: its samples are wanted."""
        launched, cost = launch(rule, bounces, diffraction)
        if heard:
            _ = launched.quiet
        return launched, cost

    if model.mode == "auto":
        # With all mechanisms, it first tells which are needed.
        with clock.stage("check"):
            others, more = coarse(True)
            chosen = choose(others.paths, radar, settings, noise_of_cell(radar, settings), model.tolerance_db)
            kept = {"max_bounces": chosen.bounces, "max_transmissions": chosen.transmissions}
            model = _changed(model, kept | {"diffraction": chosen.diffraction})
    with clock.stage("trace"):
        finer = refinement(carrier, model.tolerance_db, floor, model.max_transmissions, cell=cell)
        again = needed(scene, model.retrace, finer.max_edge)
        routes: list[Routes] = []

        def fine() -> tuple[Launched, Stats]:
            more = {"progress": clock.tell, "each": routes.append if again else None}
            return launch(finer, model.max_bounces, model.diffraction, **more)

        if chosen:
            launched, stats = fine()
        else:
            (launched, stats), (others, more) = run_pair(fine, lambda: coarse(model.diffraction, heard=not again))
    turned = None
    if again:
        with clock.stage("retrace"):
            turned = retraced(
                scene, finer, model, Traced(launched.paths, tuple(routes)), partial(clock.tell, "retrace")
            )
    cost = {
        "rays": stats.rays + more.rays + (turned.rays if turned else 0),
        "tubes": stats.tubes,
        "mirror_chains": stats.legs,
        "tracings": len(turned.times) if turned else 1,
        "tolerance_db": model.tolerance_db,
    }
    return Channel(geometry, points, launched, others, model, chosen, cost, uncut(geometry, stats, more), turned)


def result_of(scene: Scene, channel: Channel, seed: int, clock: Clock) -> Result:
    """Return what the receiver makes of a channel, and how each detection came about."""
    # Streams are numbered by stage, so that one more random stage leaves the others as they are.
    noise_rng = np.random.default_rng(np.random.SeedSequence(seed).spawn(1)[0])
    radar, settings = scene.radar, scene.processing
    facets, paths, others = channel.geometry.facets, channel.launched.paths, channel.others.paths
    with clock.stage("profile"):
        noise = radar.noise_power if radar.noise else 0.0
        pdp = profile_of(channel.launched.response, radar.waveform, noise, settings.range_window)
    with clock.stage("receive"):
        turned = channel.turned
        quiet = turned.cube if turned else channel.launched.quiet
        cube = noisy(quiet, radar, noise_rng)
        rdmap, detections = received(cube, radar, settings)
        below = (_BELOW * channel.model.tolerance_db) ** 2 * noise_of_cell(radar, settings)
        if turned is None:
            error = MapError(map_error(quiet, channel.others.quiet, radar, settings).power + below)
        else:
            brought, doubt = (quiet_map(x, radar, settings) for x in (turned.turning, turned.error))
            share = launch_share(paths, others, turned.turns, radar)
            rest, others_rest = (without(x, turned.turns) for x in (paths, others))
            still = map_error(synthesize(rest, radar), synthesize(others_rest, radar), radar, settings)
            error = MapError(still.power + doubt + share * brought + below)
    receiver = Receiver(
        radar.waveform,
        settings.range_window,
        settings.rate_window,
        radar.power,
        radar.ego_speed,
        background(facets),
    )
    with clock.stage("explain"):
        weakest = float(detections.power.min(initial=np.inf)) if len(detections.power) else 0.0
        reasons, left_out = run_pair(
            lambda: provenance(paths, rdmap, detections, receiver, error.power),
            lambda: ledger(
                paths, channel.geometry, channel.points, radar, settings, channel.model, weakest, scene.bodies
            ),
        )
        if turned:
            left_out["intra-frame motion"] = motion(turned)
            reasons = claimed(reasons, paths, turned.turns, brought, error.power, detections, receiver)
    known = ExplainedDetections.of(detections, reasons)
    tolerance = channel.model.tolerance_db
    return Result(
        paths=paths,
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
            *_told(channel.launched),
            *channel.warnings,
            *told(known, tolerance, rdmap, left_out),
        ),
        scene=scene.bare(),
        text=scene.text,
        path=str(scene.path.resolve()) if scene.path else "",
    )


def received(cube: Cube, radar: Radar, settings: Any) -> tuple[RangeDoppler, Detections]:
    """Return what the receiver makes of its samples; it sees nothing else of the scene."""
    rdmap = range_doppler(cube, radar.waveform, settings.range_window, settings.rate_window, settings.pad)
    # The scene file names range before rate; a map's axes are rate, then range.
    sizes = {name: cells[::-1] for name in ("guard", "train") if (cells := getattr(settings, name)) is not None}
    guard = fitting_guard(Grid.of(rdmap).count, sizes.get("guard"), sizes.get("train"))
    if guard is not None:
        sizes["guard"] = guard
    detections = detect(
        rdmap,
        pfa=settings.pfa,
        min_snr_db=settings.min_snr_db,
        method=settings.cfar,
        ego_speed=radar.ego_speed,
        windows=(settings.rate_window, settings.range_window),
        waveform=radar.waveform,
        elements=np.asarray(radar.elements),
        **sizes,
    )
    return rdmap, detections


def noise_equivalent_amplitude(radar: Radar, settings: Any) -> float:
    """Return the scattered amplitude [1/m, unit field at 1 m] of a return as strong as the noise in one cell of the
    map."""
    if not radar.noise:
        return 0.0
    # The strongest direction of both antennas, on a grid finer than any beam of use.
    azimuth, elevation = np.meshgrid(np.radians(np.arange(-90.0, 90.1, 1.0)), np.radians(np.arange(-60.0, 60.1, 1.0)))
    look = direction(azimuth.ravel(), elevation.ravel()) @ radar.axes.T
    ends = (np.linalg.norm(f(look), axis=1).max() for f in (radar.tx_field, radar.rx_field))
    amplitude = np.sqrt(noise_of_cell(radar, settings) / radar.power)
    return float(amplitude * 4.0 * np.pi / radar.waveform.wavelength / np.prod(list(ends)))


def noise_of_cell(radar: Radar, settings: Any) -> float:
    """Return the thermal noise [W] of one cell of the map; 0 when noise is off."""
    if not radar.noise:
        return 0.0
    wave = radar.waveform
    gain = processing_gain(window(settings.range_window, wave.n_samples))
    return float(radar.noise_power / gain / processing_gain(window(settings.rate_window, wave.n_chirps)))


def map_error(quiet: Cube, others: Cube, radar: Radar, settings: Any) -> MapError:
    """Return the map of what two launches differ by: the samples of one less those of the other, without noise."""
    return MapError(quiet_map(quiet.samples - others.samples, radar, settings))


def quiet_map(samples: Any, radar: Radar, settings: Any) -> Any:
    """Return the powers (v, r) [W] of the map of samples (antenna, chirp, sample) without noise."""
    cube = Cube(samples=np.asarray(samples, np.complex64), noise_power=0.0)
    windows = (settings.range_window, settings.rate_window, settings.pad)
    return range_doppler(cube, radar.waveform, *windows).power


def background(facets: Facets) -> tuple[str, ...]:
    """Return the names of bodies that are never targets: mirrors (the ground) and the radar's carrier 'ego...'."""
    names = zip(facets.body_names, facets.role, strict=True)
    return tuple(name for name, role in names if role == MIRROR or name.startswith("ego"))


def _told(launched: Launched) -> list[str]:
    """Return what to tell of a launch that had more paths than a result can hold."""
    kept = len(launched.paths.delay)
    if launched.whole:
        return []
    return [f"{launched.count:,} paths: all are in the samples, the {kept:,} strongest are kept to explain them"]


def _changed(model: Any, changes: dict[str, Any]) -> Any:
    return model.model_copy(update=changes) if changes else model
