"""Layers against Fresnel, Brewster and energy balance."""

from __future__ import annotations

import numpy as np

from truth import slab

C0 = 299_792_458.0
K = 2 * np.pi * 77e9 / C0
LAM = C0 / 77e9


def test_half_space_is_fresnel_and_brewster():
    c = np.linspace(0.01, 1, 50)
    eps = 5.24 - 0.4j
    root = np.sqrt(eps - 1 + c**2)
    r_s, r_p = slab.half_space(c, eps)
    assert np.allclose(r_s, (c - root) / (c + root)) and np.allclose(r_p, (eps * c - root) / (eps * c + root))
    assert abs(slab.half_space(1 / np.sqrt(1 + 4.0), 4.0)[1]) < 1e-15


def test_layers_conserve_energy_and_half_wave_windows_vanish():
    c = np.linspace(0.05, 1, 50)
    r_s, r_p, t_s, t_p = slab.layer(c, 6.3, 0.004, K)
    for r, t in ((r_s, t_s), (r_p, t_p)):
        assert np.allclose(np.abs(r) ** 2 + np.abs(t) ** 2, 1)
    assert abs(slab.layer(1.0, 4.0, LAM / 4, K)[0]) < 1e-12


def test_split_layer_and_thick_lossy_layer():
    c = 0.6
    whole = slab.stack(c, [(3 - 0.1j, 0.005)], K)
    assert np.allclose(whole, slab.stack(c, [(3 - 0.1j, 0.002), (3 - 0.1j, 0.003)], K))
    assert np.allclose(slab.stack(c, [(3 - 0.5j, 0.1)], K)[:2], slab.half_space(c, 3 - 0.5j))
    assert np.allclose(slab.stack(c, [(1.0, 0.01)], K)[:2], 0)
