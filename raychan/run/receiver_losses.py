"""What the receiver's processing loses of an echo and no error states: the wave is spherical where a beam takes it for
plane, its ranges or rates differ over the elements, and the echo moves over range cells while the frame lasts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from raychan.radar.aperture import cosines
from raychan.radar.radar import Radar
from raychan.radar.side_lobes import migrating
from raychan.radar.waveform import OwnWaveform
from raychan.radar.windows import window
from raychan.records import Detections
from raychan.run.receiver import aperture_of
from raychan.run.result import ExplainedDetections, Explanation
from raychan.units import C0, db

Floats = NDArray[np.float64]

_BEAMS = 33  # along each axis, over the directions from which an array sees a near echo (not measured)
_ROUND = 0.9  # of a power: a peak that keeps more (0.46 dB, below what is told) is round, and not split
_OFF = 0.05  # cells between the places where the peak is sought: 0.01 dB of a Hann window's main lobe
_CELL = 0.02  # cells: step of the table of the window's response, whose error is below 1e-3 of an amplitude
_STEP = 0.5  # range cells of migration between tables of peaks: fewer, against an eighth of a cell of where peaks stand
_TURN = 0.02  # rad: step of the table of what ramps keep, whose error is below 2e-5 of an amplitude


def near_field_losses(found: ExplainedDetections, radar: Radar) -> Floats:
    """Return what a beam of plane waves loses of the spherical wave of each detection (n,) [dB], and zeros where there
    is no beam."""
    aperture = aperture_of(radar)
    if not any(aperture.scans) or radar.rx_position is not None:
        return np.zeros(len(found.range))
    look = _look(found)
    # A folded echo comes from where it stands.
    away = np.where(np.isfinite(found.true_range), found.true_range, found.range)
    source = away[:, None] * look
    held = _through(radar, source, np.zeros((1, 3)))[:, 0]
    for i in np.flatnonzero(held < _ROUND):
        # Near an array a beam's peak splits: beams beside the echo's direction read more.
        spread = 0.5 * np.ptp(aperture.elements, axis=0) / max(away[i], 1e-9)
        steps = [np.linspace(-x, x, _BEAMS) if x > 0.0 else np.zeros(1) for x in spread[1:]]
        beside = np.stack(np.meshgrid(0.0, *steps), axis=-1).reshape(-1, 3)
        held[i] = _through(radar, source[i : i + 1], beside).max()
    return -db(np.maximum(held, 1e-30))


def _through(radar: Radar, source: Floats, beside: Floats) -> Floats:
    """Return the power (n, b) that beams keep of waves from sources (n, 3) [m], the beams towards directions that
    differ by some cosines (b, 3) from theirs."""
    turn, held = 2.0 * np.pi * radar.waveform.middle / C0, np.ones((len(source), len(beside)))
    for elements in (radar.tx_elements, radar.elements):
        # An array beside the phase centre sees another direction, which its beam finds.
        places, middle = elements - elements.mean(axis=0), elements.mean(axis=0)
        away = np.linalg.norm(source - middle, axis=1)
        along = (source - middle) @ places.T / np.maximum(away, 1e-9)[:, None]
        longer = np.linalg.norm((source - middle)[:, None] - places, axis=2) - away[:, None] + along
        held *= np.abs(np.exp(1j * turn * longer) @ np.exp(1j * turn * places @ beside.T) / len(places)) ** 2
    return held


def _look(found: Detections) -> Floats:
    """Return the directions (n, 3) of detections in the antenna's frame; what is not measured is 0."""
    u, w = cosines(np.nan_to_num(found.azimuth), np.nan_to_num(found.elevation)).T
    return np.stack([np.sqrt(np.maximum(1.0 - u**2 - w**2, 0.0)), u, w], axis=1)


def range_spread(found: Detections, radar: Radar) -> tuple[Floats, Floats]:
    """Return by how many range cells the range of each detection (n,) differs over the virtual elements, and what a
    beam loses by it (n,) [dB]: the mean over the elements of the range window's response in one cell, of the best."""
    aperture, wave = aperture_of(radar), radar.channel_waveform
    none = np.zeros(len(found.range))
    if not any(aperture.scans) or radar.rx_position is not None or isinstance(wave, OwnWaveform):
        return none, none
    # An element nearer to the echo by x sees it x / 2 nearer, as only one of both ways is shorter.
    ahead = 0.5 * _look(found) @ (aperture.elements - aperture.elements.mean(axis=0)).T / wave.range_resolution
    return _apart(ahead, window(radar.processing.range_window, wave.n_samples))


def spreads(
    found: ExplainedDetections, reasons: Sequence[Explanation], radar: Radar
) -> dict[str, tuple[Floats, Floats]]:
    """Return by how many cells ranges and rates of detections (n,) differ over the virtual elements, and what a beam
    loses by each (n,) [dB]."""
    return {"ranges": range_spread(found, radar), "rates": _rate_spread(found, reasons, radar)}


def _rate_spread(found: ExplainedDetections, reasons: Sequence[Explanation], radar: Radar) -> tuple[Floats, Floats]:
    """Return by how many rate cells the rate of each detection (n,) differs over the virtual elements, as of what
    crosses before them, and what a beam loses by it (n,) [dB], as `range_spread`."""
    wave, n = radar.channel_waveform, len(reasons)
    if radar.rx_position is not None or wave.n_chirps < 2 or not any(why.drift for why in reasons):
        return np.zeros(n), np.zeros(n)
    # A folded echo comes from where it stands.
    away = np.where(np.isfinite(found.true_range), found.true_range, found.range)
    drift = np.array([why.drift or (0.0,) * 6 for why in reasons]).reshape(n, 2, 3)
    ends = (radar.tx_elements, [why.departure for why in reasons]), (radar.elements, [why.arrival for why in reasons])
    rate = np.zeros((n, 1))
    for end, (elements, looks) in enumerate(ends):
        look = np.array(looks)
        source = away[:, None, None] * look[:, None] - elements @ radar.axes.T
        turned = source / np.maximum(np.linalg.norm(source, axis=2, keepdims=True), 1e-9) - look[:, None]
        more = 0.5 * np.einsum("nek,nk->ne", turned, drift[:, end])
        rate = (rate[:, :, None] + more[:, None]).reshape(n, -1)
    return _apart(rate / wave.rate_resolution, window(radar.processing.rate_window, wave.n_chirps))


def _apart(places: Floats, taper: Floats) -> tuple[Floats, Floats]:
    """Return by how many cells places (n, e) [cells] of an echo at the elements differ (n,), and what the mean over
    the elements of the response of a window (s,) loses in one cell, of the best (n,) [dB]."""
    count = len(taper)
    turn = 2.0 * np.pi * (np.arange(count) - 0.5 * (count - 1)) / count
    table = np.arange(0.0, np.ptp(places, axis=1).max(initial=0.0) + _CELL, _CELL)
    response = np.cos(np.outer(table, turn)) @ taper / taper.sum()
    held = np.zeros(len(places))
    for i, x in enumerate(places):
        away = np.abs(x - np.arange(x.min(), x.max() + _OFF, _OFF)[:, None])
        held[i] = np.interp(away, table, response).mean(axis=1).max() ** 2
    return np.ptp(places, axis=1), -db(np.maximum(held, 1e-30))


def far_field_distance(radar: Radar) -> float:
    """Return 2 D^2 / wavelength [m] of the radar's widest array, of transmitters or receivers."""
    spans = (np.linalg.norm(np.ptp(x, axis=0)) for x in (radar.tx_elements, radar.elements))
    return float(2.0 * max(spans) ** 2 * radar.waveform.middle / C0)


def migration(rate: Floats, radar: Radar) -> tuple[Floats, Floats]:
    """Return over how many range cells echoes of true rates (n,) [m/s] move during a frame, and what their peaks lose
    by it (n,) [dB]: the mean response of the range window over the frame, weighted by the rate window."""
    wave, settings = radar.channel_waveform, radar.processing
    if isinstance(wave, OwnWaveform):
        return np.zeros(len(rate)), np.zeros(len(rate))
    taper, weight = (
        window(name, n) for name, n in ((settings.range_window, wave.n_samples), (settings.rate_window, wave.n_chirps))
    )
    moved = np.abs(np.nan_to_num(rate)) * wave.frame_duration / wave.range_resolution
    turn = 2.0 * np.pi * (np.arange(wave.n_samples) - 0.5 * (wave.n_samples - 1)) / wave.n_samples
    mid = (np.arange(wave.n_chirps) - 0.5 * (wave.n_chirps - 1)) / wave.n_chirps
    # What each sample keeps of the sum over the ramps, of which each turns it by as many cells as the echo moved.
    turns = np.arange(0.0, np.pi * moved.max(initial=0.0) + _TURN, _TURN)
    kept = np.array([np.cos(x * mid) @ weight for x in turns]) / weight.sum()
    held = [(np.interp(np.abs(turn) * cells, turns, kept) @ taper / taper.sum()) ** 2 for cells in moved]
    return moved, -db(np.maximum(np.array(held), 1e-30))


def beside(moved: Floats, radar: Radar) -> Floats:
    """Return how many cells (2,) of rate and of range peaks of echoes that migrate over so many range cells (n,) may
    stand off the places that these have at mid frame: of abrupt windows an echo's power is even over many cells."""
    wave, settings = radar.channel_waveform, radar.processing
    names, count = (settings.rate_window, settings.range_window), (wave.n_chirps, wave.n_samples)
    steps = np.unique(np.rint(moved / _STEP)) * _STEP
    off = [migrating(names, count, float(step), 1).off for step in steps]
    return np.asarray(np.max(off, axis=0, initial=0.0)) if off else np.zeros(2)
