"""From paths to the cube: the dechirped I/Q samples of all receivers, chirps and samples, and thermal noise.

The beat phase is that of radar.waveform with all its quadratic terms: range migration 2 v t^2 S / c, and the terms of
second order in v / c, which at 30 m/s and 4 GHz bandwidth are at -78 dB.
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
_FEW = 0.2  # paths that the direct sum adds in the time the fast one takes for a cell, per sample (command not noted)


def synthesize(
    paths: Paths,
    radar: Radar,
    rng: np.random.Generator | None = None,
    tolerance: float = 1e-6,
    method: str = "auto",
) -> Cube:
    """Return the samples of all receivers and chirps, with thermal noise if `rng` is given and the radar has noise.

    Args: tolerance relative to the sum of the paths' |amplitude|; method nufft, direct (exact, slow), or auto: direct
    for few paths. With real sampling the samples are real parts, noise included.
    Returns: Cube; its noise power is 0 if none was added. Raises: ValueError on an unknown method or a bad tolerance.
    """
    if method not in METHODS:
        raise ValueError(f"method {method!r}: must be one of {', '.join(METHODS)}")
    if not 1e-13 <= tolerance < 1.0:
        raise ValueError(f"tolerance = {tolerance!r}: must lie from 1e-13 to 1")
    wave = radar.waveform
    delay_rate = paths.length_rate / C0
    elements = radar.elements_world
    samples = np.zeros((len(elements), wave.n_chirps, wave.n_samples), np.complex64)
    if len(delay_rate):
        scaled, arrival = np.sqrt(radar.power) * paths.amplitude, paths.arrival
        echoes = Echoes(paths.delay + delay_rate * middle(wave)[0], delay_rate, scaled, arrival)
        grids = keystones(echoes, wave, tolerance, float(np.linalg.norm(elements, axis=1).max()) / C0)
        cells = sum(grid.cells for grid, _ in grids) / (wave.n_chirps * wave.n_samples)
        if method == "direct" or (method == "auto" and len(delay_rate) <= _FEW * cells):
            for layer, element in zip(samples, elements, strict=True):
                later = -(arrival @ element) / C0
                turned = scaled * np.exp(-2j * np.pi * wave.carrier * later)
                layer[...] = _direct(turned, paths.delay + later, delay_rate, wave)
        else:
            _add_fast(samples, grids, elements)
    if not wave.complex_sampling:
        samples.imag = 0.0
    quiet = Cube(samples=samples, noise_power=0.0)
    return quiet if rng is None else noisy(quiet, radar, rng)


def added(one: Cube, other: Cube) -> Cube:
    """Return the sum of two cubes without noise."""
    return Cube(samples=one.samples + other.samples, noise_power=0.0)


def noisy(quiet: Cube, radar: Radar, rng: np.random.Generator) -> Cube:
    """Return the samples with thermal noise added, if the radar has noise."""
    if not radar.noise:
        return quiet
    scale = np.float32(np.sqrt(0.5 * radar.noise_power))
    samples = scale * rng.standard_normal((*quiet.samples.shape, 2), np.float32).view(np.complex64)[..., 0]
    samples += quiet.samples
    if not radar.waveform.complex_sampling:
        samples.imag = 0.0
    return Cube(samples=samples, noise_power=radar.noise_power)


def _direct(amplitude: Complexes, delay: Floats, delay_rate: Floats, wave: Waveform) -> Complexes:
    """Return the samples (chirps, samples) of one receiver by the exact sum."""
    step = wave.chirp_duration / wave.n_samples
    ramp = (wave.carrier, wave.slope, wave.repetition, step)
    a, d, g = np.ascontiguousarray(amplitude), np.ascontiguousarray(delay), np.ascontiguousarray(delay_rate)
    return np.asarray(beat_sum(a, d, g, *ramp, wave.n_chirps, wave.n_samples))


def _add_fast(samples: Samples, grids: list[tuple[Keystone, Echoes]], elements: Floats) -> None:
    """Write the samples of all receivers, one grid after the other: of a long frame each may take gigabytes."""
    threads = os.cpu_count() or 1
    sums = samples if len(grids) == 1 else np.zeros(samples.shape, np.complex128)
    # One buffer for all grids: allocating so much again costs more than filling it.
    buffer = np.empty(max(grid.factors for grid, _ in grids), np.complex128)
    with ThreadPoolExecutor(max_workers=threads) as pool:
        # At least as many receivers as cores: one core each. Else all cores work on one receiver. The sums are equal.
        outer, inner = (pool.map, map) if len(elements) >= threads > 1 else (map, pool.map)
        while grids:
            grid, echoes = grids.pop()
            ready = grid.prepared(echoes, buffer)

            def receiver(layer: Complexes, element: Floats, grid: Keystone = grid, ready: Echoes = ready) -> None:
                total = np.zeros(layer.shape, np.complex128)
                grid.add(total, ready, element, inner)
                layer += total

            for _ in outer(receiver, sums, elements):
                pass
    if sums is not samples:
        samples[...] = sums
