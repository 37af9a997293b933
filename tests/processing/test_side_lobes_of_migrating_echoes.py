"""Side lobes of an echo that moves over range cells during the frame: bounded as the direct sum over chirps and samples
has them, and no detections beside it."""

from __future__ import annotations

import re

import numpy as np
import pytest

import raychan as rc
from raychan.radar.side_lobes import MigratingEnvelope
from raychan.radar.windows import window


def direct_sum(names, count, moved, slots, places):
    """Return the power response (p,) at places (p, 2) [cells along rate and range] from the middle of the frame."""
    when, tapers = [(np.arange(n) - 0.5 * (n - 1)) / n for n in count], map(window, names, count)
    chirps, samples = (x / x.sum() for x in tapers)
    beats = samples * np.exp(2j * np.pi * moved * np.outer(*when))
    found = []
    for rate, reach in places:
        rows = beats @ np.exp(-2j * np.pi * reach * when[1]) * chirps
        folds = rate + np.arange(slots) * count[0] / slots
        found.append(np.abs(np.exp(-2j * np.pi * np.outer(folds, when[0])) @ rows).sum() ** 2)
    return np.array(found)


@pytest.mark.parametrize(
    ("names", "moved", "slots"),
    [
        (("rect", "rect"), 4.9, 1),
        (("hamming", "taylor(30)"), 3.0, 1),
        (("hann", "hann"), 2.5, 3),
        (("rect", "blackman"), 7.3, 1),
    ],
)
def test_the_envelope_bounds_the_direct_sum_about_each_peak_and_is_no_higher_than_it_needs(names, moved, slots):
    count, rng = (48, 64), np.random.default_rng(3)
    envelope = MigratingEnvelope(names, count, moved, slots)
    fine = np.stack(np.meshgrid(*[np.arange(0.0, 0.5 * moved + 1.0, 0.1)] * 2, indexing="ij"), -1).reshape(-1, 2)
    level = direct_sum(names, count, moved, slots, fine)
    # The peak is found, and lies no farther from the middle of the frame than the envelope holds.
    assert (fine[level.argmax()] <= envelope.off + 0.25).all()
    places = rng.uniform(0.0, 1.0, (600, 2)) * [0.5 * count[0] / slots, 0.5 * count[1]]
    seen, bound = direct_sum(names, count, moved, slots, places) / level.max(), envelope(*places.T)
    # Between points of its table a side lobe of rectangular windows is up to 0.9 dB higher along each axis.
    assert (seen <= 10.0**0.18 * bound + 1e-12).all()
    # Along the rates there are side lobes everywhere that come near it.
    bands = np.digitize(places[:, 0], np.arange(4.0, 0.5 * count[0] / slots, 4.0))
    assert all((seen / bound)[(bands == k) & (bound > 1e-10)].max() > 0.25 for k in np.unique(bands))


@pytest.mark.parametrize(
    ("names", "moved"), [(("rect", "rect"), 4.9), (("hamming", "taylor(30)"), 3.0), (("rect", "hamming"), 40.0)]
)
def test_the_envelope_of_frames_of_many_samples_is_that_of_fewer_and_bounds_the_direct_sum(names, moved):
    """Of 900 x 700 samples, by a table of 512 each: also farther off than that reaches, and to its last cells."""
    count, rng = (900, 700), np.random.default_rng(4)
    envelope = MigratingEnvelope(names, count, moved)
    fine = np.stack(np.meshgrid(*[np.arange(0.0, 0.5 * moved + 1.0, 0.25)] * 2, indexing="ij"), -1).reshape(-1, 2)
    top = direct_sum(names, count, moved, 1, fine).max()
    places = rng.uniform(0.0, 1.0, (150, 2)) ** 2 * [0.5 * count[0], 0.5 * count[1]]
    ends = [[255.9, 3.0], [256.0, 0.5], [300.3, 1.2], [2.1, 255.9], [0.3, 340.5], [449.5, 0.0]]
    places = np.concatenate([places, ends])
    seen, bound = direct_sum(names, count, moved, 1, places) / top, envelope(*places.T)
    assert (seen <= 10.0**0.18 * bound + 1e-12).all()
    near = (places < 64.0).all(axis=1)
    assert envelope.table.shape == (513, 513) and (seen / bound)[near].max() > 0.25


@pytest.mark.parametrize("windows", [("rect", "rect"), ("rect", "taylor(30)"), ("hamming", "rect")])
@pytest.mark.parametrize("elements", [1, 4])
def test_an_echo_that_migrates_is_one_detection(windows, elements):
    wave = rc.Waveform(24e9, 3e9, 60e-6, repetition=68.4e-6, n_chirps=120, n_samples=128)
    settings = rc.Processing(range_window=windows[0], rate_window=windows[1])
    ball = {"shape": "sphere", "params": {"radius": 0.005}, "rcs_dbsm": 14.0}
    body = rc.Body(name="ball", position=(3.4, 0.0, 0.0), velocity=(-30.0, 0.0, 0.0), **ball)
    array = rc.uniform_array(elements, 0.006) if elements > 1 else ((0.0, 0.0, 0.0),)
    radar = rc.Radar(wave, position=(0.0, 0.0, 0.0), elements=array, processing=settings)
    run = rc.simulate(rc.Scene([body], radar=radar, model={"max_bounces": 1}), seed=1)
    found = run.detections
    assert found.snr[0] > 45.0
    assert found.rate == pytest.approx([-30.0], abs=2.0 * wave.rate_resolution)
    # Its place is off by cells, and the run says by how many at most.
    (line,) = [x for x in run.warnings if "over range cells" in x]
    reach, rate = map(float, re.search(r"up to ([0-9.]+) range cells and ([0-9.]+) rate cells off", line).groups())
    away = abs(found.range[0] - (3.4 - 15.0 * wave.frame_duration)) / wave.range_resolution
    assert away <= reach + 0.25
    assert abs(found.rate[0] + 30.0) / wave.rate_resolution <= rate + 0.25
    assert windows != ("rect", "rect") or away > 1.0
