"""The published FMCW example: every claim of its three reflectors agrees or is listed, and its figures are drawn."""

from __future__ import annotations

import pytest

from raychan.report.reflector_figures import reflector_pictures, reflector_section
from raychan.study.validation.judge import AGREES
from raychan.study.validation.validate import validate

CLAIMS = [f"C{n:03d}" for n in range(61, 74)]


@pytest.fixture(scope="module")
def done():
    return validate(only=CLAIMS)


def test_claims_of_the_three_reflectors_agree_or_their_difference_is_listed(done):
    assert not done.problems
    assert {c.key for c in done.checks if c.verdict != AGREES} == {"C061/cell_of_the_map", "C070/reflector_2_moving"}


def test_what_the_target_does_not_do_at_rest_is_what_motion_costs(done):
    """Rectangular windows: the mean of sinc over half a range cell to both sides, as the peak passes by."""
    seen = {c.key: c.simulated for c in done.checks}
    lost = seen["C070/reflector_2_at_rest"] - seen["C070/reflector_2_moving"]
    assert lost == pytest.approx(1.6, abs=0.3)  # 1.4 dB, and what the nearest cell of rate lies off the peak


def test_figures_14_to_17_are_drawn_and_told_of(done, tmp_path):
    drawn = reflector_pictures(done.bench, tmp_path)
    assert all(path.stat().st_size > 10_000 for path in drawn.values())
    text = "\n".join(reflector_section({name: path.name for name, path in drawn.items()}))
    assert all(
        f"Figure {n}" in text and path.name in text for n, path in zip(range(14, 18), drawn.values(), strict=False)
    )
