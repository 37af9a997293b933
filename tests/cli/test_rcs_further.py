"""What raychan rcs says of bounces beyond those allowed."""

from __future__ import annotations

import numpy as np
import pytest

from raychan.cli import invoke
from raychan.run.rcs import rcs
from raychan.world.shapes import build


def test_what_further_bounces_may_change_is_told_where_it_matters(capsys):
    """A corner returns by its third bounce, and nothing by a fourth; a ball has one."""
    corner = ["rcs", "--shape", "trihedral", "--azimuth", "5", "--elevation", "5"]
    assert invoke([*corner, "--max-bounces", "2"]) == 0
    said = capsys.readouterr().err
    assert "the error does not include further bounces (--max-bounces, now 2)" in " ".join(said.split())
    for enough in "34":
        assert invoke([*corner, "--max-bounces", enough]) == 0
        assert "further bounces" not in capsys.readouterr().err
    assert invoke([*corner, "--max-bounces", "1"]) == 0
    assert "the body is not convex" in capsys.readouterr().err
    assert invoke(["rcs", "--shape", "sphere", "--max-bounces", "1"]) == 0
    assert "further bounces" not in capsys.readouterr().err


def test_further_db_is_what_one_more_bounce_brings():
    """A corner's third bounce brings all that two do not, its fourth nothing; a box has no second."""
    mesh = build("trihedral")
    two, three = (rcs(mesh, 77e9, 5.0, 5.0, max_bounces=n) for n in (2, 3))
    third = abs(three.amplitude[0, 0] - two.amplitude[0, 0]) / abs(two.amplitude[0, 0])
    assert two.further_db == pytest.approx(20.0 * np.log10(1.0 + third), abs=1.0)
    assert three.further_db < 0.01
    assert rcs(build("box"), 77e9, 35.0).further_db == 0.0
    assert np.isnan(rcs(mesh, 77e9, 35.0, max_bounces=1).further_db)


@pytest.mark.parametrize("angles", [(0.0, 0.0), (10.0, 5.0)])
def test_a_corner_of_three_faces_that_may_return_by_two_bounces_tells_of_the_third(angles, capsys):
    """Along its axis the second bounce returns nothing, which tells nothing of the third."""
    mesh = build("trihedral")
    two, three = (rcs(mesh, 77e9, *angles, max_bounces=n) for n in (2, 3))
    brought = 10.0 * np.log10(float(three.sigma / two.sigma))
    told = ["--azimuth", f"{angles[0]}", "--elevation", f"{angles[1]}"]
    assert invoke(["rcs", "--shape", "trihedral", *told, "--max-bounces", "2"]) == 0
    assert "further bounces" in capsys.readouterr().err and float(two.further_db) > 3.0
    if angles == (0.0, 0.0):
        assert float(two.further_db) == pytest.approx(brought, abs=0.5)
    assert float(rcs(build("dihedral"), 77e9, *angles).further_db) == 0.0
