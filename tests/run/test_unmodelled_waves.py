"""Ledger entries on small curved bodies and on wide bands, against Mie's series and a layer's formula."""

import dataclasses

import numpy as np
import pytest
import trimesh
from truth import mie
from truth.slab import layer as slab

import raychan as rc

C0 = 299_792_458.0
WAVE = rc.Waveform(carrier=77e9, bandwidth=1e9, chirp_duration=40e-6, n_chirps=16, n_samples=256)


def run(body, wave=WAVE):
    """Return the run of one body."""
    return rc.simulate(rc.Scene(radar=rc.Radar(position=(0, 0, 0.5), waveform=wave, power=1e3), bodies=[body]))


@pytest.mark.parametrize("ka", [0.6, 1.0, 3.0, 8.0])
def test_what_creeps_around_a_small_ball_is_told_and_covers_what_physical_optics_lacks_of_mie(ka):
    wave = dataclasses.replace(WAVE, carrier=1e9, bandwidth=5e7)
    k = 2.0 * np.pi * wave.middle / C0
    found = run(rc.Body(name="ball", shape="sphere", params={"radius": ka / k}, position=(20, 0, 0.5)), wave)
    entry = found.ledger["creeping waves"]
    lacks = abs(np.sqrt(mie.rcs(ka / k, k) / (np.pi * (ka / k) ** 2)) - 1.0)
    assert entry.kind == "bound" and "ball" in entry.how
    assert 20.0 * np.log10(lacks) <= entry.level_db <= 10.0


@pytest.mark.parametrize("ka", [27.0, 32.0, 56.0, 90.0, 119.0])
def test_what_scenes_state_and_what_creeps_cover_mies_series_at_a_twentieth_of_a_decibel(ka):
    """Currents of physical optics end abruptly where the light does: 0.07 dB at ka = 56, of 0.004 stated."""
    wave = dataclasses.replace(WAVE, carrier=10e9, bandwidth=1e8)
    k, distance, lit = 2.0 * np.pi * wave.middle / C0, 15.0, {"power": 1e3, "noise": False}
    size = {"radius": ka / k, "max_sag": 1e-4}
    ball = rc.Body(name="ball", shape="sphere", params=size, position=(distance, 0, 0.5))
    mount = rc.Radar(position=(0, 0, 0.5), waveform=wave, antenna=rc.IsotropicAntenna(), **lit)
    model = {"max_bounces": 1, "tolerance_db": 0.05}
    found = rc.simulate(rc.Scene(radar=mount, bodies=[ball], model=model))
    # Nearer than the far field it spreads as geometrical optics says.
    true = 1e3 * (C0 / wave.middle) ** 2 * mie.rcs(ka / k, k) / (4.0 * np.pi) ** 3 / distance**4
    true *= (distance / (distance - ka / k)) ** 2
    off = abs(10.0 * np.log10(found.detections.power[0] / true))
    creeps = 20.0 * np.log10(1.0 + 10.0 ** (found.ledger["creeping waves"].level_db / 20.0))
    assert off < found.detections.error_db[0] + creeps < 0.35
    assert creeps < 0.05 or any("creeping waves" in line for line in found.warnings)


def test_a_large_ball_and_a_box_have_none_that_matters():
    ball = run(rc.Body(name="ball", shape="sphere", params={"radius": 0.5}, position=(20, 0, 0.5)))
    assert ball.ledger["creeping waves"].level_db < -40.0
    assert run(rc.Body(name="box", shape="box", position=(20, 0, 0.5))).ledger["creeping waves"].level_db == "none"


@pytest.mark.parametrize("yaw_deg", [0.0, 3.0])
def test_a_layer_whose_coefficients_change_over_the_band_is_told_with_the_change(yaw_deg):
    """A pane of nine half waves near the middle of the band returns next to nothing there, and more beside it."""
    wave = dataclasses.replace(WAVE, carrier=57e9, bandwidth=2e9)
    thickness = 9.0 * C0 / (wave.middle + 0.2e9) / 2.0 / np.sqrt(6.0)
    size = {"width": 0.1, "height": 0.1}
    glass = rc.Material(eps_r=6.0, thickness=thickness)
    entry = run(
        rc.Body(name="pane", shape="plate", params=size, position=(8, 0, 0.5), material=glass, yaw_deg=yaw_deg), wave
    ).ledger["change over the band"]
    bands = np.linspace(wave.carrier, wave.carrier + wave.bandwidth, 401)
    size_at = [abs(slab(1.0, 6.0, thickness, 2.0 * np.pi * f / C0)[0]) for f in (*bands, wave.middle)]
    change = 20.0 * np.log10(np.mean(size_at[:-1]) / size_at[-1] - 1.0)
    assert entry.level_db == pytest.approx(change, abs=2.0) and entry.kind == "estimate"


def test_a_conductor_changes_nothing_over_the_band():
    assert (
        run(rc.Body(name="box", shape="box", position=(20, 0, 0.5))).ledger["change over the band"].level_db == "none"
    )


def test_a_layer_met_aslant_is_told_by_its_own_incidence():
    """A pane at 75 degrees before a target, passed there and back: the field runs along the pane's upright."""
    wave = dataclasses.replace(WAVE, carrier=76.5e9, bandwidth=2e9, n_samples=1024)
    pane = rc.Body(
        name="pane", shape="plate", params={"width": 3.0, "height": 1.0}, position=(4, 0, 0.5), yaw_deg=75.0,
        material=rc.Material(eps_r=6.0, thickness=0.05),
    )  # fmt: skip
    target = rc.Body(name="target", shape="sphere", params={"radius": 0.05}, position=(8, 0, 0.5), rcs_dbsm=20.0)
    mount = rc.Radar(position=(0, 0, 0.5), waveform=wave, power=1e3)
    found = rc.simulate(rc.Scene(radar=mount, bodies=[pane, target]))
    cosine = np.cos(np.radians(75.0))
    bands = np.linspace(wave.carrier, wave.carrier + wave.bandwidth, 401)
    both = [abs(slab(cosine, 6.0, 0.05, 2.0 * np.pi * f / C0)[2]) ** 2 for f in (*bands, wave.middle)]
    change = abs(np.mean(both[:-1]) / both[-1] - 1.0)
    beside = 10.0 * np.log10(found.detections.power.max() / found.detections.power.min())
    assert found.ledger["change over the band"].level_db - beside == pytest.approx(20.0 * np.log10(change), abs=3.0)


def test_targets_of_given_rcs_have_none_and_open_bodies_are_not_known():
    given = rc.Body(name="t", shape="sphere", params={"radius": 0.002}, position=(8, 0, 0.5), rcs_dbsm=0.0)
    assert run(given).ledger["creeping waves"].level_db == "none"
    rod = trimesh.creation.cylinder(0.003, 0.5, sections=64)
    rod.update_faces(abs(rod.face_normals[:, 2]) < 0.9)
    open_rod = rc.Body(name="rod", mesh=rod, position=(8, 0, 0.5), material="pec")
    assert run(open_rod).ledger["creeping waves"].level_db == "unknown"
