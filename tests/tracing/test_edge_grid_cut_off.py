"""Where a grid of edges is cut off, tubes find the same edges as in the whole grid."""

import numpy as np
import pytest

from raychan.run.simulate import simulate
from raychan.tracing import shadow_edges, silhouette_crossings
from raychan.world.body import Body
from raychan.world.scene import Scene

RADAR = {"power_dbm": 40.0, "waveform": {"bandwidth_mhz": 600.0, "chirp_us": 40.0, "chirps": 16, "samples": 128}}


def echoes(yaw):
    """Return sums of amplitudes by bounces, one to three, of a corner and a box behind a post, in a turned world."""
    c, s = np.cos(np.radians(yaw)), np.sin(np.radians(yaw))

    def at(x, y):
        return c * x - s * y, s * x + c * y, 0.5

    bodies = [
        Body(name="corner", shape="trihedral", params={"size": 0.2}, position=at(18, 3), yaw_deg=180 + yaw),
        Body(
            name="box", shape="box", params={"length": 1, "width": 1, "height": 1}, position=at(9, -2), yaw_deg=7 + yaw
        ),
        Body(name="post", shape="cylinder", params={"radius": 0.1, "height": 1.0}, position=at(6, 1.3)),
    ]
    paths = simulate(Scene(bodies=bodies, radar=RADAR | {"position": [0, 0, 0.7], "yaw_deg": yaw})).paths
    depth = (paths.kind > 0).sum(axis=1)
    return np.array([paths.amplitude[depth == k].sum() for k in (1, 2, 3)])


@pytest.mark.parametrize("yaw", [0.0, 37.0])
@pytest.mark.parametrize("middle", [(12.0, 7.0, 1.0), (5.0, 0.0, 0.0), (0.0, 20.0, 3.0)])
def test_a_grid_that_is_cut_off_leads_to_the_same_echoes(yaw, middle, monkeypatch):
    whole = echoes(yaw)
    for module in (silhouette_crossings, shadow_edges):
        low, high = np.array(middle) - 1.0, np.array(middle) + 1.0
        # A grid is cut off where it has more cells than memory allows; no scene small enough for a test has.
        monkeypatch.setattr(module, "grid_bounds", lambda m, a, b: (low[: len(a)], high[: len(a)], True))  # noqa: B023
    cut = echoes(yaw)
    np.testing.assert_allclose(np.abs(cut - whole) / np.abs(whole).max(), 0.0, atol=1e-3)
    assert abs(cut[2] / whole[2] - 1.0) < 1e-3
