"""Tables of windows over very many samples: as those of few, without spectra of hundreds of times as many points."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from raychan.processing.main_lobe import MainLobe
from raychan.radar import near_spectrum, side_lobes
from raychan.radar.windows import NAMES, window
from raychan.run.explanation import point_spread


@pytest.mark.parametrize("n", [300, 301])
@pytest.mark.parametrize("name", NAMES)
def test_tables_of_many_samples_are_those_of_whole_spectra(name, n, monkeypatch):
    def tables():
        lobe = MainLobe(name, n, 2)
        away, taper = np.linspace(-16.0, 16.0, 999), window(name, n)
        later = taper * (np.arange(n) - 0.3 * n)
        return [
            lobe.wave(away), lobe._covariance, side_lobes.main_lobe(name, n),
            side_lobes.SideLobeEnvelope(name, n).table, point_spread._table(taper / taper.sum()),
            point_spread._table(later / np.abs(later).sum()),
        ]  # fmt: skip

    whole = tables()
    for module in (near_spectrum, side_lobes, point_spread):
        monkeypatch.setattr(module, "MANY", n - 1)
    for expected, found in zip(whole, tables(), strict=True):
        assert np.allclose(found, expected, rtol=0.0, atol=1e-11)


def test_the_main_lobe_of_very_many_samples_takes_no_spectrum_of_all():
    tracemalloc.start()
    try:
        lobe = MainLobe("hann", 1 << 17, 2)
        first = side_lobes.main_lobe("hann", 1 << 17)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 64e6, "the whole spectrum has 1 GB"
    assert first == 2.0
    assert lobe.wave(np.array([0.0, 2.0])) == pytest.approx([1.0, 0.5], abs=1e-4)


def test_a_range_response_and_its_derivative_are_those_of_a_gradient():
    both = point_spread._in_range("hann", 64)
    assert np.array_equal(both[:, 1], np.gradient(both[:, 0], 1.0 / point_spread._FINE))
