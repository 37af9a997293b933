"""What can never be heard is told: an interferer beside the frame, and point targets of the other polarisation."""

import pytest

import raychan as rc

WAVE = rc.Waveform(77e9, 3e8, 3e-5, n_chirps=16, n_samples=64)


def warnings(start=0.0, **radar):
    ball = rc.Body("ball", shape="sphere", params={"radius": 0.1}, position=(9.0, 0.0, 0.5), rcs_dbsm=10.0)
    other = rc.Interferer(rc.Radar(WAVE, position=(20.0, 5.0, 1.0), yaw_deg=180.0), start=start, name="other")
    found = rc.simulate(rc.Scene([ball], radar=rc.Radar(WAVE, **radar), interferers=[other])).warnings
    return [line for line in found if "heard" in line]


@pytest.mark.parametrize(("start", "when"), [(5.0, "arrive from 5 s on"), (-1.0, "have arrived by -0.9995 s")])
def test_an_interferer_beside_the_frame_is_told(start, when):
    (said,) = warnings(start)
    assert said == (
        f"interferer 'other' is not heard: its ramps {when}, the frame lasts 0.00048 s "
        "(interferers.other.start_us, waveform.chirps)"
    )
    assert warnings(1e-4) == []


@pytest.mark.parametrize("pose", [{}, {"yaw_deg": 10.0, "pitch_deg": 3.0}])
def test_point_targets_that_crossed_receivers_cannot_hear_are_told(pose):
    (said,) = warnings(rx_polarization="H", **pose)
    assert said.startswith("no body is heard: receivers are cross-polarised to the transmitter")
    assert warnings(rx_polarization="both") == warnings(rx_polarization="V") == []


def test_a_constant_is_detected_where_the_only_path_has_no_gain():
    # The specular point of plain ground is right below the radar, where a patch that looks ahead hears nothing.
    radar = rc.Radar(WAVE, antenna=rc.CosineAntenna(60.0, 30.0), impairments=rc.Impairments(dc_offset_dbm=-40.0))
    result = rc.simulate(rc.Scene([rc.Body("ground", shape="ground")], radar=radar, model={"max_bounces": 1}))
    assert len(result.paths.delay) and not result.paths.amplitude.any()
    assert [why.label for why in result.provenance] == ["dc"]
    entry = result.ledger["intra-frame motion"]
    assert (entry.level_db, entry.kind, entry.how) == ("none", "exact", "no path")


def test_a_transmitter_beside_its_position_is_refused_of_an_interferer():
    aside = rc.Radar(WAVE, tx_elements=[[0.0, 0.9, 0.0]])
    with pytest.raises(ValueError, match=r"tx_elements = \[\[0\.0, 0\.9, 0\.0\]\] m: \[\[0, 0, 0\]\] is wanted"):
        rc.Interferer(aside)
