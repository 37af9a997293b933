"""What the receiver's processing loses of an echo and no error states: the wave is spherical where a beam takes it for
plane, its ranges or rates differ over the elements, and the echo moves over range cells while the frame lasts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

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
Complexes = NDArray[np.complex128]

_BEAMS = 33  # along each axis, over the directions from which an array sees a near echo (not measured)
_ROUND = 0.9  # of a power: a peak that keeps more (0.46 dB, below what is told) is round, and not split
_WHOLE = 0.99  # of a power: a beam of spherical waves keeps more (0.04 dB) of its own (not measured)
_OFF = 0.05  # cells between the places where the peak is sought: 0.01 dB of a Hann window's main lobe
_APART = 0.1  # the same where both are sought: 0.015 dB
_LITTLE = 0.03  # dB: what causes but the largest lose together is told from this on (not measured)
_CELL = 0.02  # cells: step of the table of the window's response, whose error is below 1e-3 of an amplitude
_STEP = 0.5  # range cells of migration between tables of peaks: fewer, against an eighth of a cell of where peaks stand
_TURN = 0.02  # rad: step of the table of what ramps keep, whose error is below 2e-5 of an amplitude


@dataclass(frozen=True)
class BeamLosses:
    """What a beam of plane waves in one map cell loses of detections (n,) [dB], by each cause and by all together."""

    near: Floats
    ranges: Floats
    rates: Floats
    whole: Floats
    range_cells: Floats
    """By how many cells ranges, and rates, differ over the virtual elements."""
    rate_cells: Floats


def beam_losses(found: ExplainedDetections, reasons: Sequence[Explanation], radar: Radar) -> BeamLosses:
    """Return what beams lose of detections, each of which has a reason: zeros where there is no beam."""
    looks = _looks_of(found, reasons, radar)
    near, beams = _near_field(found, radar, looks)
    ranges, rates = _ahead(radar, looks), _rates_apart(found, reasons, radar)
    tapers = _tapers(radar)
    (range_cells, by_range), (rate_cells, by_rate) = (
        _apart(x, taper) for x, taper in zip((ranges, rates), tapers, strict=True)
    )
    each = np.array([near, by_range, by_rate])
    whole, source = each.max(axis=0), _sources(found, looks)
    # Those that come together are more than each, and not quite their sum.
    for i in np.flatnonzero(each.sum(axis=0) > whole + _LITTLE):
        waves = [x[0, :, 0] ** bool(near[i]) for x in _waves(radar, source[i : i + 1], beams[i][None])]
        held = _together(np.outer(*waves).ravel(), (ranges[i], rates[i]), tapers)
        whole[i] = max(whole[i], -db(max(held, 1e-30)))
    return BeamLosses(near, by_range, by_rate, whole, range_cells, rate_cells)


def near_field_losses(found: ExplainedDetections, radar: Radar) -> Floats:
    """Return what a beam of plane waves loses of the spherical wave of each detection (n,) [dB] from the direction in
    which it shows, and zeros where there is no beam."""
    return _near_field(found, radar, _shown(found))[0]


def _near_field(found: ExplainedDetections, radar: Radar, looks: Floats) -> tuple[Floats, Floats]:
    """Return what a beam of plane waves loses of the spherical wave of each detection (n,) [dB], and by which cosines
    (n, 3) the best beam is beside its direction.

    Args: looks (2, n, 3) in which waves leave and from which they arrive, in the antenna's frame."""
    aperture, best = aperture_of(radar), np.zeros((len(found.range), 3))
    if not any(aperture.scans) or radar.rx_position is not None:
        return np.zeros(len(best)), best
    source = _sources(found, looks)
    held = _through(radar, source, np.zeros((1, 3)))[:, 0]
    # Beams of spherical waves, in which near echoes are seen, lose nothing.
    own = _in_own_beams(found, radar, source) > np.maximum(held, _WHOLE)
    for i in np.flatnonzero((held < _ROUND) & ~own):
        # Near an array a beam's peak splits: beams beside the echo's direction read more.
        spread = 0.5 * np.ptp(aperture.elements, axis=0) / max(np.linalg.norm(source[i, 1]), 1e-9)
        steps = [np.linspace(-x, x, _BEAMS) if x > 0.0 else np.zeros(1) for x in spread[1:]]
        beside = np.stack(np.meshgrid(0.0, *steps), axis=-1).reshape(-1, 3)
        through = _through(radar, source[i : i + 1], beside)[0]
        held[i], best[i] = through.max(), beside[np.argmax(through)]
    return np.where(own, 0.0, -db(np.maximum(held, 1e-30))), best


def _in_own_beams(found: ExplainedDetections, radar: Radar, source: Floats) -> Floats:
    """Return the power (n,) that the beams of detections keep of waves from sources (n, 2, 3) [m]; 0 without beams."""
    count = len(radar.virtual_elements)
    if found.beam.shape[1] < count:
        return np.zeros(len(source))
    turn, held = 2.0 * np.pi * radar.waveform.middle / C0, []
    for end, elements in enumerate((radar.tx_elements, radar.elements)):
        held.append(np.exp(-1j * turn * np.linalg.norm(source[:, end, None] - elements, axis=2)))
    waves = (held[0][:, :, None] * held[1][:, None]).reshape(-1, count)
    return np.asarray(np.abs((found.beam[:, :count] * waves).sum(axis=1)) ** 2)


def _sources(found: ExplainedDetections, looks: Floats) -> Floats:
    """Return from where (n, 2, 3) [m] waves come, as transmitters and receivers see it."""
    # A folded echo comes from where it stands.
    away = np.where(np.isfinite(found.true_range), found.true_range, found.range)
    return np.asarray((away[:, None] * looks).swapaxes(0, 1))


def _through(radar: Radar, source: Floats, beside: Floats) -> Floats:
    """Return the power (n, b) that beams keep of waves from sources (n, 2, 3) [m], the beams towards directions that
    differ by some cosines (b, 3) from theirs."""
    sent, heard = (np.abs(x.mean(axis=1)) ** 2 for x in _waves(radar, source, beside))
    return np.asarray(sent * heard)


def _waves(radar: Radar, source: Floats, beside: Floats) -> tuple[Complexes, Complexes]:
    """Return the waves that transmitters and receivers (n, e, b) hold in these beams, of unit amplitude."""
    turn, found = 2.0 * np.pi * radar.waveform.middle / C0, []
    for end, elements in enumerate((radar.tx_elements, radar.elements)):
        # An array beside the phase centre sees another direction, which its beam finds.
        places, middle = elements - elements.mean(axis=0), elements.mean(axis=0)
        off = source[:, end] - middle
        away = np.linalg.norm(off, axis=1)
        along = off @ places.T / np.maximum(away, 1e-9)[:, None]
        longer = np.linalg.norm(off[:, None] - places, axis=2) - away[:, None] + along
        found.append(np.exp(1j * turn * (longer[:, :, None] + places @ beside.T)))
    return found[0], found[1]


def _together(wave: Complexes, places: tuple[Floats, Floats], tapers: tuple[Floats, Floats]) -> float:
    """Return the power that a beam keeps of an echo whose waves (e,) stand at places (e,) of range and rate [cells], in
    the best cell."""
    answers = []
    for x, taper in zip((np.broadcast_to(x, wave.shape) for x in places), tapers, strict=True):
        table, response = _response(float(np.ptp(x)), taper)
        away = np.abs(x - np.arange(x.min(), x.max() + _APART, _APART)[:, None])
        answers.append(np.interp(away, table, response))
    return float((np.abs((answers[0] * wave) @ answers[1].T) ** 2).max()) / len(wave) ** 2


def _tapers(radar: Radar) -> tuple[Floats, Floats]:
    """Return the windows along range and rate."""
    wave, settings = radar.channel_waveform, radar.processing
    return window(settings.range_window, wave.n_samples), window(settings.rate_window, wave.n_chirps)


def _looks_of(found: Detections, reasons: Sequence[Explanation], radar: Radar) -> Floats:
    """Return the directions (2, n, 3) in which waves of detections leave and from which they arrive, in the antenna's
    frame: those of their paths, as one may show elsewhere, and where no path is known those that are measured."""
    looks = _shown(found)
    for end, axes in enumerate((radar.axes, radar.rx_axes)):
        for i, why in enumerate(reasons):
            look = why.arrival if end else why.departure
            if any(look):
                looks[end, i] = np.array(look) @ axes
    return looks


def _shown(found: Detections) -> Floats:
    """Return the directions (2, n, 3) of detections in the antenna's frame, out and back; what is not measured is 0."""
    u, w = cosines(np.nan_to_num(found.azimuth), np.nan_to_num(found.elevation)).T
    look = np.stack([np.sqrt(np.maximum(1.0 - u**2 - w**2, 0.0)), u, w], axis=1)
    return np.stack([look, look])


def range_spread(found: Detections, radar: Radar) -> tuple[Floats, Floats]:
    """Return by how many range cells the range of each detection (n,) differs over the virtual elements, and what a
    beam loses by it (n,) [dB]: the mean over the elements of the range window's response in one cell, of the best."""
    return _apart(_ahead(radar, _shown(found)), _tapers(radar)[0])


def _ahead(radar: Radar, looks: Floats) -> Floats:
    """Return by how many range cells (n, t * a) the virtual elements are nearer to echoes in directions (2, n, 3)."""
    wave = radar.channel_waveform
    if not any(aperture_of(radar).scans) or radar.rx_position is not None or isinstance(wave, OwnWaveform):
        return np.zeros((looks.shape[1], 1))
    # An element nearer to the echo by x sees it x / 2 nearer, as only one of both ways is shorter.
    sent, heard = (x @ (y - y.mean(axis=0)).T for x, y in zip(looks, (radar.tx_elements, radar.elements), strict=True))
    nearer = sent[:, :, None] + heard[:, None]
    return np.asarray(0.5 / wave.range_resolution * nearer.reshape(len(sent), sent.shape[1] * heard.shape[1]))


def _rates_apart(found: ExplainedDetections, reasons: Sequence[Explanation], radar: Radar) -> Floats:
    """Return by how many rate cells (n, t * a) the rate of each detection is higher at the virtual elements, as of what
    crosses before them."""
    wave, n = radar.channel_waveform, len(reasons)
    if radar.rx_position is not None or wave.n_chirps < 2 or not any(why.drift for why in reasons):
        return np.zeros((n, 1))
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
    return rate / wave.rate_resolution


def _apart(places: Floats, taper: Floats) -> tuple[Floats, Floats]:
    """Return by how many cells places (n, e) [cells] of an echo at the elements differ (n,), and what the mean over
    the elements of the response of a window (s,) loses in one cell, of the best (n,) [dB]."""
    table, response = _response(np.ptp(places, axis=1).max(initial=0.0), taper)
    held = np.zeros(len(places))
    for i, x in enumerate(places):
        away = np.abs(x - np.arange(x.min(), x.max() + _OFF, _OFF)[:, None])
        held[i] = np.interp(away, table, response).mean(axis=1).max() ** 2
    return np.ptp(places, axis=1), -db(np.maximum(held, 1e-30))


def _response(most: float, taper: Floats) -> tuple[Floats, Floats]:
    """Return places from 0 to so many cells, and the response of a window (s,) there."""
    count, table = len(taper), np.arange(0.0, most + _CELL, _CELL)
    turn = 2.0 * np.pi * (np.arange(count) - 0.5 * (count - 1)) / count
    return table, np.cos(np.outer(table, turn)) @ taper / taper.sum()


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
