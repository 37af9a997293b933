"""The study's validation scene: four targets where both columns of its Table 3 have them, whatever the noise."""

from __future__ import annotations

import json
import math
import tomllib

import numpy as np
import pytest
from support.places import SCENES
from support.study_tables import table

from raychan.run.explanation.labels import provenance
from raychan.run.receiver import detections_in, map_of
from raychan.run.simulate import background, simulate
from raychan.signal.baseband import synthesize
from raychan.units import C0, EPS0
from raychan.world.scene import Scene

SCENE = SCENES / "urban.toml"
CELL = 0.264  # m, Table 2
SPEED = 0.12  # m/s

# Range [m] and range rate [m/s], receding positive, of the simulated and of the measured column.
TABLE_3 = {t: ((row["sim_range"], row["sim_rate"]), (row["range"], row["rate"])) for t, row in table(3).items()}


@pytest.fixture(scope="module")
def run():
    return simulate(Scene.load(SCENE), seed=0)


@pytest.fixture(scope="module", params=range(5))
def detected(run, request):
    """Return detections with their explanations for five seeds of the noise over the same paths."""
    if request.param == 0:
        return run.detections, run.provenance
    scene = run.scene
    rng = np.random.default_rng(np.random.SeedSequence(request.param).spawn(1)[0])
    rdmap = map_of(synthesize(run.paths, scene.radar, rng), scene.radar, scene.processing)
    found = detections_in(rdmap, scene.radar, scene.processing)
    return found, provenance(run.paths, rdmap, found, run.receiver, run.error.power)


@pytest.mark.parametrize("target", TABLE_3)
def test_target_is_detected_within_a_cell_of_both_columns(detected, target):
    found, why = detected
    rows = [i for i, w in enumerate(why) if w.bodies.startswith(target)]
    assert rows
    best = rows[int(np.argmax(found.power[rows]))]
    for at, rate in TABLE_3[target]:
        assert found.range[best] == pytest.approx(at, abs=CELL)
        assert found.rate[best] == pytest.approx(rate, abs=SPEED)


def test_every_detection_names_the_bodies_of_its_paths(detected):
    assert all(w.contributions for w in detected[1])


def test_own_car_and_ground_do_not_show_from_1_2_m_on(run, detected):
    """The study's claim; below 1.2 m patches show nothing of them either (see the next test)."""
    found, why = detected
    own = background(run.scene.facets(0.0))
    alone = [i for i, w in enumerate(why) if all(link.split(".")[0] in own for link in w.contributions[0].chain)]
    assert (found.range[alone] < 1.2).all()


@pytest.mark.parametrize("element", ["cosine", "isotropic"])
@pytest.mark.parametrize("pitch", [-40.0, 0.0, 25.0, 40.0])
def test_ground_below_returns_what_its_image_sends_times_the_arrays_gain_down_squared(tmp_path, pitch, element):
    """P_r/P_t = (G lambda / (4 pi 2 h))^2 |R|^2: a patch sends nothing 90 deg off boresight, an isotropic one does."""
    height = 0.5
    table = tomllib.loads((SCENE.parent / "antennas" / "array_2x2.toml").read_text("utf-8"))
    inner = table["element"] if element == "cosine" else {"kind": "isotropic"}
    keys = ", ".join(f"{k} = {json.dumps(v)}" for k, v in inner.items())
    array = ", ".join(f"{k} = {json.dumps(table[k])}" for k in ("kind", "ny", "nz", "spacing_y", "spacing_z"))
    file = tmp_path / "down.toml"
    file.write_text(
        f"[radar]\nposition = [0.0, 0.0, {height}]\npitch_deg = {pitch}\npolarization = 'V'\nnoise = false\n"
        f"antenna = {{ {array}, loss_db = 2.0, element = {{ {keys} }} }}\n"
        "[radar.waveform]\ncarrier_ghz = 77.0\nbandwidth_mhz = 500.0\nchirp_us = 60.0\nchirps = 16\nsamples = 64\n"
        "[[bodies]]\nname = 'ground'\nshape = 'ground'\nmaterial = 'wet'\n"
        "[materials.wet]\neps_r = 5.0\nsigma = 2.0\n"
    )
    scene = Scene.load(file)
    radar = scene.radar
    # A positive pitch looks down.
    off = math.radians(90.0 - pitch)
    gain = float((np.abs(radar.tx.field(np.array([[math.cos(off), 0.0, -math.sin(off)]]))) ** 2).sum())
    root = np.sqrt(5.0 - 2.0j / (2.0 * math.pi * radar.waveform.middle * EPS0))
    reflected = abs((1.0 - root) / (1.0 + root))
    wanted = (gain * C0 / radar.waveform.middle / (4.0 * math.pi * 2.0 * height) * reflected) ** 2
    got = float((np.abs(simulate(scene, seed=0).paths.amplitude) ** 2).sum())
    assert got == pytest.approx(wanted, rel=1e-6, abs=1e-30)
    if element == "cosine" and pitch <= 0.0:
        assert got < 1e-30


def test_profile_peaks_stand_within_a_cell_of_the_targets(run):
    peaks = run.profile.range[run.profile.peaks]
    for columns in TABLE_3.values():
        for at, _ in columns:
            assert np.abs(peaks - at).min() < CELL


def test_targets_are_stated_within_3_db(run):
    by_body = {}
    for d, w in zip(run.detections.power, run.provenance, strict=True):
        by_body.setdefault(w.bodies.split(".")[0], (d, w.error_db))
    assert all(by_body[t][1] < 3.0 for t in TABLE_3)


def test_the_ledger_speaks_of_every_mechanism(run):
    names = {"further bounces", "transmission", "diffraction", "diffuse scattering", "range migration"}
    assert names <= set(run.ledger)
    assert all(isinstance(e.level_db, float) or e.level_db in ("unknown", "none") for e in run.ledger.values())
