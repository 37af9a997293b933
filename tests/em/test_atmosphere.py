"""Air, rain and fog against the figures that the ITU prints, and against their formulas written another way."""

import cmath
import math

import numpy as np
import pytest

from raychan.em.atmosphere import Atmosphere, fog, gas, oxygen, rain, rain_coefficients, vapour
from raychan.units import C0

# ITU-R validation examples for P.676 (CG-3M3J-13): 1013.25 hPa of dry air, 288.15 K, 7.5 g/m3; oxygen, water [dB/km].
GASES = {
    12.0: (0.00869826406877357, 0.00953538822024593),
    20.0: (0.0118835504778076, 0.0970473048151117),
    60.0: (14.6234747964861, 0.154841841),
    77.0: (0.097525836, 0.250517679),
    90.0: (0.0388697110724235, 0.341973394),
    118.0: (1.134866202, 0.605921953),
    130.0: (0.0415090835995228, 0.751844704),
    183.0: (0.012733909, 27.66500831),
}


@pytest.mark.parametrize("ghz", GASES)
def test_gases_absorb_as_in_the_validation_examples_of_p676(ghz):
    wet, dry = vapour(ghz, 288.15, 1013.25, 7.5), oxygen(ghz, 288.15, 1013.25, 7.5)
    assert (dry, wet) == pytest.approx(GASES[ghz], rel=2e-7)
    assert gas(ghz, 288.15, 1013.25, 7.5) == dry + wet


# P.838-3, Table 5: k_H, alpha_H, k_V, alpha_V.
RAIN = {
    10.0: (0.01217, 1.2571, 0.01129, 1.2156),
    35.0: (0.3374, 0.9047, 0.3224, 0.8761),
    80.0: (1.1704, 0.7115, 1.1668, 0.7021),
    100.0: (1.3671, 0.6815, 1.3680, 0.6765),
}


@pytest.mark.parametrize("ghz", RAIN)
def test_rain_coefficients_are_those_printed_in_table_5_of_p838(ghz):
    found = (*rain_coefficients(ghz, "H"), *rain_coefficients(ghz, "V"))
    assert found == pytest.approx(RAIN[ghz], rel=5e-4)


@pytest.mark.parametrize(
    ("ghz", "elevation", "tilt", "k", "alpha"),
    [(14.25, 31.07699124, 0.0, 0.03975488, 1.12418043), (29.0, 20.14335809, 90.0, 0.21298877, 0.92265917)],
)
def test_both_polarisations_combine_to_the_validation_examples_of_p838(ghz, elevation, tilt, k, alpha):
    (kh, ah), (kv, av) = (rain_coefficients(ghz, wave) for wave in "HV")
    share = math.cos(math.radians(elevation)) ** 2 * math.cos(math.radians(2.0 * tilt))
    both = 0.5 * (kh + kv + (kh - kv) * share)
    assert both == pytest.approx(k, rel=1e-6)
    assert 0.5 * (kh * ah + kv * av + (kh * ah - kv * av) * share) / both == pytest.approx(alpha, rel=1e-6)


def test_rain_of_10_mm_an_hour_costs_5_7_db_per_km_at_77_ghz():
    k, alpha = rain_coefficients(77.0, "V")
    assert rain(77.0, 10.0) == pytest.approx(k * 10.0**alpha) == pytest.approx(5.75, abs=0.01)
    assert rain(77.0, 0.0) == 0.0


@pytest.mark.parametrize("ghz", [10.0, 35.0, 77.0, 140.0])
@pytest.mark.parametrize("kelvin", [273.15, 288.15])
def test_fog_absorbs_as_rayleigh_droplets_of_the_same_permittivity(ghz, kelvin):
    theta = 300.0 / kelvin - 1.0
    e0 = 77.66 + 103.3 * theta
    e1, e2, fp = 0.0671 * e0, 3.52, 20.20 - 146.0 * theta + 316.0 * theta**2
    eps = e2 + (e0 - e1) / (1.0 + 1j * ghz / fp) + (e1 - e2) / (1.0 + 1j * ghz / (39.8 * fp))
    # Absorption cross section k 4 pi r^3 Im[-(eps - 1)/(eps + 2)] of droplets that fill 1e-6 of the volume.
    absorbed = -3.0 * 2.0 * math.pi * ghz * 1e9 / C0 * 1e-6 * ((eps - 1.0) / (eps + 2.0)).imag
    assert fog(ghz, 1.0, kelvin) == pytest.approx(absorbed * 1e4 * math.log10(math.e), rel=1e-3)
    assert cmath.isfinite(eps)


def test_fog_at_two_frequencies_is_in_the_ratio_of_the_validation_examples_of_p840():
    # Cloud attenuation on one slant path at 29 and 14.25 GHz: the liquid water cancels.
    assert fog(29.0, 1.0, 273.15) / fog(14.25, 1.0, 273.15) == pytest.approx(1.77246907 / 0.45516982, rel=1e-7)


def test_causes_add_and_a_field_falls_by_half_the_decibels_of_its_power():
    air = Atmosphere(rain_mmh=25.0, fog_gm3=0.1)
    causes = air.specific(77e9, "H")
    alpha = air.attenuation(77e9, "H")
    assert set(causes) == {"gas", "rain", "fog"}
    assert 20.0 * np.log10(np.exp(-alpha * 1000.0)) == pytest.approx(-sum(causes.values()))


def test_the_ends_of_what_is_known_are_known():
    for frequency in (1e9, 1e12):
        assert Atmosphere().attenuation(frequency) > 0.0
    assert Atmosphere(fog_gm3=0.1).attenuation(200e9) > Atmosphere().attenuation(200e9)


@pytest.mark.parametrize(
    ("call", "said"),
    [(lambda: gas(0.5, 288.0, 1013.0, 7.5), "1 to 1000 GHz"), (lambda: fog(300.0, 1.0, 288.0), "1 to 200 GHz")],
)
def test_frequencies_beyond_the_recommendations_are_refused(call, said):
    with pytest.raises(ValueError, match=said):
        call()
