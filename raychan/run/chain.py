"""The chain: a scene becomes paths, a profile, a cube, a map and detections that know where they came from."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from raychan.channel.profile import profile
from raychan.channel.solve import join, refinement, solve
from raychan.frames import direction
from raychan.process.detect import detect
from raychan.process.spectrum import range_doppler
from raychan.radar.sensor import Sensor
from raychan.radar.windows import processing_gain, window
from raychan.run.auto import choose
from raychan.run.ledger import ledger
from raychan.run.provenance import provenance
from raychan.run.result import Receiver, Result
from raychan.signal.cube import synthesize
from raychan.tables import MIRROR, Cube, Detections, Facets, MapError, Paths, RangeDoppler
from raychan.world.scene import Scene

Progress = Callable[[str, float], None]
"""Called with the name of a stage and the share of it that is done, 0 to 1."""

STAGES = ("geometry", "check", "trace", "profile", "receive", "explain")


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
    if tolerance_db is not None and not tolerance_db > 0.0:
        raise ValueError(f"tolerance_db = {tolerance_db:g}: must be positive")
    if max_bounces is not None and max_bounces < 1:
        raise ValueError(f"max_bounces = {max_bounces}: must be at least 1")
    tell = progress or (lambda stage, share: None)
    timings: dict[str, float] = {}

    @contextmanager
    def stage(name: str) -> Iterator[None]:
        tell(name, 0.0)
        start = time.perf_counter()
        yield
        timings[name] = time.perf_counter() - start
        tell(name, 1.0)

    # Streams are numbered by stage, so that one more random stage leaves the others as they are.
    noise_rng = np.random.default_rng(np.random.SeedSequence(seed).spawn(1)[0])
    sensor, settings = scene.sensor, scene.processing
    changes = {k: v for k, v in (("tolerance_db", tolerance_db), ("max_bounces", max_bounces)) if v is not None}
    model = _changed(scene.model, changes)
    carrier = sensor.waveform.carrier
    floor = drowned(sensor, settings)
    with stage("geometry"):
        facets, points = scene.facets(0.0), scene.points(0.0)
    # The coarse launch comes first: it tells what is needed, and later how wrong the fine one may be.
    chosen = None
    with stage("check"):
        rule = refinement(carrier, 3.0 * model.tolerance_db, floor, model.max_transmissions, jitter=0.13)
        everything = model.diffraction or model.mode == "auto"
        others, more = solve(facets, points, sensor, carrier, rule, model.max_bounces, diffraction=everything)
        if model.mode == "auto":
            cell = noise_of_cell(sensor, settings)
            chosen = choose(others, sensor, settings, cell, model.tolerance_db)
            model = _changed(
                model,
                {
                    "max_bounces": chosen.bounces,
                    "max_transmissions": chosen.transmissions,
                    "diffraction": chosen.diffraction,
                },
            )
    with stage("trace"):
        rule = refinement(carrier, model.tolerance_db, floor, model.max_transmissions)
        rule = dataclasses.replace(rule, slots=others.kind.shape[1])
        paths, stats = solve(facets, points, sensor, carrier, rule, model.max_bounces, progress, model.diffraction)
    with stage("profile"):
        noise = sensor.noise_power if sensor.noise else 0.0
        pdp = profile(paths, sensor.waveform, sensor.power, noise, settings.range_window)
    with stage("receive"):
        cube, rdmap, detections = receive(paths, sensor, settings, noise_rng)
        error = map_error(paths, others, sensor, settings)
    receiver = Receiver(
        sensor.waveform,
        settings.range_window,
        settings.rate_window,
        sensor.power,
        sensor.ego_speed,
        background(facets),
    )
    with stage("explain"):
        weakest = float(detections.power.min(initial=np.inf)) if len(detections.power) else 0.0
        left_out = ledger(paths, facets, points, sensor, settings, model, weakest)
        reasons = provenance(paths, rdmap, detections, receiver, error.power)
    return Result(
        paths=paths,
        profile=pdp,
        cube=cube,
        rdmap=rdmap,
        detections=detections,
        provenance=reasons,
        receiver=receiver,
        error=error,
        seed=seed,
        timings=timings,
        ledger=left_out if chosen is None else {**left_out, "model": chosen},
        stats={
            "rays": stats.rays + more.rays,
            "tubes": stats.tubes,
            "mirror_chains": stats.legs,
            "tolerance_db": model.tolerance_db,
            "reached_db": max((r.error_db for r in reasons), default=0.0),
        },
        warnings=tuple(scene.warnings),
        scene=scene,
        text=scene.text,
        path=str(scene.path.resolve()) if scene.path else "",
    )


def receive(
    paths: Paths, sensor: Sensor, settings: Any, rng: np.random.Generator
) -> tuple[Cube, RangeDoppler, Detections]:
    """Return what the receiver makes of the paths; it sees nothing else of the scene."""
    cube = synthesize(paths, sensor, rng)
    rdmap = range_doppler(cube, sensor.waveform, settings.range_window, settings.rate_window, settings.pad)
    # The scene file names range before rate; a map's axes are rate, then range.
    sizes = {name: cells[::-1] for name in ("guard", "train") if (cells := getattr(settings, name)) is not None}
    detections = detect(
        rdmap,
        pfa=settings.pfa,
        min_snr_db=settings.min_snr_db,
        method=settings.cfar,
        ego_speed=sensor.ego_speed,
        windows=(settings.rate_window, settings.range_window),
        waveform=sensor.waveform,
        elements=np.asarray(sensor.elements),
        **sizes,
    )
    return cube, rdmap, detections


def drowned(sensor: Sensor, settings: Any) -> float:
    """Return the scattered amplitude [1/m, unit field at 1 m] of a return as strong as the noise in one cell of the
    map."""
    if not sensor.noise:
        return 0.0
    # The strongest direction of both antennas, on a grid finer than any beam of use.
    azimuth, elevation = np.meshgrid(np.radians(np.arange(-90.0, 90.1, 1.0)), np.radians(np.arange(-60.0, 60.1, 1.0)))
    look = direction(azimuth.ravel(), elevation.ravel()) @ sensor.axes.T
    ends = (np.linalg.norm(f(look), axis=1).max() for f in (sensor.tx_field, sensor.rx_field))
    amplitude = np.sqrt(noise_of_cell(sensor, settings) / sensor.power)
    return float(amplitude * 4.0 * np.pi / sensor.waveform.wavelength / np.prod(list(ends)))


def noise_of_cell(sensor: Sensor, settings: Any) -> float:
    """Return the thermal noise [W] of one cell of the map; 0 when noise is off."""
    if not sensor.noise:
        return 0.0
    wave = sensor.waveform
    gain = processing_gain(window(settings.range_window, wave.n_samples))
    return float(sensor.noise_power / gain / processing_gain(window(settings.rate_window, wave.n_chirps)))


def map_error(paths: Paths, others: Paths, sensor: Sensor, settings: Any) -> MapError:
    """Return the map of what two launches differ by: their difference sent through the same receiver, without noise."""
    difference = join([paths, others.replace(amplitude=-others.amplitude)])
    cube = synthesize(difference, dataclasses.replace(sensor, noise=False))
    return MapError(
        range_doppler(cube, sensor.waveform, settings.range_window, settings.rate_window, settings.pad).power
    )


def background(facets: Facets) -> tuple[str, ...]:
    """Return the names of bodies that are never targets: mirrors (the ground) and the radar's carrier 'ego...'."""
    names = zip(facets.body_names, facets.role, strict=True)
    return tuple(name for name, role in names if role == MIRROR or name.startswith("ego"))


def _changed(model: Any, changes: dict[str, Any]) -> Any:
    return model.model_copy(update=changes) if changes else model
