"""MIMO processing: transmitters are separated after the Doppler transform, and folded rates are told apart by the
phases over the virtual array.

By time division transmitter i sends i repetitions later than transmitter 0, and an echo of Doppler shift f meets it
turned by f i T_r; the turn is undone cell by cell. By Doppler division its echoes stand i / (slots T_r) aside. Either
way a channel repeats `slots` times more slowly than the radar, so that f is known but for h / (slots T_r): the wrong h
leaves phase steps between the transmitters (see processing.folds).

Source: Schmid, Feger, Pfeffer, Stelzer, EuCAP 2012 (phase of moving targets under time division); Bechter, Roos,
Waldschmidt, IEEE Microw. Wirel. Compon. Lett. 27(12), 2017 (the same with folded rates).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.processing.folds import folds
from raychan.processing.own_waveform import map_by_waveform
from raychan.processing.range_doppler import mean_power
from raychan.processing.slots import Slots
from raychan.processing.staggered import doppler, hypotheses, resolved, staggered_map
from raychan.radar.radar import Radar
from raychan.records import Cube, RangeDoppler

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex64]


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
    fold, open_ = np.zeros(plain.power.shape, np.int8), None
    slots = Slots.of(radar, hypotheses(radar), rate_window)
    if slots.tested > 1:
        fold, open_ = folds(channels, radar, slots, plain)
    for cells, h in _groups(fold):
        channels[:, :, *cells] = slots.under(channels[:, :, *cells], h)
    spectrum, spare = (x.reshape(-1, *x.shape[2:]) for x in (channels[:many], channels[many:]))
    return resolved(plain, spectrum, fold, plain.noise, slots, open_, spare)


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


def _groups(fold: NDArray[np.int8]) -> list[tuple[tuple[Any, Any], int]]:
    """Return the cells of each fold but 0."""
    return [(np.nonzero(fold == h), int(h)) for h in np.unique(fold) if h]
