"""A preview beside the fine run of the same scene."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from raychan.records import MIRROR
from raychan.run.result import DIRECT, Result

_MOSTLY = 2.0 / 3.0  # of an echo's power: a preview has no bounces


@dataclass(frozen=True)
class Beside:
    """Direct detections of a fine run, of echoes of which one body scattered most once, beside those of a preview: by
    how many resolution cells the nearest is off, by how many dB, and what the preview states [dB], all (n,); `snr` (n,)
    [dB] of the fine run's and `error` (n,) [dB] that it states, NaN where unknown."""

    cells: np.ndarray
    level: np.ndarray
    stated: np.ndarray
    snr: np.ndarray
    error: np.ndarray
    name: tuple[str, ...]


def beside(fine: Result, coarse: Result) -> Beside:
    """Return the detections of a fine run beside those of a preview."""
    wave = fine.require_scene().radar.waveform
    sizes = wave.range_resolution, 0.5 * wave.wavelength / wave.frame_duration
    d, p, rows = fine.detections, coarse.detections, []
    for i, why in enumerate(fine.provenance):
        if why.label != DIRECT or sum(c.share for c in why.contributions if _once(fine, c.chain)) < _MOSTLY:
            continue
        off = np.maximum(np.abs(p.range - d.range[i]) / sizes[0], np.abs(p.rate - d.rate[i]) / sizes[1])
        if not len(off):
            rows.append((np.inf, np.nan, np.nan, d.snr[i], d.error_db[i], why.bodies))
            continue
        k = int(np.argmin(off))
        level = 10.0 * np.log10(p.power[k] / d.power[i])
        rows.append((off[k], level, p.error_db[k], d.snr[i], d.error_db[i], why.bodies))
    columns = list(zip(*rows, strict=True)) if rows else [()] * 6
    return Beside(*(np.array(c, float) for c in columns[:5]), tuple(columns[5]))


def _once(result: Result, chain: tuple[str, ...]) -> bool:
    """Tell whether a chain of parts meets one body once, the ground aside."""
    roles = dict(zip(_names(result), _roles(result), strict=True))
    return sum(roles.get(link.partition(".")[0]) != MIRROR for link in chain if not link.startswith("(")) == 1


def _names(result: Result) -> list[str]:
    return [b.name.partition(".")[0] for b in result.require_scene().bodies]


def _roles(result: Result) -> list[int]:
    return [int(b.resolved_role) for b in result.require_scene().bodies]
