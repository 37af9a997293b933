"""Tables in terminals that are narrower than they are."""

from __future__ import annotations

import re

import pytest

from raychan.cli import show

_BOLD = re.compile(r"\x1b\[[0-9;]*m")


@pytest.mark.parametrize("columns", [20, 40, 70, 80, 200])
def test_no_figure_of_a_table_is_cut_however_narrow_the_terminal(columns, capsys, monkeypatch):
    """The same words and figures stand in all of them; where there is room, no line runs over."""
    heads = ["#", "range m", "range rate m/s", "SNR dB", "power dBm", "label", "bodies"]
    rows = [[str(i), f"{22.37 + i:.2f}", "+157.34", "30.9", "-104.5", "direct", "car_1.body"] for i in range(3)]
    monkeypatch.setattr(show.sys.stdout, "isatty", lambda: True, raising=False)
    monkeypatch.setenv("COLUMNS", str(columns))
    show.console().print(show.table("3 detections", heads, rows, left=(5, 6)))
    said = _BOLD.sub("", capsys.readouterr().out)
    lines = [line.split() for line in said.splitlines()]
    for row in rows:
        assert row in lines
    words = [word for line in lines for word in line]
    assert all(word in words for head in heads for word in head.split())
    assert columns < 70 or max(map(len, said.splitlines())) <= columns


def test_long_text_folds_before_lines_run_over(capsys, monkeypatch):
    monkeypatch.setattr(show.sys.stdout, "isatty", lambda: True, raising=False)
    monkeypatch.setenv("COLUMNS", "60")
    bodies = " > ".join(["guard_rail.beam"] * 6)
    show.console().print(show.table("", ["range m", "bodies"], [["22.37", bodies]], left=(1,)))
    said = _BOLD.sub("", capsys.readouterr().out).splitlines()
    assert max(map(len, said)) <= 60 and any("22.37" in line for line in said)
    assert "".join("".join(line[8:] for line in said[3:]).split()) == bodies.replace(" ", "")
