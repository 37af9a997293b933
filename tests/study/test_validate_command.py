"""raychan validate: what it writes, and how it ends where data and code differ."""

from __future__ import annotations

import shutil

import pytest

from raychan.cli import invoke
from raychan.study.validation.data import HERE


@pytest.fixture
def data(tmp_path):
    """Return a copy of the data that a test may spoil; the scenes beside it are the checkout's."""
    copy = tmp_path / "checkout" / "validation"
    copy.mkdir(parents=True)
    for file in HERE.glob("*.toml"):
        shutil.copy(file, copy)
    (copy.parent / "scenes").symlink_to(HERE.parent / "scenes")
    return copy


def spoil(file, old, new):
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))


def run(tmp_path, *more):
    return invoke(["validate", "--out", str(tmp_path / "out"), "--only", "C003", "--only", "T7", *more])


def test_report_and_page_are_written(tmp_path, capsys):
    assert run(tmp_path) == 0
    text = (tmp_path / "out" / "report.md").read_text()
    assert "C003" in text and "0.264" in text and "cannot be tested as printed" in text
    assert "agrees" in capsys.readouterr().out
    assert '<td class="agrees">' in (tmp_path / "out" / "report.html").read_text()


def test_an_unknown_difference_ends_with_1_and_its_name(tmp_path, data, capsys):
    spoil(data / "claims.toml", "printed = 0.2636", "printed = 0.2836")
    assert run(tmp_path, "--data", str(data)) == 1
    assert "difference not listed: C003/range_resolution" in capsys.readouterr().err
    assert "## Problems" in (tmp_path / "out" / "report.md").read_text()


def test_a_difference_that_is_gone_ends_with_1_and_its_name(tmp_path, data, capsys):
    with open(data / "known_differences.toml", "a") as file:
        file.write('\n[[difference]]\nid = "old"\nkind = "paper"\nchecks = ["C003/*"]\nreason = "none"\n')
    assert run(tmp_path, "--data", str(data)) == 1
    assert "known difference 'old' is gone: C003/range_resolution" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("file", "old", "new", "said"),
    [
        ("claims.toml", 'measure = ["gap", "street"', 'measure = ["gab", "street"', "no measure 'gab'"),
        ("claims.toml", "printed = 0.2636", "thiers = 0.2636", "thiers"),
        ("claims.toml", '"urban", "range_resolution"', '"urban", "rang_resolution"', "did you mean 'range_resolution'"),
        ("claims.toml", '"urban", "range_resolution"', '"urbane", "range_resolution"', "no run 'urbane'"),
        ("claims.toml", '"urban", "range_resolution"', '"urban"', "arguments for 'waveform'"),
        ("study.toml", 'changes = ["radar.waveform.bandwidth_mhz=4000"]', 'changes = ["radar.waveform.x=4"]', "'x'"),
        ("study.toml", "[run.urban]", "[run.urban", "not valid TOML"),
        ("tables.toml", 'untestable = "lobes"', 'untestable = "globes"', "no reason 'globes'"),
        ("study.toml", 'scene = "urban"', 'scene = "suburb"', "suburb.toml"),
    ],
)
def test_broken_data_are_told_with_their_place_and_nothing_is_written(tmp_path, data, capsys, file, old, new, said):
    spoil(data / file, old, new)
    wanted = ["validate", "--out", str(tmp_path / "out"), "--only", "C001", "--only", "C003", "--data", str(data)]
    assert invoke(wanted) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_without_a_checkout_it_says_so(tmp_path, capsys):
    assert run(tmp_path, "--data", str(tmp_path)) == 2
    assert "checkout" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_an_item_that_does_not_exist_is_refused(tmp_path, capsys):
    assert invoke(["validate", "--out", str(tmp_path / "out"), "--only", "T17"]) == 2
    assert "no table or claim 'T17'" in capsys.readouterr().err


def test_ctrl_c_leaves_nothing(tmp_path, monkeypatch):
    def stopped(*_, **__):
        raise KeyboardInterrupt

    # Ctrl-C comes while a scene is simulated.
    monkeypatch.setattr("raychan.study.validation.bench.simulate", stopped)
    assert invoke(["validate", "--out", str(tmp_path / "out"), "--only", "C010"]) == 130
    assert not list(tmp_path.iterdir())
