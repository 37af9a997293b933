"""What a beam loses of an echo whose rate differs over the elements is told."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc

AHEAD = 40.0  # m
WAVE = {"bandwidth_mhz": 300.0, "chirp_us": 40.0, "repetition_us": 50.0, "chirps": 512, "samples": 128}


def scene(rate: float, width: float = 0.24, **wave):
    """Return a scene of a target far ahead that crosses before a line of elements so wide [m]."""
    line = [[0.0, width * (k / 15 - 0.5), 0.0] for k in range(16)]
    target = {"name": "target", "shape": "sphere", "params": {"radius": 0.005}, "rcs_dbsm": 40.0}
    target |= {"position": [AHEAD, 0.0, 0.5], "velocity_mps": [0.0, rate, 0.0]}
    radar = {"position": [0.0, 0.0, 0.5], "elements_mm": [[1e3 * x for x in e] for e in line], "waveform": WAVE | wave}
    # Constant rates over the frame: else the echo is smeared over rates besides.
    return rc.Scene.from_dict({"radar": radar, "bodies": [target], "model": {"max_bounces": 1, "retrace": 1}})


def lines(result) -> list[str]:
    return [line for line in result.warnings if "rates that differ over the elements" in line]


def test_a_near_echo_from_beyond_the_map_has_its_direction():
    """It shows at 8 m: as from there it would be 29 degrees aside."""
    found = rc.simulate(scene(0.0, samples=64)).detections
    assert found.range == pytest.approx([8.0], abs=0.1)
    assert np.degrees(found.azimuth) == pytest.approx([0.0], abs=0.1)


def test_a_line_tells_by_how_many_cells_rates_differ_and_what_a_beam_loses(tmp_path):
    result = rc.simulate(scene(60.0))
    cell = result.rdmap.rate_resolution
    # At each end of the line the direction is turned by half its width over the distance; rates are half of lengths'.
    cells = 0.5 * 60.0 * 0.24 / AHEAD / cell
    (line,) = lines(result)
    assert f"by up to {cells:.1f} cells" in line
    still = rc.simulate(scene(0.0))
    assert not lines(still) and not lines(rc.simulate(scene(5.0)))
    lost = float(line.split(" read up to ")[1].split(" dB")[0])
    less = 10.0 * np.log10(still.detections.power.max() / result.detections.power.max())
    assert lost > 0.5 and less == pytest.approx(lost, abs=0.1)
    rc.save_result(result, tmp_path)
    assert rc.load_result(tmp_path).provenance == result.provenance
