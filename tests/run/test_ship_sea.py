"""A wavy sea and beams of finite width in the loop: what the sensor knows comes from the scene file."""

import numpy as np
import pytest

import raychan as rc
from raychan.poses import rotation
from raychan.run.ship.loop import ShipLoop
from raychan.run.ship.scene import ship_scene
from raychan.sensors.laser import SEA
from raychan.sensors.sea import SeaState, waves
from raychan.sensors.spot import Echo


def loop(waves=None, **scanner):
    sea = {"reflectivity": 1.0} | ({} if waves is None else {"waves": waves})
    made = {"position": [0.0, 0.0, 6.0], "pitch_deg": 12.0} | scanner
    return ShipLoop(ship_scene({"ship": {"model": "yacht"}, "sea": sea, "scanner": made}))


def test_echoes_of_a_wavy_sea_lie_on_its_surface_at_the_time_of_each_beam():
    sailing = loop({"height_m": 1.0, "period_s": 4.0, "heading_deg": 90.0, "spread": False})
    frames = [sailing.step_scan() for _ in range(300)]
    surface = waves(SeaState(1.0, 4.0, 1.0, -np.pi / 2, False), np.random.default_rng(0).spawn(4)[3])
    scanner = sailing.scene.scanner
    for frame in frames[::50]:
        met = frame.scan.body == SEA
        assert met.sum() > 60
        turned = np.array([frame.beams.yaw, frame.beams.pitch, frame.beams.roll]).T
        towards = [rotation(*t) @ [np.cos(a), np.sin(a), 0.0] for t, a in zip(turned, scanner.angles, strict=True)]
        points = (frame.beams.position + frame.scan.range[:, None] * towards)[met]
        height = surface.height(points[:, 0], points[:, 1], (frame.time + scanner.times)[met])
        assert points[:, 2] == pytest.approx(height, abs=1e-5)
        assert np.ptp(points[:, 2]) > 0.1
    assert (surface.wave_y <= 0.0).all()  # they run to the east


def test_waves_of_no_height_are_the_flat_sea():
    flat, still = loop().step_scan(), loop({"height_m": 0.0, "period_s": 5.0}).step_scan()
    assert (flat.scan.body == still.scan.body).all()
    assert still.scan.range == pytest.approx(flat.scan.range, abs=1e-6)


def test_a_spot_and_lamberts_law_reach_the_scanner():
    scanner = ship_scene({"scanner": {"lambert": True, "spot": {"rings": 2, "echo": "mean"}}}).scanner
    assert scanner.lambert and scanner.spot.rings == 2 and scanner.spot.echo is Echo.MEAN
    assert scanner.spot.divergence == pytest.approx(4.6e-3) and scanner.spot.exit_diameter == pytest.approx(0.013)
    few = np.isfinite(loop(lambert=True).step_scan().scan.range).sum()
    assert few < np.isfinite(loop().step_scan().scan.range).sum()


@pytest.mark.parametrize(
    "tables, said",
    [
        ({"sea": {"waves": {"height_m": 1.0}}}, r"sea\.waves\.period_s: key is missing"),
        ({"sea": {"waves": {"height_m": 50.0, "period_s": 5.0}}}, "significant height"),
        ({"scanner": {"spot": {"echo": "last"}}}, r"scanner\.spot\.echo: 'last' is not possible"),
        ({"scanner": {"spot": {"ring": 1}}}, "did you mean 'rings'"),
    ],
)
def test_what_no_sea_or_spot_has_is_told(tables, said):
    with pytest.raises(rc.SceneError, match=said):
        ship_scene(tables)
