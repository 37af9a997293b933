"""Regimes of the receiver: path counts from 0 to 1e7, dynamic range, folding, targets near an array."""

from __future__ import annotations

import time
import tracemalloc
from typing import Any

import numpy as np

from raychan.columns import take
from raychan.processing.range_doppler import range_doppler
from raychan.radar.antenna import IsotropicAntenna
from raychan.radar.radar import Radar
from raychan.radar.waveform import Waveform
from raychan.records import POINT, Paths, RangeDoppler
from raychan.signal.baseband import synthesize
from raychan.study.regimes_base import FREQUENCY, LAMBDA, K, Outcome, Regime, Row, at_most

_WAVE = Waveform(FREQUENCY, 1e9, 25.6e-6, 40e-6, 128, 512)
_GB = 1e9


def _sensor(wave: Waveform = _WAVE, **changes: Any) -> Radar:
    given: dict[str, Any] = {"position": np.zeros(3), "power": 1.0, "noise_figure_db": 15.0, "noise": False} | changes
    return Radar(antenna=IsotropicAntenna(), waveform=wave, **given)


def _echoes(ranges: Any, rates: Any = 0.0, amplitudes: Any = 1.0) -> Paths:
    """Return paths over points straight ahead at ranges [m], of range rates [m/s] and complex amplitudes."""
    r, v, a = np.broadcast_arrays(np.atleast_1d(np.asarray(ranges, float)), rates, amplitudes)
    n = len(r)
    look = np.broadcast_to([1.0, 0.0, 0.0], (n, 3))
    none, at = np.full((n, 1), -1, np.int16), (r[:, None] * look)[:, None].astype(np.float32)
    return Paths.of(
        length=2.0 * r, amplitude=a.astype(complex), length_rate=2.0 * v, departure=look, arrival=look,
        body=none, part=none, kind=np.full((n, 1), POINT, np.int8), vertices=at,
        body_names=(), part_names=(), tx=np.zeros(3), rx=np.zeros(3),
    )  # fmt: skip


def _peak(rdmap: RangeDoppler) -> tuple[float, float, float]:
    """Return range [m], range rate [m/s] and power [W] of the strongest cell."""
    v, r = np.unravel_index(int(rdmap.power.argmax()), rdmap.power.shape)
    return float(rdmap.range[r]), float(rdmap.rate[v]), float(rdmap.power[v, r])


def path_counts(quick: bool) -> Outcome:
    """Check 0 to 1e7 paths: none gives zero samples, copies add linearly, time and memory stay bounded."""
    rng = np.random.default_rng(2)
    rows: list[Row] = []
    radar = _sensor()
    counts = [0, 1, 10, 1_000, 100_000, 1_000_000, *([] if quick else [10_000_000])]
    seconds, held = [], []
    few = 1_000
    unique = _echoes(rng.uniform(1, 70, few), rng.uniform(-20, 20, few), np.exp(2j * np.pi * rng.uniform(size=few)))
    for n in counts:
        copies, rest = divmod(n, few)
        paths = _copies(unique, copies) if copies else _first(unique, rest)
        tracemalloc.start()
        since = time.perf_counter()
        cube = synthesize(paths, radar)
        seconds.append(time.perf_counter() - since)
        held.append(tracemalloc.get_traced_memory()[1] / _GB)
        tracemalloc.stop()
        exact = max(copies, 1) * synthesize(paths if not copies else unique, radar, method="direct").samples
        size = float(np.sqrt(np.mean(np.abs(exact) ** 2)))
        off = float(np.sqrt(np.mean(np.abs(cube.samples - exact) ** 2)))
        truth = "silence" if n == 0 else "term by term" if not copies else "linearity: copies of 1000 echoes"
        rows.append(Row(f"{n} paths: rms error", 0.0, off / size if size else off, 1e-5, "of rms", truth))
        why = "" if held[-1] <= 2.0 else "phases and projections of all paths are held at once"
        rows.append(at_most(f"{n} paths: memory", held[-1], 2.0, "GB", "bound asked", why))
    growth = (seconds[-1] / max(seconds[-2], 1e-9)) / 10.0
    rows.append(at_most("ten times the paths: time over tenfold", growth, 2.0, "", "linear cost"))
    return Outcome(rows, {"count": np.array(counts), "seconds": np.array(seconds), "gigabytes": np.array(held)})


def _copies(paths: Paths, times: int) -> Paths:
    made: Paths = take(paths, np.tile(np.arange(len(paths.length)), times))
    return made


def _first(paths: Paths, n: int) -> Paths:
    made: Paths = take(paths, slice(0, n))
    return made


def dynamic_range(quick: bool) -> Outcome:
    """Put echoes 60 to 120 dB apart into one map, by the direct sum and by the non-uniform FFT."""
    rows: list[Row] = []
    curves: dict[str, Any] = {}
    cell = _WAVE.range_resolution
    window = "chebyshev(150)"
    levels = (0.0, -60.0, -90.0, -120.0)
    ranges = cell * np.array([60.0, 130.0, 200.0, 270.0])
    v = _WAVE.rate_resolution * np.array([0.0, 12.0, -12.0, 24.0])
    # The map shows ranges at the middle of the frame.
    start = ranges - v * _WAVE.centre
    paths = _echoes(start, v, 10.0 ** (np.array(levels) / 20.0))
    for method, tolerance in (("direct", 1e-6), ("nufft", 1e-6), ("nufft", 1e-9)):
        cube = synthesize(paths, _sensor(), method=method, tolerance=tolerance)
        made = range_doppler(cube, _WAVE, window, window)
        label = method if method == "direct" else f"{method} to {tolerance:.0e}"
        curves[label] = made
        for r, rate, level in zip(ranges, v, levels, strict=True):
            at = np.abs(made.rate - rate) <= 1.5 * made.rate_resolution
            near = np.abs(made.range - r) <= 1.5 * cell
            seen = 10 * np.log10(made.power[np.ix_(at, near)].max())
            rows.append(
                Row(f"{label}: echo at {level:g} dB", level, float(seen), 0.5, "dB", "closed form: a lone echo's power")
            )
        away = np.ones(made.power.shape, bool)
        for r, rate in zip(ranges, v, strict=True):
            away &= (np.abs(made.rate[:, None] - rate) > 6 * made.rate_resolution) | (
                np.abs(made.range - r) > 12 * cell
            )
        # Both axes of the map are periodic: all cells count, those of the padding too.
        floor = 10 * np.log10(made.power[away].max())
        rows.append(
            at_most(f"{label}: strongest cell elsewhere", float(floor), -120.0, "dB", "bound asked: 120 dB clear")
        )
    return Outcome(rows, curves)


def folding(quick: bool) -> Outcome:
    """Check echoes beyond the unambiguous range and speed: they fold by the sampling theorem."""
    rows = []
    top = _WAVE.unambiguous_range
    # By the frequency at the middle of the sweep, at which a map measures Doppler.
    fast = 2.0 * range_doppler(synthesize(_echoes(20.0), _sensor()), _WAVE).unambiguous_rate
    for beyond in (0.25, 1.25, 3.25):
        far_away = beyond * top
        made = range_doppler(synthesize(_echoes(far_away), _sensor()), _WAVE)
        seen = _peak(made)[0]
        # The quadratic term of the beat, S tau^2 / 2, is constant over a frame at rest: no shift.
        rows.append(
            Row(f"range of {beyond:g} unambiguous", 0.25 * top, seen, _WAVE.range_resolution, "m", "sampling: modulo")
        )
    for beyond in (0.125, 0.625, 1.125, -2.375):
        rate = beyond * fast
        start = 20.0 - rate * _WAVE.centre
        made = range_doppler(synthesize(_echoes(start, rate), _sensor()), _WAVE)
        seen_range, seen, _ = _peak(made)
        exact = ((beyond + 0.5) % 1.0 - 0.5) * fast
        rows.append(
            Row(f"rate of {2 * beyond:g} unambiguous", exact, seen, made.rate_resolution, "m/s", "sampling: modulo")
        )
        shift = (rate - exact) * FREQUENCY / _WAVE.slope
        rows.append(
            Row(
                f"its range at a rate of {2 * beyond:g}", 20.0 + shift, seen_range, _WAVE.range_resolution, "m",
                "closed form: range-Doppler coupling of the fold",
            )
        )  # fmt: skip
    made = range_doppler(synthesize(_echoes(20.0), _sensor()), _WAVE)
    rows.append(Row("power of a lone echo", 0.0, 10 * np.log10(_peak(made)[2]), 0.5, "dB", "closed form"))
    return Outcome(rows)


def near_array(quick: bool) -> Outcome:
    """Check targets in the near field of a receiving array: the wave at its elements is spherical."""
    rows = []
    count = 16
    y = (np.arange(count) - 0.5 * (count - 1)) * LAMBDA / 2
    elements = np.stack([np.zeros(count), y, np.zeros(count)], axis=1)
    edge = 2 * float(np.ptp(y)) ** 2 / LAMBDA
    radar = _sensor(elements=elements)
    distances = np.array([0.5, 1.0, 4.0, 16.0]) * edge
    worst = []
    for distance in distances:
        cube = synthesize(_echoes(float(distance)), radar)
        seen = np.angle(cube.samples[:, 0, 0] / cube.samples[count // 2, 0, 0])
        mid = K * (_WAVE.carrier / FREQUENCY)
        detour = np.hypot(distance, y) - np.hypot(distance, y[count // 2])
        off = np.angle(np.exp(1j * (seen + mid * detour)))
        worst.append(float(np.abs(off).max()))
        name = f"array of {count}, target at {distance / edge:g} of 2 D2/lambda ({distance:.2f} m)"
        rows.append(Row(name, 0.0, worst[-1], 1e-4, "rad", "closed form: spherical wave"))
    return Outcome(rows, {"distance": distances / edge, "phase": np.array(worst)})


REGIMES = (
    Regime("paths", "Path count from 0 to 1e7", path_counts),
    Regime("dynamic", "Dynamic range of 120 dB in one map", dynamic_range),
    Regime("folding", "Aliased range and speed", folding),
    Regime("near_array", "Target in the near field of the antenna", near_array),
)
