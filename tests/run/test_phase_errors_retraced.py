"""Phase noise and chirp error of frames that are traced several times: those of bodies that move or turn, too."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc

NOISE = rc.Impairments(phase_noise=rc.PhaseNoise([[1e4, -60.0], [1e5, -70.0], [1e6, -85.0], [1e7, -110.0]]))
BENT = rc.Impairments(chirp_error=rc.ChirpError([[0.0, -1e5], [8e-6, 2e5], [2e-5, -1e5]]))
OFF = rc.Impairments(chirp_error=rc.ChirpError([[0.0, 4e5], [2e-5, -6e5]]))
"""A straight chirp error: a ramp of another carrier and slope."""
POINT = {"shape": "plate", "params": {"width": 0.002, "height": 0.002}, "rcs_dbsm": 15.0, "yaw_deg": 180.0}


def samples(bodies, faults, retrace, *, iq=True, elements=None):
    """Return the samples of a frame, and what its run says."""
    wave = rc.Waveform(77e9, 300e6, 20e-6, 25e-6, n_chirps=128, n_samples=128, complex_sampling=iq)
    more = {} if elements is None else {"elements": elements}
    radar = rc.Radar(wave, noise=False, impairments=faults, **more)
    result = rc.simulate(rc.Scene(bodies, radar=radar, model={"max_bounces": 1, "retrace": retrace}), seed=3)
    return result.cube.samples.astype(complex), result.warnings


def turns(bodies, faults, retrace, **given):
    """Return by how much [rad] the faults turn each sample."""
    plain, wrong = (samples(bodies, x, retrace, **given)[0] for x in (rc.Impairments(), faults))
    return np.angle(wrong * plain.conj())


def mover(**given):
    return rc.Body("mover", **POINT | {"position": (15.0, 0.0, 0.5), "velocity": (5.0, 8.0, 0.0)} | given)


@pytest.mark.parametrize("faults", [BENT, OFF])
@pytest.mark.parametrize("retrace", [3, 9])
def test_a_chirp_error_turns_what_moves_as_much_in_frames_traced_several_times(faults, retrace):
    """They had none: no sample was turned."""
    elements = rc.uniform_array(2, 0.3)
    once, often = (turns([mover()], faults, n, elements=elements) for n in (1, retrace))
    assert np.std(once) > 0.05
    # Groups of delays blur what bends where the ramp begins.
    assert np.abs(often - once).max() < 0.003


@pytest.mark.parametrize("retrace", [3, 9])
def test_phase_noise_of_what_moves_is_that_of_what_stands_at_its_range(retrace):
    """One oscillator feeds both: the sum of both echoes is turned as a whole, not one of them alone."""
    bodies = [rc.Body("post", **POINT, position=(14.9, 1.0, 0.5)), mover()]
    plain, wrong = (samples(bodies, x, retrace)[0] for x in (rc.Impairments(), NOISE))
    ratio = (wrong / plain)[np.abs(plain) > 0.3 * np.abs(plain).max()]
    assert np.std(np.angle(ratio)) == pytest.approx(0.07, rel=0.1)
    assert np.std(np.abs(ratio)) < 0.1 * np.std(np.angle(ratio))


@pytest.mark.parametrize("iq", [True, False])
def test_what_turns_has_both_and_no_line_says_it_has_not(iq):
    blade = {"shape": "plate", "params": {"width": 0.3, "height": 0.1}, "turn_rate_dps": 3000.0, "yaw_deg": 175.0}
    plate = rc.Body("blade", **blade, position=(12.0, 0.0, 0.5))
    plain, _ = samples([plate], rc.Impairments(), "auto", iq=iq)
    wrong, said = samples([plate], NOISE, "auto", iq=iq)
    share = np.mean(np.abs(wrong - plain) ** 2) / np.mean(np.abs(plain) ** 2)
    # The turn in the square at 12 m; of real samples as much of what is left of them.
    assert np.sqrt(share) == pytest.approx(0.057, rel=0.2)
    assert not any("chirp error" in line for line in said)
    if not iq:
        assert not wrong.imag.any()
