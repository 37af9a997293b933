"""A voyage tells where its scanner was that no scanner can be: within bodies, and under waves."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from raychan.cli import app
from raychan.run.ship.loop import ShipLoop
from raychan.run.ship.places import UNDER_WATER, LostScans, lost_lines
from raychan.run.ship.scene import ship_scene

QUAY = {"name": "quay", "shape": "box", "params": {"length": 10.0, "width": 100.0, "height": 30.0}, "reflectivity": 1.0}
YACHT = {"ship": {"model": "yacht", "speed_mps": 10.0}, "programme": {"headings": [[0.0, 0.0]]}}


def lost(**tables):
    """Return where each scan began, and the place of its first beam."""
    loop = ShipLoop(ship_scene({**YACHT, **tables}))
    frames = [loop.step_scan() for _ in range(loop.scans)]
    return [f.lost_in for f in frames], np.array([f.beams.position[0] for f in frames])


def test_scans_within_a_body_are_those_between_its_walls():
    where, place = lost(bodies=[{**QUAY, "position": [10.0, 0.0, 0.0]}], run={"duration_s": 2.0})
    inside = (place[:, 0] > 5.0) & (place[:, 0] < 15.0)
    assert inside.any() and not inside.all()
    assert where == ["quay" if x else "" for x in inside]


def test_a_body_that_moves_is_where_it_is_at_the_time_of_the_scan():
    moving = {**QUAY, "position": [5.5, 0.0, 0.0], "velocity_mps": [10.0, 0.0, 0.0]}
    where, place = lost(bodies=[moving], run={"duration_s": 1.0})
    ahead = place[:, 0] - 10.0 * np.arange(len(place)) / 75.0
    assert where == ["quay" if x > 0.5 else "" for x in ahead]


def test_scans_under_waves_are_those_below_the_surface():
    sea = {"reflectivity": 0.5, "waves": {"height_m": 6.0, "period_s": 8.0, "heading_deg": 90.0}}
    tables = {"sea": sea, "scanner": {"position": [2.0, 0.0, 0.5]}, "run": {"duration_s": 4.0}}
    loop = ShipLoop(ship_scene({**YACHT, **tables}))
    for _ in range(loop.scans):
        swell = loop._waves.at(loop.now)
        frame = loop.step_scan()
        x, y, z = frame.beams.position[0]
        assert (frame.lost_in == UNDER_WATER) == (swell.height(x, y) > z)


def test_lost_scans_are_counted_and_told():
    scans = LostScans()
    for k, where in enumerate(["", "quay", "quay", UNDER_WATER]):
        scans.add(where, 0.5 * k)
    assert scans.summary == {"quay": {"scans": 2, "first_s": 0.5}, UNDER_WATER: {"scans": 1, "first_s": 1.5}}
    assert lost_lines(scans.summary, 4) == [
        "2 of 4 scans begin inside 'quay' (nothing stops the ship), the first at 0.50 s: their ranges mean nothing",
        "1 of 4 scans begin under waves, the first at 1.50 s: their ranges mean nothing",
    ]


@pytest.mark.parametrize(("north", "told"), [(10.0, True), (100.0, False)])
def test_the_command_tells_them(tmp_path, north, told):
    (tmp_path / "s.toml").write_text(
        '[ship]\nmodel = "yacht"\nspeed_mps = 10.0\n[programme]\nheadings = [[0.0, 0.0]]\n[run]\nduration_s = 1.0\n'
        f'[[bodies]]\nname = "quay"\nshape = "box"\nposition = [{north}, 0.0, 0.0]\nreflectivity = 1.0\n'
        "params = { length = 10.0, width = 100.0, height = 30.0 }\n"
    )
    done = CliRunner().invoke(app, ["ship", str(tmp_path / "s.toml"), "--out", str(tmp_path / "o"), "--no-pictures"])
    assert done.exit_code == 0
    found = json.loads((tmp_path / "o" / "summary.json").read_text())
    assert bool(found["lost_in"]) is told
    assert ("inside 'quay'" in " ".join(done.output.split())) is told
