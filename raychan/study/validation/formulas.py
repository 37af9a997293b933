"""Measures of closed forms and of the receiver alone: resolutions, ambiguities, thresholds, losses over free space."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.poses import angles, direction
from raychan.processing.cfar import factor
from raychan.processing.range_doppler import range_doppler
from raychan.radar.pattern import gain_dbi
from raychan.records import Paths, RangeDoppler
from raychan.run.receiver import noise_of_cell
from raychan.signal.baseband import synthesize
from raychan.study.validation.bench import Bench
from raychan.study.validation.measures import Seen, measure
from raychan.units import C0, db, dbm

Floats = NDArray[np.float64]

PATCH, ARRAY = "street", "street_array"
"""Runs of one scene with either antenna."""

_FINE = 16  # map cells per resolution cell where a gap is measured
_FAR = 30  # resolution cells to the single point: clear of the map's edge
_HALF_DB = 10.0 ** (0.5 / 20.0) - 1.0  # relative amplitude that changes another by at most 0.5 dB, at any phase


def _echo(bench: Bench, run: str, at: float, rate: float, window: str, pad: tuple[int, int], iq: bool = True) -> Any:
    """Return the map of a single point at a range [m] and range rate [m/s], without noise."""
    given = bench.scene(run).radar
    wave = dataclasses.replace(given.waveform, complex_sampling=iq)
    look, none = np.array([[1.0, 0.0, 0.0]]), np.full((1, 1), -1)
    here = np.asarray(given.position)
    path = Paths.of(
        length=np.array([2.0 * at]),
        amplitude=np.ones(1, complex),
        length_rate=np.array([2.0 * rate]),
        departure=look,
        arrival=look,
        body=none,
        part=none,
        kind=0 * none,
        vertices=np.broadcast_to(here.astype(np.float32), (1, 1, 3)),
        body_names=(),
        part_names=(),
        tx=here,
        rx=here,
    )
    cube = synthesize(path, dataclasses.replace(given, waveform=wave, noise=False))
    return range_doppler(cube, wave, window, window, pad)


def _top(made: RangeDoppler) -> tuple[int, int]:
    row, column = np.unravel_index(np.argmax(made.power), made.power.shape)
    return int(row), int(column)


@measure
def gap(bench: Bench, run: str, window: str) -> Seen:
    """Return the least gap [m] at which two equal points both read their own power to 0.5 dB, whatever their phases."""
    cell = bench.scene(run).radar.waveform.range_resolution
    made = _echo(bench, run, _FAR * cell, 0.0, window, (_FINE, 1))
    row, column = _top(made)
    below = np.abs(made.spectrum[0, row, column:]) < _HALF_DB * np.sqrt(made.power.max())
    return float(np.argmax(below) * cell / _FINE)


@measure
def rate_gap(bench: Bench, run: str, window: str) -> Seen:
    """Return the least gap [m/s], as for `gap`, of two points at one range."""
    wave = bench.scene(run).radar.waveform
    made = _echo(bench, run, _FAR * wave.range_resolution, 0.0, window, (1, _FINE))
    row, column = _top(made)
    below = np.abs(made.spectrum[0, row:, column]) < _HALF_DB * np.sqrt(made.power.max())
    return float(np.argmax(below) * wave.rate_resolution / _FINE)


@measure
def unambiguous_range(bench: Bench, run: str, iq: bool) -> Seen:
    """Return the range [m] at which the beat folds, with I/Q or real samples."""
    return float(dataclasses.replace(bench.scene(run).radar.waveform, complex_sampling=iq).unambiguous_range)


@measure
def read_range(bench: Bench, run: str, at: float, iq: bool) -> Seen:
    """Return the range [m] at which the map shows a point at `at` [m], with I/Q or real samples."""
    made = _echo(bench, run, at, 0.0, "hann", (2, 1), iq)
    return float(made.range[_top(made)[1]])


@measure
def read_rate(bench: Bench, run: str, rate: float) -> Seen:
    """Return the range rate [m/s] at which the map shows a point of range rate `rate` [m/s]."""
    made = _echo(bench, run, 50.0, rate, "hann", (1, 2))
    return float(made.rate[_top(made)[0]])


@measure
def threshold(bench: Bench, run: str, cells: float) -> Seen:
    """Return the CA-CFAR threshold [dB] over the mean of `cells` training cells (see processing.cfar.factor)."""
    return float(db(factor(bench.scene(run).processing.pfa, cells)))


@measure
def point_loss(bench: Bench, run: str, at: float, rcs_dbsm: float) -> Seen:
    """Return the two-way loss [dB] to a target of given RCS [dBsm] at a range [m], between isotropic antennas.

    The radar equation (Skolnik, Introduction to Radar Systems, 2001, ch. 1): (4 pi)^3 R^4 / (lambda^2 sigma).
    """
    return _point_loss(bench.scene(run).radar.waveform.carrier, at, rcs_dbsm)


def _point_loss(frequency: float, at: float, rcs_dbsm: float) -> float:
    """Return the loss [dB] of `point_loss` at a frequency [Hz]."""
    return float(db((4.0 * np.pi) ** 3 * at**4 / (C0 / frequency) ** 2) - rcs_dbsm)


@measure
def reach(bench: Bench, run: str, sensitivity_dbm: float, rcs_dbsm: float) -> Seen:
    """Return the range [m] at which `point_loss` is the largest loss of the link budget, receive gain left out."""
    most = bench.scene(run).radar.link_budget(sensitivity_dbm)["max_path_loss_db"]
    return float(10.0 ** ((most - float(point_loss(bench, run, 1.0, rcs_dbsm) or 0.0)) / 40.0))


@measure
def spreading(bench: Bench, near: str, far: str) -> Seen:
    """Return the loss [dB] by R^-4 from the place of one target to that of another."""
    return float(40.0 * np.log10(bench.place(far)[1] / bench.place(near)[1]))


@measure
def gain_change(bench: Bench, azimuth_deg: float, first: str = PATCH, later: str = ARRAY) -> Seen:
    """Return the gain [dB] of one run's antenna over that of another, both ways, at an azimuth [deg]."""
    return float(both_ways(bench, np.array([azimuth_deg]), first, later)[0])


def both_ways(bench: Bench, azimuth_deg: Floats, first: str = PATCH, later: str = ARRAY) -> Floats:
    """Return the gain [dB] of a run's antenna over that of another, both ways, at azimuths (n,) [deg]."""
    look = direction(np.radians(azimuth_deg))
    patch, array = ((np.abs(bench.scene(run).radar.tx.field(look)) ** 2).sum(axis=1) for run in (first, later))
    return np.asarray(2.0 * (db(array) - db(patch)))


def link_snr(bench: Bench, run: str, target: str) -> dict[str, float]:
    """Return the link budget of a target of given RCS in free space: range, azimuth, RCS, gain and SNR.

    SNR = P G^2 lambda^2 sigma / ((4 pi)^3 R^4) over the noise of a map cell: k T0 F f_s of a sample, less the gain of
    the windowed transforms. Lambda of the middle of the ramp, as a run has it; gain at the target's azimuth and
    elevation, RCS at its aspect, noise figure of the run.
    """
    scene = bench.scene(run)
    radar, points = scene.radar, scene.points(0.0)
    row = scene.facets(0.0).body_names.index(bench.target(target).parts[0])
    k = int(np.flatnonzero(points.body == row)[0])
    ray = points.position[k] - np.asarray(radar.position)
    distance = float(np.linalg.norm(ray))
    azimuth, elevation = (float(a) for a in angles(ray))
    back = (azimuth + np.pi - points.heading[k] + np.pi) % (2.0 * np.pi) - np.pi
    sigma = float(np.interp(back, points.azimuth, points.sigma[k], period=2.0 * np.pi))
    gain = gain_dbi(radar.tx, azimuth - np.radians(radar.yaw_deg), elevation)
    loss = _point_loss(radar.waveform.middle, distance, float(db(sigma)))
    snr = dbm(radar.power) + 2.0 * gain - loss - dbm(noise_of_cell(radar, scene.processing))
    return {
        "range": distance,
        "azimuth_deg": float(np.degrees(azimuth)),
        "rcs_dbsm": float(db(sigma)),
        "gain_dbi": gain,
        "snr_db": float(snr),
    }


@measure
def budget_fall(bench: Bench, run: str, near: str, far: str) -> Seen:
    """Return the fall [dB] of the free-space link budget from one target of given RCS to another."""
    return link_snr(bench, run, near)["snr_db"] - link_snr(bench, run, far)["snr_db"]
