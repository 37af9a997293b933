"""Words in capitals or with a slip, and names that are none of raychan's, are refused with the right one."""

from importlib import import_module

import pytest

import raychan as rc

WAVE = rc.Waveform(77e9, 500e6, 20e-6)
LINE = rc.uniform_array(3, 2e-3)


@pytest.mark.parametrize(
    ("make", "meant"),
    [
        (lambda: rc.Processing(doa="MUSIC"), "music"),
        (lambda: rc.Processing(cfar="OS"), "os"),
        (lambda: rc.Processing(beams="coherrent"), "coherent"),
        (lambda: rc.Radar(WAVE, multiplexing="TDM"), "tdm"),
        (lambda: rc.doa([1.0, 2.0, 3.0], LINE, 4e-3, method="MUSIC"), "music"),
        (lambda: rc.IsotropicAntenna("v"), "V"),
        (lambda: rc.Atmosphere().specific(77e9, "h"), "H"),
        (lambda: rc.Diffuse("Lambert", -10.0), "lambert"),
        (lambda: rc.Scene(processing={"doa": "MUSIC"}), "music"),
        (lambda: rc.load_antenna("patch"), "antennas/patch"),
        (lambda: rc.load_antenna("antennas/pach"), "antennas/patch"),
    ],
)
def test_a_word_in_capitals_or_with_a_slip_is_refused_with_the_right_one(make, meant):
    with pytest.raises(ValueError, match=rf"did you mean '{meant}'\?"):
        make()


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("load_scene", "Scene.load"),
        ("music", "doa"),
        ("simulat", "simulate"),
        ("scene", "Scene"),
        ("FMCW", "Waveform"),
        ("fresnel", "Material"),
        ("micro_doppler", "spectrogram"),
        ("path_loss", "specular_paths"),
        ("link_budget", "Radar.link_budget"),
        ("kalman", "raychan.dynamics.kalman"),
        ("PDP", "Result.profile"),
    ],
)
def test_a_name_that_is_none_of_raychans_is_refused_with_the_nearest(name, meant):
    with pytest.raises(AttributeError, match=rf"has no attribute '{name}'; did you mean '{meant}'\?"):
        getattr(rc, name)


@pytest.mark.parametrize("meant", sorted(set(rc._TRIED.values())))
def test_what_is_proposed_for_a_name_exists(meant):
    if meant.startswith("raychan."):
        assert import_module(meant).__doc__
    else:
        name, _, member = meant.partition(".")
        home = getattr(rc, name)
        assert not member or member in dir(home) or member in home.__annotations__


def test_a_name_near_to_none_is_refused_alone():
    with pytest.raises(AttributeError, match=r"has no attribute 'zzz'$"):
        _ = rc.zzz
