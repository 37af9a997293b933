"""The published ship simulation: every claim of its ship, its scanner and its streams agrees, or its difference is
listed."""

from __future__ import annotations

import pytest

from raychan.study.validation.judge import AGREES
from raychan.study.validation.validate import validate

CLAIMS = [f"C{n:03d}" for n in range(81, 104)]


@pytest.fixture(scope="module")
def done():
    return validate(only=CLAIMS)


def test_claims_of_the_ship_agree_or_their_difference_is_listed(done):
    assert not done.problems and {i.id for i in done.items} == set(CLAIMS)
    assert {c.key for c in done.checks if c.verdict != AGREES} == {"C088/roll_by_roll", "C088/sway_by_yaw_rate"}


def test_the_printed_roll_is_ten_thousand_times_as_stiff_as_published(done):
    seen = {c.key: c for c in done.checks}
    stiff = seen["C088/published_roll_stiffness_roll_alone"].simulated
    assert -seen["C088/roll_by_roll"].figure.printed / stiff == pytest.approx(10_042, rel=1e-3)
