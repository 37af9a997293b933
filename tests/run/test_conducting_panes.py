"""A conducting pane leaves of a ball behind it what a slab of its conductivity at the middle of a ramp passes twice."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc
from raychan.units import C0, EPS0


def _passed(material: rc.Material, frequency: float, angle: float) -> float:
    """Return what a slab passes of a field, by the sum over inner reflections (Born, Wolf 1999, section 1.6.4); H."""
    eps = material.eps(frequency)
    cosine, q = np.cos(angle), np.sqrt(eps - np.sin(angle) ** 2)
    q = q if q.imag <= 0.0 else -q
    r, phase = (cosine - q) / (cosine + q), np.exp(-2j * np.pi * frequency / C0 * material.thickness * q)
    return float(abs((1.0 - r * r) * phase / (1.0 - r * r * phase**2)))


def _ball(wave: rc.Waveform, pane: rc.Material | None) -> rc.Result:
    bodies = [rc.Body(name="ball", shape="sphere", params={"radius": 0.3}, position=(12.0, 0.0, 0.0))]
    if pane:
        size = {"width": 6.0, "height": 6.0}
        bodies.append(
            rc.Body(name="pane", shape="plate", params=size, material=pane, position=(5.0, 0, 0), yaw_deg=20.0)
        )
    radar = rc.Radar(wave, power=1e3, position=(0.0, 0.0, 0.0), antenna=rc.CosineAntenna(20.0, 20.0))
    model = {"max_bounces": 1, "tolerance_db": 0.5, "max_transmissions": 1}
    return rc.simulate(rc.Scene(bodies=bodies, radar=radar, model=model))


def _level(result: rc.Result) -> tuple[float, float]:
    """Return level and stated error [dB] of the ball."""
    i = max((i for i, why in enumerate(result.provenance) if "ball" in why.bodies), key=result.detections.power.item)
    return float(10.0 * np.log10(result.detections.power[i])), float(result.detections.error_db[i])


@pytest.mark.parametrize(
    ("carrier", "bandwidth", "eps_r", "sigma", "thickness"),
    [(10e9, 1e9, 5.0, 1.0, 8.9e-3), (24e9, 1e9, 2.52, 1.0, 6.7e-3), (77e9, 4e9, 2.6, 2.0, 10e-3)],
)
def test_a_conducting_pane_passes_what_a_slab_does(carrier, bandwidth, eps_r, sigma, thickness):
    wave = rc.Waveform(
        carrier, bandwidth, 40e-6, n_chirps=16, n_samples=int(2 ** np.ceil(np.log2(40.0 * bandwidth / C0)))
    )
    pane = rc.Material(eps_r=eps_r, sigma=sigma, thickness=thickness)
    alone, behind = _ball(wave, None), _ball(wave, pane)
    (free, free_error), (through, error) = _level(alone), _level(behind)
    truth = 40.0 * np.log10(_passed(pane, wave.middle, np.radians(20.0)))
    assert abs(through - free - truth) < free_error + error


def test_eps_falls_with_frequency_as_a_conductivity_does():
    assert rc.Material(eps_r=2.0, sigma=1.0).eps(1e9) == pytest.approx(2.0 - 1j / (2e9 * np.pi * EPS0))
