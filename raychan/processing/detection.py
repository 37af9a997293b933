"""Detections in a range-Doppler map: local maxima over the CFAR threshold that are no side lobes, with sub-bin
interpolation, and the echoes that an array tells apart within them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.processing import twins
from raychan.processing.beams import BeamBank
from raychan.processing.cell_split import Splitter
from raychan.processing.cfar import GUARD, TRAIN, Grid, Training, bias, factor, training
from raychan.processing.detector_map import BEAMS, DetectorMap, MeanPower, StrongestBeam
from raychan.processing.found import BEFORE, Echoes, Found, Peaks
from raychan.processing.line_lobes import LineLobes
from raychan.processing.near_field import parts_of
from raychan.processing.peak_shape import PeakShape
from raychan.processing.peaks import SideLobes
from raychan.processing.scan import Scan
from raychan.processing.staggered import ResolvedMap
from raychan.radar.aperture import Aperture
from raychan.radar.waveform import OwnWaveform, Waveform
from raychan.records import Detections, RangeDoppler
from raychan.units import C0, db, undb

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_TINY = 1e-300
METHODS = ("bartlett", "capon", "music", "esprit")


@dataclass(frozen=True)
class Array:
    """What an array does with its receivers. Raises: ValueError for words that are none of these."""

    beams: str = "coherent"
    """coherent: the CFAR sees the strongest of a bank of beams; mean: the mean power of the receivers."""
    doa: str = "bartlett"
    """How directions are found: bartlett, capon, music or esprit (see processing.doa)."""
    beam_window: str = "rect"
    """Taper of the detector's beams; directions are found without."""

    def __post_init__(self) -> None:
        for name, value, known in (("beams", self.beams, BEAMS), ("doa", self.doa, METHODS)):
            if value not in known:
                raise ValueError(f"{name} = {value!r}: must be one of {', '.join(known)}")


@dataclass(frozen=True)
class _Bar:
    """What the power of a cell is held against: `factor` times the level of its training cells, of a false alarm
    probability."""

    seen: DetectorMap
    ring: Training
    method: str
    factor: float

    @classmethod
    def of(cls, seen: DetectorMap, pfa: float, method: str, ring: Training) -> _Bar:
        """Return the bar of a map as a detector sees it."""
        return cls(seen, ring, method, factor(seen.single(pfa), ring.worth, method, seen.looks))

    def local(self, cells: Ints) -> Floats:
        """Return the level (c,) of the training cells around map cells (c, 2)."""
        return self.seen.level(cells, self.ring, self.method)

    def estimate(self, local: Floats) -> Floats:
        """Return the noise (c,) [W] of a cell by the level of its training cells."""
        return local / bias(self.ring.worth, self.method, self.seen.looks)

    def noise(self, local: Floats) -> Floats:
        """Return the thermal noise (c,) [W] of a cell, as estimated where it is unknown."""
        return np.full(len(local), self.seen.noise) if self.seen.noise > 0.0 else self.estimate(local)

    def of_beam(self, bank: BeamBank, local: Floats, pfa: float) -> Floats:
        """Return the power (c,) below which a beam of a cell is noise, by the level of its training cells."""
        if isinstance(self.seen, StrongestBeam):
            return self.factor * local
        # The mean power of several looks has another threshold.
        return factor(bank.single(pfa), self.ring.worth, self.method) * self.estimate(local) * bank.noise_gain


def seen_in(
    map: RangeDoppler, waveform: Waveform | None = None, elements: Floats | None = None, array: Array | None = None
) -> DetectorMap:
    """Return a map as `detect` sees it: by a bank of beams, or by the mean power of its receivers; args and errors as
    there."""
    array, aperture = array or Array(), _aperture(map, waveform, elements)
    mirrors = waveform is not None and not isinstance(waveform, OwnWaveform) and not waveform.complex_sampling
    # By Doppler division an image falls on other slots than its echo.
    mirrors &= not (isinstance(map, ResolvedMap) and map.slots.shifted)
    if aperture and array.beams == "coherent":
        return StrongestBeam(map, BeamBank(aperture, array.beam_window), mirrors)
    return MeanPower(map, mirrors)


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
    chirps: int | None = None,
    waveform: Waveform | None = None,
    elements: Floats | None = None,
    senders: Floats | None = None,
    array: Array | None = None,
    seen: DetectorMap | None = None,
) -> Detections:
    """Return the detections of a map: local maxima over CFAR threshold and minimum SNR that are no side lobes.

    SNR is the power at the sub-bin peak over the thermal noise per cell, or, where that is unknown (0), over the noise
    estimated from the training cells; of an echo with a direction, over the noise in its beam. Speed is rate plus
    ego_speed. Peaks below the window's response to stronger detections, or to what is
    stronger in their row or column, are dropped.
    Args: method ca or os; guard [resolution cells], train [cells a side] and windows: all (rate, range), see
    processing.cfar; chirps that the window along rate weighs, where they are not the map's resolution cells; waveform,
    for the response and the range migration of echoes and, with elements (a, 3) [m], for angles; senders (t, 3) [m],
    transmitters of virtual elements; array, how these are used; seen, the map as `seen_in` returns it, if known.
    Raises: ValueError on bad arguments.
    """
    grid, array, aperture = Grid.of(map), array or Array(), _aperture(map, waveform, elements)
    bank = BeamBank(aperture, array.beam_window) if aperture else None
    seen = seen or seen_in(map, waveform, elements, array)
    bar = _Bar.of(seen, pfa, method, training(grid, guard, train, windows))
    cells = seen.maxima(seen.dip * float(undb(min_snr_db)) * seen.noise)
    local = bar.local(cells)
    over = seen.power[tuple(cells.T)] > bar.factor * local
    cells, local = cells[over], local[over]
    shape = PeakShape.of(grid, windows, waveform, chirps)
    shift, power = _refined(map, seen, shape, cells, aperture)
    noise = bar.noise(local)
    # The SNR of an echo with a direction is known when that is found; here it may be the dip lower.
    strong = np.flatnonzero(db(power / np.maximum(noise, _TINY)) >= min_snr_db + (db(seen.dip) if aperture else 0.0))
    strong = strong[np.argsort(-power[strong], kind="stable")]
    cells, shift = cells[strong], shift[strong]
    power, noise, local = power[strong], noise[strong], local[strong]

    lobes, shown = SideLobes.of(grid, windows, waveform, chirps), seen.power[tuple(cells.T)]
    smears = _smears(map, waveform)
    smear, lines = smears[tuple(cells.T)], LineLobes(seen, SideLobes(grid, windows, chirps), grid.pad, smears)
    if aperture is None or bank is None:
        place = (cells + np.clip(shift, -0.5, 0.5)) / np.array(grid.pad)
        kept = lobes.own(place, power, smear, shown, besides=lambda i: lines.own(cells[i]))
        return _reported(map, grid, Found(cells, shift, power, noise).take(kept), ego_speed, wraps=shape.wraps)
    towards = bank.directions[bank.towards(map.spectrum, cells)]
    peaks = Peaks(cells, shift, power, noise, shown, bar.of_beam(bank, local, pfa), smear, towards)
    scan, coherent = _scan(map, aperture, senders, array.doa, lobes.mirrors), array.beams == "coherent"
    echoes = Splitter(map, grid, lobes, lines, shape, scan, seen.receiver_noise, coherent).split(peaks)
    loud = db(echoes.power / np.maximum(echoes.noise, _TINY)) >= min_snr_db
    return _reported(map, grid, echoes.take(loud), ego_speed, aperture, seen.looks, shape.wraps)


def _scan(map: RangeDoppler, aperture: Aperture, senders: Floats | None, method: str, mirrors: bool) -> Scan:
    """Return how directions are sought. Args: senders (t, 3) [m] of virtual elements; mirrors, by real samples."""
    # By these ranges beyond the map come back in it as images, whose waves are curved the other way.
    beyond = np.inf if mirrors else map.unambiguous_range
    return Scan(aperture, method, map.range_resolution, parts_of(aperture.elements, senders), beyond=beyond)


def least_power(
    map: RangeDoppler,
    cells: Ints,
    *,
    pfa: float = 1e-7,
    min_snr_db: float = 20.0,
    method: str = "os",
    guard: tuple[int, int] = GUARD,
    train: tuple[int, int] = TRAIN,
    windows: tuple[str, str] = ("hann", "hann"),
    chirps: int | None = None,
    waveform: Waveform | None = None,
    elements: Floats | None = None,
    array: Array | None = None,
    seen: DetectorMap | None = None,
) -> Floats:
    """Return the power (c,) [W] that local maxima in map cells (c, 2) need to become detections, side lobes or not.

    Args and errors as for `detect`.
    """
    aperture, seen = _aperture(map, waveform, elements), seen or seen_in(map, waveform, elements, array)
    grid = Grid.of(map)
    bar = _Bar.of(seen, pfa, method, training(grid, guard, train, windows))
    local = bar.local(cells)
    _, peak = _refined(map, seen, PeakShape.of(grid, windows, waveform, chirps), cells, aperture)
    above = peak / np.maximum(bar.seen.power[tuple(cells.T)], _TINY)
    loud = float(undb(min_snr_db)) * bar.noise(local) * (bar.seen.dip if aperture else 1.0) / above
    return np.asarray(np.maximum(bar.factor * local, loud))


def _aperture(map: RangeDoppler, waveform: Waveform | None, elements: Floats | None) -> Aperture | None:
    """Return the aperture of the receivers; None where it is not known or measures no angle."""
    if waveform is None or elements is None:
        return None
    aperture = Aperture(elements, C0 / waveform.middle)
    if len(aperture.elements) != len(map.spectrum):
        raise ValueError(f"elements: {len(aperture.elements)} given for a map of {len(map.spectrum)} receivers")
    return aperture if any(aperture.scans) else None


def _refined(
    map: RangeDoppler, seen: DetectorMap, shape: PeakShape, cells: Ints, aperture: Aperture | None
) -> tuple[Floats, Floats]:
    """Return the offsets (c, 2) in cells and the power (c,) of the peaks at map cells (c, 2); with an aperture those of
    lone echoes."""
    lone = shape.refine(seen.power, cells)
    if aperture:
        return lone
    alike = not isinstance(map, ResolvedMap)
    return shape.among(lambda v, r: map.spectrum[:, v, r], len(map.spectrum), cells, lone, seen.power.shape, alike)


def _rate(map: RangeDoppler, grid: Grid, place: Floats, fold: Ints) -> Floats:
    """Return the rates [m/s] at places (n, 2) in map cells, folded so many times (n,), within those told apart."""
    limit = map.resolved_rate if isinstance(map, ResolvedMap) else map.unambiguous_rate
    rate: Floats = map.rate[0] + place[:, 0] * (map.rate_resolution / grid.pad[0])
    rate = rate + 2.0 * map.unambiguous_rate * fold
    return np.where(np.abs(rate) <= limit, rate, (rate + limit) % (2.0 * limit) - limit)


def _smears(map: RangeDoppler, waveform: Waveform | None) -> Floats:
    """Return the range cells (v, r) over which echoes in map cells migrate during the frame, by their true rates where
    the map knows how they fold."""
    rate: Floats = map.rate[:, None]
    if isinstance(map, ResolvedMap):
        rate = rate + 2.0 * map.unambiguous_rate * map.fold
    duration = waveform.frame_duration if waveform else 0.0
    return np.broadcast_to(np.abs(rate) * (duration / map.range_resolution), map.power.shape)


def _reported(
    map: RangeDoppler,
    grid: Grid,
    found: Found,
    ego_speed: float,
    aperture: Aperture | None = None,
    looks: int = 1,
    wraps: bool = False,
) -> Detections:
    """Return what is found as detections; with an aperture, of echoes with their directions, and SNR that is that in a
    beam over `looks`. Args: wraps, whether the last range cell is beside the first."""
    place = found.place
    # No echo comes from before the radar: where the ranges wrap such a peak is one at their far end.
    place[:, 1] += map.power.shape[1] * (wraps & (place[:, 1] < -BEFORE))
    place = np.maximum(place, (-np.inf, 0.0))
    fold = np.zeros(len(place), np.int64)
    if isinstance(map, ResolvedMap):
        fold = found.fold if isinstance(found, Echoes) else map.fold[tuple(found.cells.T)].astype(np.int64)
    rate = _rate(map, grid, place, fold)
    angles = np.full((2, len(rate)), np.nan)
    ambiguous, beam = np.zeros(len(rate), bool), np.zeros((len(rate), 0), complex)
    if aperture is not None and isinstance(found, Echoes):
        angles = np.array(aperture.angles(found.direction))
        snr = looks * found.power / np.maximum(found.noise, _TINY)
        ambiguous, beam = found.unsure | twins.ambiguous(aperture, found.direction, snr), found.weights
    return Detections(
        range=map.range[0] + place[:, 1] * (map.range_resolution / grid.pad[1]),
        rate=rate,
        speed=rate + ego_speed,
        azimuth=angles[0],
        elevation=angles[1],
        ambiguous=ambiguous,
        snr=db(found.power / np.maximum(found.noise, _TINY)),
        power=found.power,
        cell=found.cells.astype(np.int32),
        beam=beam,
    )
