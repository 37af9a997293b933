"""Laws of sigma-nought: energy, reciprocity, normalisation of the lobe, and the statistics of textures."""

import numpy as np
import pytest

from raychan.em.diffuse import Diffuse, lobe_power, texture

LAMBERT, LOBE = Diffuse("lambert", -6.0), Diffuse("lobe", -6.0, exponent=5)


def half_sphere(n=400):
    """Directions (k, 3) of the upper half sphere and the solid angle of each."""
    z = (np.arange(n) + 0.5) / n
    around = 2.0 * np.pi * (np.arange(2 * n) + 0.5) / (2 * n)
    z, around = (x.ravel() for x in np.meshgrid(z, around))
    r = np.sqrt(1.0 - z**2)
    return np.stack([r * np.cos(around), r * np.sin(around), z], axis=1), np.pi / n**2


@pytest.mark.parametrize("off_deg", [0.0, 30.0, 70.0])
def test_lambert_scatters_its_share_of_the_incident_power(off_deg):
    out, solid = half_sphere()
    cos_in = np.full(len(out), np.cos(np.radians(off_deg)))
    scattered = LAMBERT.sigma0(cos_in, out[:, 2], out[:, 2]).sum() * solid / (4.0 * np.pi)
    assert scattered == pytest.approx(10.0**-0.6 * cos_in[0], rel=1e-5)


@pytest.mark.parametrize("exponent", [1, 4, 7])
@pytest.mark.parametrize("off_deg", [0.0, 45.0, 85.0])
def test_the_lobe_integral_is_its_closed_form(exponent, off_deg):
    out, solid = half_sphere()
    off = np.radians(off_deg)
    lobe = (0.5 * (1.0 + out @ [np.sin(off), 0.0, np.cos(off)])) ** exponent
    assert lobe_power(exponent, np.array([np.cos(off)]))[0] == pytest.approx(lobe.sum() * solid, rel=1e-4)


def test_laws_are_reciprocal():
    rng = np.random.default_rng(1)
    one, other, lobe = rng.uniform(0.05, 1.0, (3, 50))
    for law in (LAMBERT, LOBE, Diffuse("gamma", -15.0), Diffuse("constant", -20.0)):
        np.testing.assert_allclose(law.sigma0(one, other, lobe), law.sigma0(other, one, lobe), rtol=1e-14)


def test_gamma_falls_with_the_sine_of_the_grazing_angle():
    grazing = np.radians([2.0, 10.0, 90.0])
    found = Diffuse("gamma", -15.0).sigma0(np.sin(grazing), np.sin(grazing), np.zeros(3))
    np.testing.assert_allclose(10.0 * np.log10(found), -15.0 + 10.0 * np.log10(np.sin(grazing)), atol=1e-12)


def test_textures_are_one_a_square_and_of_mean_one():
    rng = np.random.default_rng(3)
    square = np.repeat(np.arange(40_000)[:, None], 2, axis=0)
    drawn = texture(0.7, square, rng)
    assert np.array_equal(drawn[::2], drawn[1::2])
    assert drawn.mean() == pytest.approx(1.0, abs=0.03)
    assert drawn[::2].var() == pytest.approx(1.0 / 0.7, rel=0.06)


@pytest.mark.parametrize(
    "wrong",
    [
        {"law": "snow", "level_db": 0.0},
        {"law": "lambert", "level_db": 1.0},
        {"law": "gamma", "level_db": np.nan},
        {"law": "lobe", "level_db": -3.0, "exponent": 0},
        {"law": "constant", "level_db": -3.0, "k_shape": 0.0},
        {"law": "gamma", "level_db": 1e300},
        {"law": "gamma", "level_db": -3.0, "cross_db": -1e9},
        {"law": "gamma", "level_db": -3.0, "texture_m": 1e-300},
        {"law": "lobe", "level_db": -3.0, "exponent": 4.5},
    ],
)
def test_what_cannot_be_is_refused(wrong):
    with pytest.raises(ValueError):
        Diffuse(**wrong)
