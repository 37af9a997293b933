"""Sets of waves that explain as much of a cell as the true ones: better ones are given, and what is open is marked."""

from __future__ import annotations

import numpy as np
import pytest
from support.arrays import noise

from raychan.processing.angles import echoes_in
from raychan.processing.cell_echoes import CellEchoes
from raychan.processing.scan import Scan
from raychan.radar.aperture import Aperture


def drawn(places: int, waves: int, seed: int, level: float = 36.0) -> tuple[Aperture, np.ndarray, np.ndarray]:
    """Return elements at free places in a plane, cosines (waves, 2) that correlate little, and a snapshot of them with
    noise of 1 W; level [dB] in the beam."""
    rng = np.random.default_rng([seed, places, waves])
    aperture = Aperture(rng.uniform(-1.0, 1.0, (places, 3)) * [0.0, 1.0, 1.0] * rng.uniform(0.8, 3.0), 1.0)
    while True:
        at = rng.uniform(-0.65, 0.65, (waves, 2))
        steering = aperture.steering(at)
        alike = np.abs(np.triu(steering @ steering.conj().T, 1)) / places
        apart = aperture.apart(at[:, None], at[None])[np.triu_indices(waves, 1)]
        if (alike**2).max() < 0.3 and apart.min(initial=9.0) > 1.0:
            break
    turns = np.exp(2j * np.pi * rng.random(waves)) * np.sqrt(10.0 ** (0.1 * level) / places)
    return aperture, at, turns @ steering + noise(rng, places)


def held(aperture: Aperture, snapshot: np.ndarray) -> CellEchoes:
    """Return the echoes of a cell of noise 1 W in each element."""
    return echoes_in(snapshot, Scan(aperture, "bartlett", 1e3), 25.0 / len(snapshot), 1e6, noise=1.0)


def wrong(aperture: Aperture, at: np.ndarray, found: CellEchoes) -> np.ndarray:
    """Return which directions of echoes are those of no wave."""
    return np.asarray(aperture.apart(found.direction[:, None], at[None]).min(axis=1) > 0.2)


@pytest.mark.parametrize(("places", "waves", "most"), [(5, 2, 0), (6, 2, 1), (6, 3, 1), (8, 3, 1)])
def test_wrong_directions_of_few_elements_to_an_echo_are_marked(places, waves, most):
    unmarked = 0
    for seed in range(15):
        aperture, at, snapshot = drawn(places, waves, seed)
        found = held(aperture, snapshot)
        unmarked += bool((wrong(aperture, at, found) & ~found.unsure(aperture)).any())
    assert unmarked <= most


@pytest.mark.parametrize(("places", "waves"), [(6, 1), (8, 2)])
def test_echoes_of_which_no_others_explain_as_much_are_found_and_not_marked(places, waves):
    marked = 0
    for seed in range(15):
        aperture, at, snapshot = drawn(places, waves, seed) if waves > 1 else drawn(places, waves, seed, 30.0)
        found = held(aperture, snapshot)
        assert len(found.power) == waves and not wrong(aperture, at, found).any()
        marked += bool(found.unsure(aperture).any())
    assert marked <= (waves > 1)
