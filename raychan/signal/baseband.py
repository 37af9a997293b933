"""Cube: the dechirped I/Q samples that a radar's paths make.

The phase is that of radar.waveform, exact to its last quadratic term: neither 2 v t^2 S / c is dropped nor the terms of
second order in v / c, which at 30 m/s and 4 GHz still weigh -78 dB.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from raychan.radar.radar import Radar
from raychan.radar.waveform import Waveform
from raychan.records import Cube, Paths
from raychan.signal.dechirp import beat_sum
from raychan.signal.keystone import Echoes, Keystone, keystones, middle
from raychan.units import C0

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Samples = NDArray[np.complex64]

METHODS = ("auto", "nufft", "direct")
_FEW = 0.2  # paths summed directly in the time that a cell of a grid takes for each sample


def synthesize(
    paths: Paths,
    radar: Radar,
    rng: np.random.Generator | None = None,
    tolerance: float = 1e-6,
    method: str = "auto",
) -> Cube:
    """Return the samples of all receivers and chirps; with `rng`, and if the sensor has noise, thermal noise in them.

    Args: tolerance relative to the sum of the paths' |amplitude|; method nufft, direct (exact, slow), or auto: direct
    for few paths. With real sampling the samples are real parts, noise included.
    Returns: Cube; its noise power is 0 if none was added. Raises: ValueError on an unknown method or a bad tolerance.
    """
    if method not in METHODS:
        raise ValueError(f"method {method!r}: must be one of {', '.join(METHODS)}")
    if not 1e-13 <= tolerance < 1.0:
        raise ValueError(f"tolerance = {tolerance!r}: must lie from 1e-13 to 1")
    wave = radar.waveform
    growth = paths.length_rate / C0
    elements = radar.elements_world
    samples = np.zeros((len(elements), wave.n_chirps, wave.n_samples), np.complex64)
    if len(growth):
        scaled, arrival = np.sqrt(radar.power) * paths.amplitude, paths.arrival
        echoes = Echoes(paths.delay + growth * middle(wave)[0], growth, scaled, arrival)
        grids = keystones(echoes, wave, tolerance, float(np.linalg.norm(elements, axis=1).max()) / C0)
        cells = sum(grid.cells for grid, _ in grids) / (wave.n_chirps * wave.n_samples)
        if method == "direct" or (method == "auto" and len(growth) <= _FEW * cells):
            for layer, element in zip(samples, elements, strict=True):
                later = -(arrival @ element) / C0
                turned = scaled * np.exp(-2j * np.pi * wave.carrier * later)
                layer[...] = _direct(turned, paths.delay + later, growth, wave)
        else:
            _fast(samples, grids, elements)
    if not wave.complex_sampling:
        samples.imag = 0.0
    quiet = Cube(samples=samples, noise_power=0.0)
    return quiet if rng is None else noisy(quiet, radar, rng)


def noisy(quiet: Cube, radar: Radar, rng: np.random.Generator) -> Cube:
    """Return the samples with thermal noise, if the sensor has any."""
    if not radar.noise:
        return quiet
    scale = np.float32(np.sqrt(0.5 * radar.noise_power))
    samples = scale * rng.standard_normal((*quiet.samples.shape, 2), np.float32).view(np.complex64)[..., 0]
    samples += quiet.samples
    if not radar.waveform.complex_sampling:
        samples.imag = 0.0
    return Cube(samples=samples, noise_power=radar.noise_power)


def _direct(amplitude: Complexes, delay: Floats, growth: Floats, wave: Waveform) -> Complexes:
    step = wave.chirp_duration / wave.n_samples
    ramp = (wave.carrier, wave.slope, wave.repetition, step)
    a, d, g = np.ascontiguousarray(amplitude), np.ascontiguousarray(delay), np.ascontiguousarray(growth)
    return np.asarray(beat_sum(a, d, g, *ramp, wave.n_chirps, wave.n_samples))


def _fast(samples: Samples, grids: list[tuple[Keystone, Echoes]], elements: Floats) -> None:
    """Write what all receivers get, grid by grid: what a long frame needs to read off one may be gigabytes."""
    threads = os.cpu_count() or 1
    sums = samples if len(grids) == 1 else np.zeros(samples.shape, np.complex128)
    # One for all grids: to get so much anew costs more than to fill it.
    room = np.empty(max(grid.room for grid, _ in grids), np.complex128)
    with ThreadPoolExecutor(max_workers=threads) as pool:
        # As many receivers as cores: a core each. Else all cores work on one. The sums are the same.
        outer, inner = (pool.map, map) if len(elements) >= threads > 1 else (map, pool.map)
        while grids:
            grid, echoes = grids.pop()
            ready = grid.prepared(echoes, room)

            def receiver(layer: Complexes, element: Floats, grid: Keystone = grid, ready: Echoes = ready) -> None:
                total = np.zeros(layer.shape, np.complex128)
                grid.add(total, ready, element, inner)
                layer += total

            for _ in outer(receiver, sums, elements):
                pass
    if sums is not samples:
        samples[...] = sums
