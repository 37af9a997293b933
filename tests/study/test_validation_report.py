"""The validation report: its page, its tables, and its copy in the repository."""

from __future__ import annotations

import re
import tomllib

import pytest
from PIL import Image

from raychan.report.validation_page import page
from raychan.report.validation_report import _difference, table
from raychan.study.validation.data import HERE, load


def test_a_page_shows_the_pictures_beside_it_and_its_links_lead_somewhere(tmp_path):
    Image.new("RGB", (1000, 10)).save(tmp_path / "dot.png")
    text = "# Title\n\n[a](#the-array-by-azimuth)\n\n## The array, by azimuth\n\n### T1\n\n![dot](dot.png)\n\n"
    made = page(text + "| a |\n| --- |\n| differs (why) |\n", tmp_path, "t")
    assert '<img src="dot.png" width="600"' in made
    assert '<td class="differs">differs (why)' in made and '<h3 id="t1">' in made
    assert set(re.findall(r'href="#([^"]+)"', made)) <= set(re.findall(r'id="([^"]+)"', made))


def test_columns_of_numbers_are_set_flush_right():
    lines = table(("", "n", "said"), [("a", "1,024", "+1 dB"), ("b", "", "-2.5"), ("c", "-0.3", "")])
    assert lines[1] == "| --- | ---: | --- |"


@pytest.mark.parametrize(
    ("off", "text"),
    [(0.0, "0"), (4e-5, "0"), (0.000651, "+0.0007"), (-0.0123, "-0.012"), (-12.04, "-12"), (759164.0, "+759,164")],
)
def test_differences_are_told_with_two_digits_that_count(off, text):
    assert _difference(off) == text


def test_the_report_in_the_repository_is_of_these_data():
    text = (HERE / "report.md").read_text(encoding="utf-8")
    keys = [i.id for i in load().items]
    for key in keys:
        assert len(re.findall(rf"^\| (?:\[{key}\]\(#{key.lower()}\)|{key}) \|", text, re.M)) >= 1, key
    names = {k["id"] for k in tomllib.loads((HERE / "known_differences.toml").read_text())["difference"]}
    assert all(f"| {n} |" in text for n in names)
    assert "## Problems" not in text
    for picture in re.findall(r"!\[[^]]*\]\(([^)]+)\)", text):
        assert (HERE / picture).is_file()
    assert "inf dB" not in text and "nan" not in text
    assert sum(f.stat().st_size for f in HERE.iterdir()) < 1_500_000
