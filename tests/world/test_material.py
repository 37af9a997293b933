"""Materials: the laws of the sources, kinds, sources told."""

from __future__ import annotations

import numpy as np
import pytest

from raychan.em.fresnel import coefficients
from raychan.records import HALF_SPACE, LAYER
from raychan.records import PEC as KIND_PEC
from raychan.units import C0, EPS0
from raychan.world.errors import SceneError
from raychan.world.material import PEC, Material, material, names, resolve, validity


def test_every_material_has_a_source_and_is_passive():
    for name in names():
        m = material(name, 77e9)
        assert m.source and m.name == name
        assert m.eps(77e9).imag <= 0.0


def test_concrete_at_77_ghz_as_printed_by_the_recommendation():
    m = material("concrete", 77e9)
    assert (m.eps_r, m.sigma) == (5.24, pytest.approx(0.0462 * 77**0.7822))


def test_conductivity_follows_frequency():
    ratio = material("glass", 60e9).sigma / material("glass", 30e9).sigma
    assert ratio == pytest.approx(2**1.3394)


def test_skin_follows_four_cole_cole_terms():
    w = 2.0 * np.pi * 77e9
    terms = ((32.0, 7.23e-12, 0.0), (1100.0, 32.48e-9, 0.2))
    eps = 4.0 + sum(d / (1 + (1j * w * t) ** (1 - a)) for d, t, a in terms) + 0.0002 / (1j * w * EPS0)
    np.testing.assert_allclose(material("skin", 77e9).eps(77e9), eps, rtol=3e-3)


def test_complex_permittivity_has_the_sign_of_the_time_factor():
    assert Material(4.0, 1.0).eps(77e9) == pytest.approx(4.0 - 1j / (2 * np.pi * 77e9 * EPS0))


def test_resolve_keeps_order_and_kinds():
    rows = resolve(["pec", "concrete", "car_glass", Material(2.0, thickness=1e-3, roughness=1e-4)], 77e9)
    assert rows.kind.tolist() == [KIND_PEC, HALF_SPACE, LAYER, LAYER]
    np.testing.assert_allclose(rows.thickness, [0.0, 0.0, 4e-3, 1e-3])
    assert rows.eps[0] == 1.0 and rows.roughness[3] == 1e-4 and PEC.kind == KIND_PEC


def test_unknown_material_suggests_the_nearest():
    with pytest.raises(SceneError, match="did you mean 'concrete'"):
        material("concret", 77e9)


@pytest.mark.parametrize("bad", [{"eps_r": 0.5}, {"sigma": -1.0}, {"thickness": 0.0}, {"eps_r": float("nan")}])
def test_impossible_materials_are_errors(bad):
    with pytest.raises(SceneError) as caught:
        Material(**bad)
    assert caught.value.key in bad


@pytest.mark.parametrize("cosine", [1.0, 0.3])
@pytest.mark.parametrize("frequency", [0.3e9, 77e9])
@pytest.mark.parametrize("thickness", [1e-10, 1e-9, 1e-8, 1e-7])
def test_a_metal_film_reflects_as_a_sheet_of_its_resistance(thickness, frequency, cosine):
    # A shunt sheet of Rs = 1 / (sigma t) ohm: r = -1 / (1 + 2 Rs cos / eta0) for s, and what it leaves, 1 + r, passes,
    # as long as the film is thin beside its skin (0.24 um at 77 GHz). The slab is of (t / skin)^2 off.
    copper = 5.8e7
    film = resolve([Material(sigma=copper, thickness=thickness)], frequency)
    c = coefficients(LAYER, film.eps[0], thickness, 0.0, cosine, 2.0 * np.pi * frequency / C0)
    sheet = -1.0 / (1.0 + 2.0 * cosine * EPS0 * C0 / (copper * thickness))
    skins = thickness * np.sqrt(np.pi * frequency * copper / (EPS0 * C0**2))
    assert abs(c[0] - sheet) < 1e-6 + 0.01 * skins**2
    assert abs(c[2] - (1.0 + sheet)) < 1e-6 + skins**2 * (1.0 + sheet)


def test_a_layer_thinner_than_an_atom_is_none():
    with pytest.raises(SceneError, match="no atom is thinner"):
        Material(sigma=5.8e7, thickness=9e-11)


def test_extrapolation_is_told():
    assert "extrapolated" in validity("brick", 77e9) and not validity("concrete", 77e9) and not validity("skin", 77e9)
