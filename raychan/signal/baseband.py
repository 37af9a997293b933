"""From paths to the cube: the dechirped I/Q samples of all receivers, chirps and samples, and thermal noise.

The beat phase is that of radar.waveform with all its quadratic terms: range migration 2 v t^2 S / c, and the terms of
second order in v / c, which at 30 m/s and 4 GHz bandwidth are at -78 dB.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from raychan.parallel import parallel_map
from raychan.radar.array import reach
from raychan.radar.dual_paths import DualPaths, products
from raychan.radar.radar import Radar
from raychan.radar.waveform import OwnWaveform, Waveform
from raychan.records import Cube, Paths
from raychan.signal.dechirp import beat_sum
from raychan.signal.echoes import Echoes
from raychan.signal.fronts import fronts_of
from raychan.signal.keystone import Keystone, keystones, middle
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
    first: int = 0,
) -> Cube:
    """Return the samples of all receivers and chirps as sent, with thermal noise if `rng` is given and the radar has
    noise.

    Args: tolerance relative to the sum of the paths' |amplitude|; method nufft, direct (exact, slow), or auto: direct
    for few paths; first, the number in the frame of the chirp at which `paths` are given, which is then the first of
    the samples. With real sampling the samples are real parts, noise included.
    Returns: Cube; its noise power is 0 if none was added. Raises: ValueError on an unknown method or a bad tolerance.
    """
    if method not in METHODS:
        raise ValueError(f"method {method!r}: must be one of {', '.join(METHODS)}")
    if not 1e-13 <= tolerance < 1.0:
        raise ValueError(f"tolerance = {tolerance!r}: must lie from 1e-13 to 1")
    wave, elements = radar.waveform, radar.elements_world
    samples = np.zeros((len(elements), wave.n_chirps, wave.n_samples), np.complex64)
    if len(paths.length):
        sent = [one.since(first) for one in radar.transmissions]
        fronts = fronts_of(paths) if stand_apart(radar) else None
        amplitude = products(paths.amplitude, np.broadcast_to(np.sqrt(radar.power), paths.length.shape))
        echoes = Echoes(paths.delay, paths.length_rate / C0, amplitude, fronts)
        for one in sent:
            rows = samples[:, one.first :: one.step]
            if not rows.size:
                continue
            part = replace(wave, n_chirps=rows.shape[1], repetition=one.step * wave.repetition, stagger=())
            begun = echoes.after(wave.start_of(first + one.first) - wave.start_of(first), wave.carrier)
            brought = np.zeros(rows.shape, np.complex64) if one.turn else rows
            _fill(brought, begun, [(one.offset, element) for element in elements], part, tolerance, method)
            if one.turn:
                turns = one.turn * (first + np.arange(wave.n_chirps)) % 1.0
                rows += brought * np.exp(2j * np.pi * turns).astype(np.complex64)[:, None]
    if not wave.complex_sampling:
        samples.imag = 0.0
    if radar.rx_polarization == "both":
        if not isinstance(paths, DualPaths):
            raise ValueError("paths of a radar with receivers of one polarisation: transfer the routes to this one")
        co = replace(radar, rx_polarization=None)
        crossed = synthesize(paths.replace(amplitude=paths.cross), co, None, tolerance, method, first).samples
        samples = np.concatenate([samples, crossed])
    quiet = Cube(samples=samples, noise_power=0.0)
    return quiet if rng is None else noisy(quiet, radar, rng)


def stand_apart(radar: Radar) -> bool:
    """Tell whether elements stand off the radar's place, so that samples depend on where paths scatter."""
    return any(reach(radar))


def _fill(
    out: Samples, echoes: Echoes, pairs: list[tuple[Floats, Floats]], wave: Waveform, tolerance: float, method: str
) -> None:
    """Write the samples (a, chirps, samples) of ramps at equal distances between pairs of elements of one transmitter.

    Args: echoes at the start of the first ramp; the rest as for `synthesize`.
    """
    rate = echoes.delay_rate
    if isinstance(wave, OwnWaveform):
        for layer, pair in zip(out, pairs, strict=True):
            later, faster, amplitude = echoes.between(*pair)
            turned = amplitude * np.exp(-2j * np.pi * wave.carrier * later)
            layer[...] = wave.received(turned, echoes.delay + later, rate + faster)
        return
    # The grid adds the carrier's phase over the time to the middle: its amplitudes are those of the start.
    then = middle(wave)[0]
    centred = replace(echoes, delay=echoes.delay + rate * then, begun=echoes.begun + then)
    off = float(np.linalg.norm(pairs[0][0])), max(float(np.linalg.norm(rx)) for _, rx in pairs)
    sway = 0.0 if echoes.fronts is None else echoes.fronts.fastest(*off)
    grids = keystones(centred, wave, tolerance, sum(off) / C0, sway=sway / C0)
    cells = sum(grid.cells for grid, _ in grids) / (wave.n_chirps * wave.n_samples)
    if method == "direct" or (method == "auto" and len(rate) <= _FEW * cells):
        for layer, pair in zip(out, pairs, strict=True):
            later, faster, amplitude = echoes.between(*pair)
            turned = amplitude * np.exp(-2j * np.pi * wave.carrier * later)
            layer[...] = _direct(turned, echoes.delay + later, rate + faster, wave)
    else:
        _add_fast(out, grids, pairs)


def noisy(quiet: Cube, radar: Radar, rng: np.random.Generator) -> Cube:
    """Return the samples with thermal noise added, if the radar has noise; with real sampling their real parts."""
    real = not radar.waveform.complex_sampling
    if not radar.noise:
        return Cube(samples=quiet.samples.real.astype(np.complex64), noise_power=0.0) if real else quiet
    scale = np.float32(np.sqrt(0.5 * radar.noise_power))
    samples = scale * rng.standard_normal((*quiet.samples.shape, 2), np.float32).view(np.complex64)[..., 0]
    samples += quiet.samples
    if real:
        samples.imag = 0.0
    return Cube(samples=samples, noise_power=radar.noise_power)


def _direct(amplitude: Complexes, delay: Floats, delay_rate: Floats, wave: Waveform) -> Complexes:
    """Return the samples (chirps, samples) of one receiver by the exact sum."""
    step = wave.chirp_duration / wave.n_samples
    ramp = (wave.carrier, wave.slope, wave.repetition, step)
    a, d, g = np.ascontiguousarray(amplitude), np.ascontiguousarray(delay), np.ascontiguousarray(delay_rate)
    return np.asarray(beat_sum(a, d, g, *ramp, wave.n_chirps, wave.n_samples))


def _add_pair(grid: Keystone, echoes: Echoes, layer: Complexes, pair: tuple[Floats, Floats]) -> None:
    """Add to the samples (chirps, samples) of one pair of elements what the `prepared` echoes of a grid bring."""
    total = np.zeros(layer.shape, np.complex128)
    grid.add(total, echoes, pair)
    layer += total


def _add_fast(samples: Samples, grids: list[tuple[Keystone, Echoes]], elements: list[tuple[Floats, Floats]]) -> None:
    """Write the samples of all pairs of elements, one grid after the other: of a long frame each may take gigabytes."""
    sums = samples if len(grids) == 1 else np.zeros(samples.shape, np.complex128)
    # One buffer for all grids: allocating so much again costs more than filling it.
    buffer = np.empty(max(grid.factors for grid, _ in grids), np.complex128)
    while grids:
        grid, echoes = grids.pop()
        ready = grid.prepared(echoes, buffer)

        parallel_map(partial(_add_pair, grid, ready), list(sums), elements)
    if sums is not samples:
        samples[...] = sums
