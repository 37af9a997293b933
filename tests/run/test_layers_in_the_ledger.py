"""What the ledger says of thin layers that a run may not pass."""

import raychan as rc

_PANE = rc.Body(
    name="pane",
    shape="plate",
    params={"width": 1.5, "height": 1.5},
    material=rc.Material(2.6, thickness=3e-3),
    position=(1, 0, 1),
    yaw_deg=150.0,
)
_BALL = rc.Body(name="ball", shape="sphere", params={"radius": 0.4}, position=(12, 0, 1))
_RADAR = {
    "position": (0, 0, 1),
    "power_dbm": 20.0,
    "antenna": {"kind": "cosine", "hpbw_h_deg": 40.0, "hpbw_v_deg": 40.0},
    "waveform": {"bandwidth_mhz": 300.0, "chirp_us": 30.0, "chirps": 32, "samples": 128},
}


def _entry(**model):
    scene = rc.Scene(bodies=[_PANE, _BALL], radar=_RADAR, model={"max_bounces": 1, "tolerance_db": 1.0, **model})
    result = rc.simulate(scene)
    return result, result.ledger["transmission"]


def test_where_no_layer_may_be_passed_what_stands_behind_one_is_unknown():
    seen, _ = _entry()
    lost, entry = _entry(max_transmissions=0)
    assert len(lost.detections.range) < len(seen.detections.range)
    assert entry.level_db == "unknown" and "max_transmissions" in entry.how


def test_layers_that_may_be_passed_and_are_not_leave_nothing_out():
    _, entry = _entry(max_transmissions=4)
    assert entry.level_db == "none" and "more than 1 of the 4" in entry.how


def test_layers_count_by_stretch_as_the_limit_does():
    """One pane is passed out and back: one on each stretch."""
    _, entry = _entry(max_transmissions=2)
    assert entry.level_db == "none"
    _, entry = _entry(max_transmissions=1)
    assert entry.level_db not in ("none", "unknown")


def test_mode_auto_counts_layers_by_stretch_as_the_limit_does():
    result, _ = _entry(mode="auto", max_transmissions=2)
    assert result.ledger["model"].transmissions == 1
    assert any("thin layers on a stretch" in line for line in result.ledger["model"].why)
