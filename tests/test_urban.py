"""The study's validation scene: four targets where both columns of its Table 3 have them, whatever the noise."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from printed import table

from raychan.run.chain import background, received, simulate
from raychan.run.provenance import provenance
from raychan.signal.cube import synthesize
from raychan.world.scene import Scene

SCENE = Path(__file__).parents[1] / "scenes" / "urban.toml"
CELL = 0.264  # m, Table 2
SPEED = 0.12  # m/s

# Range [m] and range rate [m/s], receding positive, of the simulated and of the measured column.
TABLE_3 = {t: ((row["sim_range"], row["sim_rate"]), (row["range"], row["rate"])) for t, row in table(3).items()}


@pytest.fixture(scope="module")
def run():
    return simulate(Scene.load(SCENE), seed=0)


@pytest.fixture(scope="module", params=range(5))
def detected(run, request):
    """Detections with their explanations, for five seeds of the noise over the same paths."""
    if request.param == 0:
        return run.detections, run.provenance
    scene = run.scene
    rng = np.random.default_rng(np.random.SeedSequence(request.param).spawn(1)[0])
    rdmap, found = received(synthesize(run.paths, scene.sensor, rng), scene.sensor, scene.processing)
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


def test_own_car_and_ground_return_only_below_1_2_m(run, detected):
    found, why = detected
    own = background(run.scene.facets(0.0))
    alone = [i for i, w in enumerate(why) if all(link.split(".")[0] in own for link in w.contributions[0].chain)]
    assert alone
    assert (found.range[alone] < 1.2).all()


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
