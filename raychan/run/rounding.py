"""What the steps of a converter do to a frame beyond noise: detections of their own, wrong levels, lost echoes.

Thermal noise dithers: the error of rounding then is white, but for its mean over the noise, which is a function of the
samples without noise (see signal.converter). This mean is what makes spurs. Its map is compared with what was detected.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from raychan.radar.radar import Radar
from raychan.records import Cube
from raychan.run.explanation.directions import UNEXPLAINED
from raychan.run.numbered import numbers, share_of
from raychan.run.receiver import FAINT, channel, noise_of_beam, quiet_spectrum
from raychan.run.result import CLUTTER, ExplainedDetections, Explanation
from raychan.signal.converter import before_rounding, dithered, rounding_error
from raychan.units import db, undb

Floats = NDArray[np.float64]
Samples = NDArray[np.complexfloating[Any, Any]]

_LEAST_DB = 0.1  # change of a level that is told: less is as good as right; not measured
_NOISE = 0.5  # of a cell's noise: less changes a level by less than noise does, by one standard deviation
_GONE = 0.5  # of an echo's power: what is left of one that is told as lost; not measured
_ONE_LINE = 4.0  # times the mean power of samples: the most that one cell reads, of a constant in real samples
_VISIBLE = 6.0  # times the floor of a spectrogram: stronger marks are told; random peaks stay below; not measured
_BESIDE = 5  # map cells: the window in which an echo is the strongest


@dataclass(frozen=True)
class Rounding:
    """Samples without thermal noise as they reach a converter, and the mean error of rounding them."""

    signal: Samples
    error: Samples


def spoils(radar: Radar) -> bool:
    """Return whether a radar has a converter whose steps its noise does not dither."""
    faults, noise = radar.impairments, radar.noise_power if radar.noise else 0.0
    least = 0.5 * noise * min(1.0, float(undb(faults.iq_gain_db)))
    return faults.converter is not None and not dithered(faults.converter, least)


def rounding_of(samples: Samples, radar: Radar) -> Rounding | None:
    """Return what a radar's converter rounds of samples without thermal noise, and how; None if noise dithers all."""
    if not spoils(radar):
        return None
    faults, wave = radar.impairments, radar.waveform
    noise = radar.noise_power if radar.noise else 0.0
    there = before_rounding(samples, faults, wave.complex_sampling)
    return Rounding(there, rounding_error(there, faults, noise, wave.complex_sampling))


def coarse(
    rounding: Rounding | None,
    found: ExplainedDetections,
    reasons: Sequence[Explanation],
    radar: Radar,
    settings: Any,
) -> list[str]:
    """Return a line if a converter's steps make detections, change levels by more than noise and what is stated, or
    take echoes away."""
    noise = noise_of_beam(radar, settings)
    if rounding is None:
        return []
    if _ONE_LINE * float((np.abs(rounding.error) ** 2).mean()) <= _NOISE * noise:
        return []
    signal, error = (_spectrum(x, radar, settings) for x in (rounding.signal, rounding.error))
    power, wrong = ((np.abs(x) ** 2).mean(axis=0) for x in (signal, error))
    # Of an array, what a beam towards the cell's own echo sees of the error.
    share = (signal.conj() * error).mean(axis=0) / np.maximum(power, np.finfo(np.float32).tiny)
    at = tuple(found.cell.T)
    noisy = np.array([why.label == CLUTTER and not why.contributions for why in reasons], bool)
    made = noisy & (wrong[at] >= UNEXPLAINED * found.power) & (wrong[at] > power[at])
    change = np.abs(db(np.maximum(np.abs(1.0 + share[at]) ** 2, 1e-30)))
    stated = np.where(found.converged, found.error_db, 0.0)
    changed = ~noisy & (change > np.maximum(_LEAST_DB, stated)) & (np.abs(share[at]) ** 2 * power[at] > _NOISE * noise)
    least = max(float(undb(settings.min_snr_db)) * noise, FAINT * float(power.max(initial=0.0)))
    there = (power >= least) & (power == maximum_filter(power, _BESIDE, mode="wrap"))
    gone = there & (np.abs(1.0 + share) ** 2 < _GONE)
    parts = [f"makes {_named(made)}"] if made.any() else []
    if changed.any():
        parts.append(f"changes the levels of {_named(changed)} by up to {change[changed].max():.2g} dB")
    return _line(parts, float(power[gone].max(initial=0.0)), radar)


def coarse_picture(signal: Floats, rounded: Floats, error: Floats, noise: float, radar: Radar) -> list[str]:
    """Return a line if a converter's steps make marks in a spectrogram, or change its peaks.

    Args: powers (t, v) [W] of the samples without noise, of these with the mean error of rounding, and of that error
    alone; noise [W] of a cell.
    """
    seen = _VISIBLE * (noise + float(error.mean()))
    made = (error >= seen) & (error > signal)
    at = np.arange(len(signal)), signal.argmax(axis=1)
    peak, left = signal[at], rounded[at]
    strong = (peak >= _VISIBLE * noise) & (error[at] > _NOISE * noise)
    change = np.abs(db(np.maximum(left, 1e-30 * peak) / np.maximum(peak, 1e-300)))
    gone = strong & (left < _GONE * peak)
    changed = strong & ~gone & (change > _LEAST_DB)
    parts = [f"makes marks of up to {_dbm(float(error[made].max()))}"] if made.any() else []
    if changed.any():
        parts.append(f"changes levels by up to {change[changed].max():.2g} dB")
    return _line(parts, float(peak[gone].max(initial=0.0)), radar)


def _line(parts: list[str], gone: float, radar: Radar) -> list[str]:
    """Return a line on what steps do; none if they do nothing. Args: parts of its sentence; gone [W], the strongest of
    the echoes that are lost, 0 if none is."""
    converter = radar.impairments.converter
    parts = parts + ([f"takes 3 dB or more off echoes of up to {_dbm(gone)}"] if gone > 0.0 else [])
    if converter is None or not parts:
        return []
    noise = f" against noise of {_dbm(radar.noise_power)} in a sample" if radar.noise else ", without noise"
    return [
        f"the converter's step of {_dbm(converter.step**2)} is coarse{noise}: rounding {', '.join(parts)}, which no "
        "error stated holds; more adc_bits or a lower adc_full_scale_dbm avoids it"
    ]


def _spectrum(samples: Samples, radar: Radar, settings: Any) -> Samples:
    return quiet_spectrum(channel(Cube(np.asarray(samples, np.complex64), 0.0), radar).samples, radar, settings)


def _named(chosen: NDArray[np.bool_]) -> str:
    return f"{share_of(chosen)} ({numbers(chosen)})"


def _dbm(power: float) -> str:
    return f"{db(max(power, 1e-300)) + 30.0:.1f} dBm"
