"""Detections in a range-Doppler map: local maxima over the CFAR threshold that are no side lobes, with sub-bin
interpolation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from raychan.processing.cfar import GUARD, TRAIN, Grid, bias, factor, level, training
from raychan.processing.doa import azimuth
from raychan.radar.side_lobes import SideLobeEnvelope
from raychan.radar.waveform import Waveform
from raychan.records import Detections, RangeDoppler
from raychan.units import C0, db, undb

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_MARGIN = 2.0  # side lobes of two equal echoes add in voltage: twice the sum of their powers
_FLOOR = 1e-12  # of a peak: rounding errors of single precision and of the fast sum are below
_SLACK = 0.25  # resolution cells by which side lobes of other echoes may shift a peak (not measured)
_STEEP = 5.0  # Np of power: more than any window falls in half a resolution cell
_TINY = 1e-300


def detect(
    map: RangeDoppler,
    *,
    pfa: float = 1e-7,
    min_snr_db: float = 20.0,
    method: str = "os",
    guard: tuple[int, int] = GUARD,
    train: tuple[int, int] = TRAIN,
    ego_speed: float = 0.0,
    windows: tuple[str, str] = ("hann", "hann"),
    waveform: Waveform | None = None,
    elements: Floats | None = None,
) -> Detections:
    """Return the detections of a map: local maxima over CFAR threshold and minimum SNR that are no side lobes.

    SNR is the power at the sub-bin peak over the thermal noise per cell, or, where that is unknown (0), over the noise
    estimated from the training cells. Speed is rate plus ego_speed. Peaks below the window's response to stronger
    detections are dropped.
    Args: method ca or os; guard [resolution cells], train [cells a side] and windows: all (rate, range), see
    processing.cfar; waveform, for the range migration of movers and, with elements (a, 3) [m], for azimuths.
    Raises: ValueError on bad arguments.
    """
    grid = Grid.of(map)
    ring = training(grid, guard, train, windows)
    looks = len(map.spectrum)
    threshold = factor(pfa, ring.worth, method, looks)
    weakest = float(undb(min_snr_db)) * map.noise

    cells = _maxima(map.power, 0.5 * weakest)
    local = level(map.power, cells, ring, method)
    over = map.power[tuple(cells.T)] > threshold * local
    cells, local = cells[over], local[over]
    shift, power = _refine(map.power, cells)
    noise = np.full(len(cells), map.noise) if map.noise > 0.0 else local / bias(ring.worth, method, looks)
    snr = db(power / np.maximum(noise, _TINY))
    strong = np.flatnonzero(snr >= min_snr_db)
    strong = strong[np.argsort(-power[strong], kind="stable")]
    cells, power, snr, place = cells[strong], power[strong], snr[strong], (cells + shift)[strong]

    steps = map.rate_resolution / grid.pad[0], map.range_resolution / grid.pad[1]
    rate = _within(map.rate[0] + place[:, 0] * steps[0], map.unambiguous_rate)
    duration = waveform.frame_duration if waveform else 0.0
    kept = _own(place / np.array(grid.pad), power, np.abs(rate) * duration / map.range_resolution, grid, windows)
    cells, power, snr, place, rate = cells[kept], power[kept], snr[kept], place[kept], rate[kept]
    angle = np.full(len(cells), np.nan)
    if waveform is not None and elements is not None:
        angle = azimuth(map.spectrum[:, cells[:, 0], cells[:, 1]].T, elements, C0 / waveform.middle)
    return Detections(
        range=map.range[0] + place[:, 1] * steps[1],
        rate=rate,
        speed=rate + ego_speed,
        azimuth=angle,
        snr=snr,
        power=power,
        cell=cells.astype(np.int32),
    )


def _within(rate: Floats, limit: float) -> Floats:
    """Return the unambiguous aliases of rates, from -limit to limit [m/s]."""
    return np.where(np.abs(rate) <= limit, rate, (rate + limit) % (2.0 * limit) - limit)


def _maxima(power: Floats, least: float) -> Ints:
    """Return the local maxima (c, 2) of a map; both axes wrap as the transforms do."""
    top = (power >= maximum_filter(power, size=3, mode="wrap")) & (power > least)
    return np.argwhere(top)


def _refine(power: Floats, cells: Ints) -> tuple[Floats, Floats]:
    """Return the offsets (c, 2) in cells and the power (c,) of the peaks, by parabolas in dB along both axes."""
    shift = np.zeros(cells.shape)
    gain = np.zeros(len(cells))
    top = np.log(np.maximum(power[tuple(cells.T)], _TINY))
    for axis, size in enumerate(power.shape):
        # A null beside a peak (unpadded, or without noise) must not distort the parabola.
        below, above = (np.maximum(_beside(power, cells, axis, step), top - _STEEP) for step in (-1, 1))
        bend = below - 2.0 * top + above
        inside = (bend < 0.0) & (size > 2)
        if axis == 1:
            inside &= (cells[:, 1] > 0) & (cells[:, 1] < size - 1)
        offset = np.divide(0.5 * (below - above), bend, out=np.zeros(len(cells)), where=inside)
        shift[:, axis] = np.clip(offset, -0.5, 0.5)
        gain += 0.25 * (above - below) * shift[:, axis]
    return shift, np.exp(top + gain)


def _beside(power: Floats, cells: Ints, axis: int, step: int) -> Floats:
    at = cells.copy()
    at[:, axis] = (at[:, axis] + step) % power.shape[axis]
    return np.asarray(np.log(np.maximum(power[tuple(at.T)], _TINY)))


def _own(place: Floats, power: Floats, smear: Floats, grid: Grid, windows: tuple[str, str]) -> NDArray[np.bool_]:
    """Return which peaks (n,), strongest first, are not explained by side lobes of stronger ones.

    Args: place (n, 2) and smear (n,) in resolution cells; an echo that migrates over `smear` range cells spreads over
    as many rate cells."""
    envelopes = [SideLobeEnvelope(name, n) for name, n in zip(windows, grid.count, strict=True)]
    lobes = np.zeros(len(power))
    kept = np.zeros(len(power), bool)
    for i in range(len(power)):
        kept[i] = power[i] > _MARGIN * lobes[i]
        if kept[i]:
            response = power[i]
            for axis, envelope in enumerate(envelopes):
                away = np.abs(place[i:, axis] - place[i, axis])
                away = np.minimum(away, grid.count[axis] - away)
                response = response * envelope(np.maximum(away - 0.5 * smear[i] - _SLACK, 0.0))
            lobes[i:] += np.maximum(response, _FLOOR * power[i])
    return kept
