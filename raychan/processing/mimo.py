"""MIMO processing: transmitters are separated after the Doppler transform, and folded rates are told apart by the
phases over the virtual array.

By time division transmitter i sends i repetitions later than transmitter 0, and an echo of Doppler shift f meets it
turned by f i T_r; the turn is undone cell by cell. By Doppler division its echoes stand i / (slots T_r) aside. Either
way a channel repeats `slots` times more slowly than the radar, so that f is known but for h / (slots T_r): the wrong h
leaves phase steps between the transmitters. Per cell h is the hypothesis under which the virtual array forms the
strongest beam.

Source: Schmid, Feger, Pfeffer, Stelzer, EuCAP 2012 (phase of moving targets under time division); Bechter, Roos,
Waldschmidt, IEEE Microw. Wirel. Compon. Lett. 27(12), 2017 (the same with folded rates).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.processing.own_waveform import map_by_waveform
from raychan.processing.range_doppler import mean_power
from raychan.processing.staggered import doppler, fold_range, hypotheses, least_power, resolved, staggered_map
from raychan.radar.radar import Radar
from raychan.records import Cube, RangeDoppler
from raychan.units import C0

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex64]

# Single values not measured.
_SURE = 1.05  # by which the beam of a folded hypothesis must be stronger than that of the unfolded one
_PER_BEAM = 4  # beams tested per aperture's beam width: at most 0.2 dB are lost between two
_BATCH = 1 << 22  # cells times beams at once: bounds the memory


def virtual_range_doppler(
    cube: Cube,
    radar: Radar,
    range_window: str = "hann",
    rate_window: str = "hann",
    pad: tuple[int, int] = (2, 2),
    resolve: bool = True,
) -> RangeDoppler:
    """Return the map of a frame by virtual channels (t * a, v, r); with one transmitter that of `range_doppler`.

    Args: windows and pad as there; resolve: find the folds of strong cells, which needs two receivers; without it
    powers are right but phases are those of echoes that do not fold.
    Returns: RangeDoppler, a ResolvedMap with `resolve`. Raises: ValueError if the cube does not fit the radar.
    """
    given = range_window, rate_window, pad
    if radar.waveform.stagger:
        return staggered_map(cube, radar, given, resolve)
    if len(radar.tx_elements) == 1:
        return map_by_waveform(cube, radar.waveform, *given)
    made = _by_time if radar.multiplexing == "tdm" else _by_doppler
    plain, channels = made(cube, radar, given)
    many = len(radar.tx_elements)
    if not resolve:
        return replace(plain, spectrum=channels[:many].reshape(-1, *channels.shape[2:]))
    fold = _folds(channels, radar, plain) if hypotheses(radar) > 1 else np.zeros(plain.power.shape, np.int8)
    spectrum = channels[:many].copy()
    for cells, h in _groups(fold):
        spectrum[:, :, *cells] = _under(channels[:, :, *cells], h, radar)
    return resolved(plain, spectrum.reshape(-1, *spectrum.shape[2:]), fold, plain.noise, hypotheses(radar))


def _by_time(cube: Cube, radar: Radar, given: Any) -> tuple[RangeDoppler, Complexes]:
    """Return the map of all channels and their spectrum (t, a, v, r), the Doppler phase of later chirps undone."""
    wave, many = radar.channel_waveform, len(radar.tx_elements)
    receivers, _, samples = cube.samples.shape
    # Chirp m is sent by transmitter m modulo t.
    parts = cube.samples.reshape(receivers, wave.n_chirps, many, samples).transpose(2, 0, 1, 3)
    split: NDArray[np.complex64] = parts.reshape(many * receivers, wave.n_chirps, samples)
    map = map_by_waveform(Cube(samples=split, noise_power=cube.noise_power), wave, *given)
    turns = np.outer(np.arange(many) * radar.waveform.repetition, doppler(map, radar))
    undone = np.exp(2j * np.pi * turns).astype(np.complex64)
    channels = map.spectrum.reshape(many, receivers, *map.spectrum.shape[1:]) * undone[:, None, :, None]
    return map, channels


def _by_doppler(cube: Cube, radar: Radar, given: Any) -> tuple[RangeDoppler, Complexes]:
    """Return the map of all slots, its noise that of all chirps, and its spectrum (slots, a, v, r).

    Slot k holds transmitter k where echoes do not fold; slots beyond the transmitters then are empty.
    """
    wave, slots, made = radar.waveform, radar.slots, []
    _ = radar.channel_waveform  # refuses chirps that are no multiple of the slots
    for k in range(slots):
        code = np.exp(-2j * np.pi * (k * np.arange(wave.n_chirps) % slots) / slots).astype(np.complex64)
        turned = Cube(samples=cube.samples * code[:, None], noise_power=cube.noise_power)
        whole = map_by_waveform(turned, wave, *given)
        count = len(whole.rate) // slots
        rows = slice(len(whole.rate) // 2 - count // 2, len(whole.rate) // 2 - count // 2 + count)
        made.append(whole.spectrum[:, rows])
    channels = np.stack(made)
    many = len(radar.tx_elements)
    flat = channels[:many].reshape(-1, *channels.shape[2:])
    power = mean_power(flat)
    limit = whole.unambiguous_rate / slots
    return replace(whole, rate=whole.rate[rows], spectrum=flat, power=power, unambiguous_rate=limit), channels


def _under(channels: Complexes, h: int, radar: Radar) -> Complexes:
    """Return channels (t, a, ...) if the echo is folded h times, from what the cells hold (t or slots, a, ...)."""
    many, slots = len(radar.tx_elements), radar.slots
    if radar.multiplexing == "ddm":
        return np.asarray(channels[(np.arange(many) - h) % slots])
    turn = np.exp(2j * np.pi * (h * np.arange(many) % slots) / slots).astype(np.complex64)
    return np.asarray(channels * turn.reshape(-1, *[1] * (channels.ndim - 1)))


def _folds(channels: Complexes, radar: Radar, map: RangeDoppler) -> NDArray[np.int8]:
    """Return by how many spans the strongest echo of each cell is folded (v, r)."""
    fold = np.zeros(map.power.shape, np.int8)
    level = least_power(map, len(radar.virtual_elements))
    at = np.argwhere((np.abs(channels) ** 2).mean(axis=(0, 1)) > level)
    steering = _steering(radar)
    for some in np.array_split(at, max(1, len(at) * len(steering) // _BATCH)):
        held = channels[:, :, some[:, 0], some[:, 1]]
        best, power = np.zeros(len(some), np.int8), np.zeros(len(some))
        for h in fold_range(radar.slots):
            beams = steering @ _under(held, h, radar).reshape(steering.shape[1], -1)
            strongest = (np.abs(beams) ** 2).max(axis=0)
            better = strongest > (_SURE if h else 1.0) * power
            best[better], power[better] = h, strongest[better]
        fold[some[:, 0], some[:, 1]] = best
    return fold


def _steering(radar: Radar) -> Complexes:
    """Return weights (beams, t * a) of beams over the half space ahead."""
    places, wave = radar.virtual_elements, C0 / radar.waveform.middle
    sines = []
    for axis in (1, 2):
        extent = float(np.ptp(places[:, axis])) / wave
        count = int(np.ceil(_PER_BEAM * extent)) if extent > 0.0 else 0
        sines.append(np.linspace(-1.0, 1.0, 2 * count + 1) if count else np.zeros(1))
    y, z = (x.ravel() for x in np.meshgrid(*sines))
    ahead = y * y + z * z <= 1.0
    look = np.stack([np.sqrt(np.maximum(1.0 - y * y - z * z, 0.0)), y, z], axis=1)[ahead]
    return np.exp(-2j * np.pi / wave * (look @ places.T)).astype(np.complex64)


def _groups(fold: NDArray[np.int8]) -> list[tuple[tuple[Any, Any], int]]:
    """Return the cells of each fold but 0."""
    return [(np.nonzero(fold == h), int(h)) for h in np.unique(fold) if h]
