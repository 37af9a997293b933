"""Scenes with a receiver elsewhere: bistatic RCS, exact specular paths, rates, and the exchange of both ends."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest

import raychan as rc
from raychan.cli import invoke
from raychan.units import C0, db

F = 77e9
WAVE = rc.Waveform(F, 500e6, 15e-6, n_chirps=32, n_samples=256)
TX, RX = np.array([0.0, 0.0, 0.5]), np.array([3.0, 8.0, 1.0])
ISO = rc.IsotropicAntenna()


def bodies(*which):
    known = {
        "ball": rc.Body(name="ball", shape="sphere", params={"radius": 0.25}, position=(9.0, 0.0, 0.5)),
        "ground": rc.Body(name="ground", shape="ground", material="asphalt"),
        "wall": rc.Body(name="wall", shape="plate", params={"width": 8.0, "height": 3.0}, position=(14.0, 3.0, 1.6)),
        "person": rc.Body(name="person", shape="pedestrian", position=(10.0, -2.0, 0.0), rcs_dbsm=-5.0),
    }
    return [known[name] for name in which]


def scene(which, tx=TX, rx=RX, **radar):
    given = {"waveform": WAVE, "position": tx, "rx_position": rx, "antenna": ISO, "noise": False, "power": 1.0} | radar
    return rc.Scene(bodies=bodies(*which), radar=rc.Radar(**given), model={"tolerance_db": 0.25, "max_bounces": 2})


def paths(made):
    return rc.transfer(rc.trace(made), made.radar)


def met(found, *names):
    """Rows of paths that meet these bodies, in order."""
    wanted = [found.body_names.index(name) for name in names]
    rows = zip(found.body.tolist(), (found.kind > 0).tolist(), strict=True)
    return np.array([[b for b, used in zip(*row, strict=True) if used] == wanted for row in rows], bool)


def test_line_of_sight_is_the_exact_one():
    found = paths(scene(["ball"]))
    row = np.flatnonzero((found.kind == 0).all(axis=1))
    assert len(row) == 1
    far = np.linalg.norm(RX - TX)
    assert found.length[row[0]] == pytest.approx(far, abs=1e-9)
    assert found.range[row[0]] == pytest.approx(0.5 * far, abs=1e-9)
    true = C0 / F / (4.0 * np.pi * far) * np.exp(-2j * np.pi * F * far / C0)
    # V and V of a line of sight that rises a little.
    assert abs(found.amplitude[row[0]]) == pytest.approx(abs(true), rel=2e-2)


def test_a_detection_of_the_line_of_sight_says_so_wherever_bodies_are_named(tmp_path, capsys):
    file, out = tmp_path / "scene.toml", tmp_path / "out"
    file.write_text(scene(["ground"], noise=True).to_toml())
    assert invoke(["run", str(file), "--out", str(out), "--no-pictures"]) == 0
    assert re.search("clutter +line of sight", capsys.readouterr().out)
    result = rc.load_result(out)
    straight = [why for why in result.provenance if why.bodies == "line of sight"]
    assert [why.label for why in straight] == ["clutter"] and straight[0].contributions[0].chain == ()
    assert straight[0].range == pytest.approx(0.5 * np.linalg.norm(RX - TX), abs=0.3)
    assert ",clutter,line of sight\n" in (out / "detections.csv").read_text()
    number = result.provenance.index(straight[0]) + 1
    assert invoke(["explain", str(out), "--detection", str(number)]) == 0
    assert "  line of sight, 0 interactions, " in capsys.readouterr().out


def test_ground_reflection_is_that_of_the_exact_specular_path():
    # Of one frequency, as exact ones are: a radar's gains are those of the middle of its ramp.
    made = scene(["ground"], waveform=dataclasses.replace(WAVE, bandwidth=1e4))
    found, exact = paths(made), rc.specular_paths(made, TX, RX, max_bounces=1)
    order = np.argsort(found.length)
    np.testing.assert_allclose(found.length[order], exact.length, atol=1e-9)
    np.testing.assert_allclose(np.abs(found.amplitude[order]), np.abs(exact.gain[:, 0, 0]), rtol=1e-6)


@pytest.mark.parametrize("rx", [(3.0, 8.0, 0.5), (9.0, 9.0, 0.5), (1.0, -4.0, 0.5)])
def test_a_sphere_returns_its_bistatic_rcs(rx):
    """Physical optics without the shadow's wave: the mirror ball pi r^2, within 0.5 dB off the forward direction."""
    made = scene(["ball"], rx=np.array(rx))
    found = paths(made)
    total = found.amplitude[met(found, "ball")].sum()
    legs = [float(np.linalg.norm(np.array([9.0, 0.0, 0.5]) - end)) for end in (TX, rx)]
    sigma = np.abs(total) ** 2 * (4 * np.pi) ** 3 * np.prod(legs) ** 2 / (C0 / F) ** 2
    assert db(sigma / (np.pi * 0.25**2)) == pytest.approx(0.0, abs=0.5)


def test_a_wall_returns_its_specular_point():
    """The sum over the wall's tubes is the exact specular path, but for what its edges diffract."""
    made = scene(["wall"])
    found, exact = paths(made), rc.specular_paths(made, TX, RX, max_bounces=1)
    total = np.abs(found.amplitude[met(found, "wall")].sum())
    true = np.abs(exact.gain[1, 0, 0])
    assert exact.kind.shape[1] == 1 and db((total / true) ** 2) == pytest.approx(0.0, abs=0.5)
    strong = np.argsort(-np.abs(found.amplitude * met(found, "wall")))[:200]
    assert found.length[strong].min() == pytest.approx(exact.length[1], abs=0.05)


@pytest.mark.parametrize("which", [["ball", "ground"], ["person", "ground"], ["wall", "ground", "person"]])
def test_exchange_of_both_ends_changes_nothing(which):
    one, two = (paths(scene(which, tx=a, rx=b)) for a, b in ((TX, RX), (RX, TX)))
    cell = rc.synthesize(one, scene(which).radar).samples, rc.synthesize(two, scene(which).radar).samples
    power = np.abs(cell[0]).max() ** 2
    assert db(np.abs(cell[0] - cell[1]).max() ** 2 / power) < -25.0
    for name in which[:1]:
        a, b = (np.abs(p.amplitude[met(p, name)].sum()) for p in (one, two))
        assert db((a / b) ** 2) == pytest.approx(0.0, abs=0.02)


def test_rates_are_those_of_the_moved_ends_and_bodies():
    still = scene(["person"], velocity=(5.0, 0.0, 0.0), rx_velocity=(0.0, -2.0, 0.0))
    found = paths(still)
    row = np.flatnonzero(met(found, "person"))[0]
    later = paths(rc.Scene(bodies=bodies("person"), radar=still.radar.at(1e-3), model=still.model))
    moved = (later.length[met(later, "person")][0] - found.length[row]) / 1e-3
    assert found.length_rate[row] == pytest.approx(moved, abs=5e-3)


def test_a_run_is_whole_and_says_what_it_does_not_estimate(tmp_path):
    made = scene(["ball", "ground"], noise=True, power=1.0)
    result = rc.simulate(made, seed=1)
    assert len(result.detections.range) >= 2
    # The direct signal stands at half the distance of the ends.
    assert np.abs(result.detections.range - 0.5 * np.linalg.norm(RX - TX)).min() < 0.1
    assert result.ledger["diffraction"].level_db == "unknown"
    again = rc.Scene.from_text(made.to_toml())
    np.testing.assert_allclose(again.radar.rx_place, RX)


@pytest.mark.parametrize(
    ("changes", "said"),
    [({"rx_position": (9.0, 0.0, 0.5)}, "receiver is inside 'ball'"), ({"rx_position": tuple(TX)}, "stands where")],
)
def test_receivers_that_cannot_be_are_refused(changes, said):
    with pytest.raises((rc.SceneError, ValueError), match=said):
        rc.simulate(scene(["ball"], **changes))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"rx_yaw_deg": 3.0}, "only with rx_position"),
        ({"rx_position": RX, "tx_elements": np.zeros((2, 3)), "multiplexing": "tdm"}, "one transmitter"),
    ],
)
def test_receivers_elsewhere_are_said_wholly(changes, said):
    with pytest.raises(ValueError, match=said):
        rc.Radar(WAVE, **changes)
