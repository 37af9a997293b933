"""I/Q images in a map: at minus the range and rate of their echo, as far below it as the imbalance says, and named."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc
from raychan.cli import invoke
from raychan.signal.converter import image_rejection_db

IQ = {"iq_gain_db": 1.8, "iq_phase_deg": 3.0}
WAVE = {"bandwidth_mhz": 50.0, "chirp_us": 40.0, "chirps": 32, "samples": 64}  # cells of 3 m
ARRAY = {"elements_mm": [[0.0, y, 0.0] for y in (-1.0, 0.9)], "tx_elements_mm": [[0.0, y, 0.0] for y in (-2.0, 2.0)]}


def scene(*marks, iq=IQ, wave=WAVE, **radar):
    """Return a scene of spheres, each so far away [m], receding so fast [m/s], of so many dBsm."""
    bodies = [
        {
            "name": f"mark_{k}",
            "shape": "sphere",
            "params": {"radius": 0.1},
            "position": [at, 2.0 * k, 0.5],
            "velocity_mps": [rate, 0.0, 0.0],
            "rcs_dbsm": rcs,
        }
        for k, (at, rate, rcs) in enumerate(marks)
    ]
    given = {"waveform": wave, "impairments": iq, **radar}
    return rc.Scene.from_dict({"radar": given, "bodies": bodies, "model": {"max_bounces": 1}})


@pytest.mark.parametrize(
    "radar",
    [{}, {"wave": WAVE | {"stagger_us": [52.0, 60.0]}}, ARRAY | {"multiplexing": "tdm"}],
    ids=["one receiver", "stagger", "array"],
)
def test_an_image_stands_at_minus_the_place_of_its_echo_by_the_rejection_below_it_and_is_named(radar):
    result = rc.simulate(scene((60.0, 3.0, 60.0), **radar))
    found, (echo, image), rdmap = result.detections, result.provenance[:2], result.rdmap
    assert (found.range[0] + found.range[1]) % rdmap.unambiguous_range == pytest.approx(0.0, abs=0.3)
    assert found.rate[0] + found.rate[1] == pytest.approx(0.0, abs=0.2)
    assert found.snr[0] - found.snr[1] == pytest.approx(image_rejection_db(1.8, 3.0), abs=0.5)
    assert (echo.label, image.label, image.bodies) == ("direct", "image", "I/Q image")
    assert not image.folded and image.error_db >= echo.error_db
    assert [x for x in result.warnings if x.startswith(f"1 of {len(found.range)} detections is an I/Q image of a str")]
    assert "image" not in {x.label for x in rc.simulate(scene((60.0, 3.0, 60.0), iq={}, **radar)).provenance}


def test_an_echo_at_the_place_of_an_image_keeps_its_label():
    unambiguous = rc.simulate(scene((60.0, 0.0, 60.0))).rdmap.unambiguous_range
    result = rc.simulate(scene((60.0, 0.0, 60.0), (unambiguous - 60.0, 0.0, 60.0)))
    assert sorted(why.bodies for why in result.provenance) == ["mark_0", "mark_1"]


def test_noise_and_a_dc_offset_have_no_image():
    # An imbalance whose images are 4 dB below: those of noise bring more than a tenth of every cell.
    result = rc.simulate(scene((60.0, 0.0, 60.0), iq={"iq_gain_db": 13.0, "dc_offset_dbm": -75.0}))
    assert {why.label for why in result.provenance} == {"direct", "image", "dc"}
    labels = [rc.explain(result, at, 12.0, cell=True).label for at in np.arange(21.0, 170.0, 9.0)]
    assert set(labels) == {"clutter"}


def test_explain_names_it_from_a_stored_result_too(tmp_path, capsys):
    rc.save_result(rc.simulate(scene((60.0, 0.0, 60.0))), tmp_path)
    stored = rc.load_result(tmp_path)
    at = stored.detections.range[1]
    assert stored.provenance[1].label == rc.explain(stored, at, 0.0, cell=True).label == "image"
    assert invoke(["explain", str(tmp_path), "--detection", "2"]) == 0
    assert "no path explains this cell: I/Q image" in capsys.readouterr().out


def test_the_stronger_of_two_detections_that_are_images_of_each_other_is_never_the_image():
    result = rc.simulate(scene((60.0, 3.0, 60.0), iq={"iq_gain_db": 16.0}))
    assert result.provenance[0].label != "image" and result.provenance[1].label == "image"
