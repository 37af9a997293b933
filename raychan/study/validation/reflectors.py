"""Measures of the three reflectors before a line of receivers: beams, monopulse, levels, and what impairments do."""

from __future__ import annotations

import dataclasses
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.processing.monopulse import monopulse as halves
from raychan.radar.aperture import cosines
from raychan.records import Cube
from raychan.run.receiver import aperture_of
from raychan.signal.baseband import noisy
from raychan.study.close_pair import PairSweep, pair_sweep
from raychan.study.validation.bench import Bench, over
from raychan.study.validation.detections import of_detection
from raychan.study.validation.measures import Seen, measure
from raychan.units import db

Floats = NDArray[np.float64]

FIELD_DEG, BEAMS = 15.0, 32
"""The printed beams: 32 over a field of view of 30 deg."""
_FINE = 1501  # beams 0.02 deg apart show every peak of a beam 4 deg wide
_PEAK = 0.5  # of the greatest: first side lobes of a line are at 0.05, those of two echoes together at 0.11
_BAND = 4096  # offsets over half the band: 2 kHz apart, where densities vary over 100 kHz
_CLEAR = 32  # resolution cells off an echo along both axes: rectangular windows leave 80 dB less there


def beam_powers(bench: Bench, run: str, target: str, count: int) -> tuple[Floats, Floats] | None:
    """Return azimuths (b,) [rad] over the field of view and the power (b,) of beams over the cell where a target is
    detected; None where it is not."""
    row = bench.found(run, target)
    if row is None:
        return None
    azimuth = np.radians(np.linspace(-FIELD_DEG, FIELD_DEG, count))
    rows = aperture_of(bench.scene(run).radar).steering(cosines(azimuth)).conj()
    return azimuth, np.asarray(np.abs(rows @ _snapshot(bench, run, row)) ** 2 / rows.shape[1] ** 2)


def _snapshot(bench: Bench, run: str, row: int) -> Any:
    """Return the values (a,) of all receivers in the cell of a detection."""
    result = bench.run(run)
    v, r = result.detections.cell[row]
    return result.rdmap.spectrum[:, v, r].astype(np.complex128)


def _tops(bench: Bench, run: str, target: str) -> Floats | None:
    """Return the azimuths [deg], left to right, at which finely spaced beams peak."""
    found = beam_powers(bench, run, target, _FINE)
    if found is None:
        return None
    azimuth, power = found
    inner = (power[1:-1] > power[:-2]) & (power[1:-1] >= power[2:]) & (power[1:-1] > _PEAK * power.max())
    return np.degrees(azimuth[1:-1][inner][::-1])


@measure
def azimuth(bench: Bench, run: str, target: str) -> Seen:
    """Return the azimuth [deg] of a target's detection."""
    found = of_detection(bench, run, target, "azimuth")
    return None if found is None else float(np.degrees(found))


@measure
def beam_azimuth(bench: Bench, run: str, target: str) -> Seen:
    """Return the azimuth [deg] of the strongest of the printed beams over a target's cell."""
    found = beam_powers(bench, run, target, BEAMS)
    return None if found is None else float(np.degrees(found[0][np.argmax(found[1])]))


@measure
def beam_peaks(bench: Bench, run: str, target: str) -> Seen:
    """Return how many peaks beams over a target's cell have in the field of view."""
    found = _tops(bench, run, target)
    return None if found is None else len(found)


@measure
def beam_peak(bench: Bench, run: str, target: str, number: int) -> Seen:
    """Return the azimuth [deg] of a peak of the beams over a target's cell, counted from the left from 0."""
    found = _tops(bench, run, target)
    return None if found is None or number >= len(found) else float(found[number])


@measure
def monopulse(bench: Bench, run: str, target: str) -> Seen:
    """Return the azimuth [deg] by phase monopulse in a target's cell, from the strongest of the printed beams."""
    row, start = bench.found(run, target), beam_azimuth(bench, run, target)
    if row is None or start is None:
        return None
    steer = np.sin(np.radians([float(start)]))
    sine = halves(_snapshot(bench, run, row)[None], aperture_of(_radar(bench, run)), steer)
    return float(np.degrees(np.arcsin(sine[0])))


@measure
def monopulse_off(bench: Bench, run: str, target: str, azimuths: list[float]) -> Seen:
    """Return how far [deg] phase monopulse is off the nearest of azimuths [deg]."""
    found = monopulse(bench, run, target)
    return None if found is None else float(np.abs(float(found) - np.asarray(azimuths)).min())


@measure
def clusters(bench: Bench, run: str) -> Seen:
    """Return the number of places in the map at which something is detected, whatever its direction."""
    d, wave = bench.run(run).detections, bench.scene(run).radar.waveform
    place = np.stack([d.range / wave.range_resolution, d.rate / wave.rate_resolution], axis=1)
    alone = [not (np.abs(place[:i] - p) < 1.5).all(axis=1).any() for i, p in enumerate(place)]
    return sum(alone)


@measure
def map_cell(bench: Bench, run: str) -> Seen:
    """Return the range rate [m/s] from one cell of the map to the next, without zero padding."""
    made = bench.run(run).rdmap
    return float((made.rate[1] - made.rate[0]) * bench.scene(run).processing.pad[1])


@measure
def level(bench: Bench, run: str, target: str) -> Seen:
    """Return the SNR [dB] of a target's paths alone at one receiver, both transforms done, without noise."""
    return bench.level(run, target)


@measure
def path_ratio(bench: Bench, run: str, one: str, other: str) -> Seen:
    """Return by how much [dB] the paths of one target are stronger than those of another."""
    return float(2.0 * (_path_db(bench, run, one) - _path_db(bench, run, other)))


def _path_db(bench: Bench, run: str, target: str) -> float:
    paths = bench.run(run).paths
    ways = over(bench.run(run), bench.target(target).parts)
    return float(db(np.abs(paths.amplitude[ways].sum())))


@measure
def range_bias(bench: Bench, run: str, ideal: str, target: str) -> Seen:
    """Return by how much [%] the detection of a run that is nearest to a target's in the run `ideal` is farther."""
    true, seen = of_detection(bench, ideal, target, "range"), bench.run(run).detections.range
    if true is None or not len(seen):
        return None
    # Its own provenance does not help: no path has the length that the wrong ramp reads.
    return 100.0 * (float(seen[np.argmin(np.abs(seen - true))]) / true - 1.0)


def floor(bench: Bench, run: str, ideal: str) -> float:
    """Return the mean power [W] of the map's cells off all that is detected in the run `ideal`, at one receiver."""
    made, pad = bench.run(run).rdmap, bench.scene(run).processing.pad
    quiet = np.ones(made.power.shape, bool)
    for cell in bench.run(ideal).detections.cell:
        for axis, (at, width) in enumerate(zip(cell, (_CLEAR * pad[1], _CLEAR * pad[0]), strict=True)):
            count = made.power.shape[axis]
            near = np.abs((np.arange(count) - at + count // 2) % count - count // 2) <= width
            quiet &= ~np.expand_dims(near, 1 - axis)
    return float(made.power[quiet].mean())


@measure
def floor_rise(bench: Bench, run: str, ideal: str) -> Seen:
    """Return by how much [dB] the floor of a run's map lies above that of another."""
    return float(db(floor(bench, run, ideal) / floor(bench, ideal, ideal)))


@measure
def rise_off(bench: Bench, run: str, ideal: str) -> Seen:
    """Return the rise of the floor less that in closed form [dB]: the noise of the converter's step, and the density of
    phase noise over the sampled band, of each path by its delay."""
    radar, paths = _radar(bench, run), bench.run(ideal).paths
    wrong, rate = radar.impairments, radar.waveform.sample_rate
    added = 0.0 if wrong.converter is None else wrong.converter.noise_power()
    if wrong.phase_noise is not None:
        offset = (np.arange(_BAND) + 0.5) / _BAND * 0.5 * rate
        shares = [rate * float(wrong.phase_noise.beat_density(offset, d).mean()) for d in paths.delay]
        added += float((radar.power * np.abs(paths.amplitude) ** 2 * shares).sum())
    return float(floor_rise(bench, run, ideal) or 0.0) - float(db(1.0 + added / radar.noise_power))


@measure
def noise_dbw(bench: Bench, run: str, kelvin: float) -> Seen:
    """Return the power [dBW] of samples of noise, of an antenna of a temperature [K] and a receiver without noise."""
    return float(db(_noise(bench, run, kelvin)))


@measure
def silent(bench: Bench, run: str, kelvin: float) -> Seen:
    """Return whether the samples of the same are zero."""
    return _noise(bench, run, kelvin) == 0.0


def _noise(bench: Bench, run: str, kelvin: float) -> float:
    radar = dataclasses.replace(_radar(bench, run), noise_figure_db=0.0, noise_temperature_k=kelvin)
    wave = radar.waveform
    empty = np.zeros((1, wave.n_chirps, wave.n_samples), np.complex64)
    made = noisy(Cube(samples=empty, noise_power=radar.noise_power), radar, np.random.default_rng(0))
    return float((np.abs(made.samples.astype(np.complex128)) ** 2).mean())


def _radar(bench: Bench, run: str) -> Any:
    return bench.scene(run).radar


@cache
def close_pair() -> PairSweep:
    """Return what beams and MUSIC make of the pair over relative phases."""
    return pair_sweep()


@measure
def pair_resolved(bench: Bench, method: str) -> Seen:
    """Return the share [%] of relative phases at which 'beams' or 'music' show two directions."""
    sweep = close_pair()
    return 100.0 * (sweep.resolved_by_beams if method == "beams" else sweep.resolved_by_music)
