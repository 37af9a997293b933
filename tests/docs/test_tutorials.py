"""Every fenced block of the tutorials and of the README runs, and prints what the text below it says.

`python` blocks of one page share their names; a `console` line `$ raychan ...` runs that command; a `toml` block whose
first line is `# NAME` is a file that all tutorials may use; each line of a `text` block stands in what was printed
before it.
"""

import csv
import re
import shlex
from pathlib import Path

import pytest

import raychan as rc
from raychan.cli import invoke

ROOT = Path(__file__).parents[2]
PAGES = sorted((ROOT / "docs" / "tutorials").glob("*.md"))
FENCE = re.compile(r"^```(\w+)\n(.*?)^```$", re.M | re.S)


def blocks(page):
    return FENCE.findall(page.read_text(encoding="utf-8"))


def files():
    """Name and text of every file that a tutorial gives."""
    for page in PAGES:
        for kind, text in blocks(page):
            if kind == "toml" and text.startswith("# "):
                yield text.splitlines()[0][2:].strip(), text


def plain(text):
    return re.sub(r"\s+", " ", text)


def run_commands(text):
    for line in text.splitlines():
        words = shlex.split(line.removeprefix("$ "), comments=True)
        assert line.startswith("$ raychan "), f"not a command of raychan: {line}"
        assert invoke(words[1:]) == 0, line


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_tutorial_runs_and_prints_what_it_says(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    for name, text in files():
        Path(name).write_text(text)
    names = {}
    for number, (kind, text) in enumerate(blocks(page)):
        if kind == "python":
            exec(compile(text, f"{page.name}, block {number}", "exec"), names)
        elif kind == "console":
            run_commands(text)
        elif kind == "text":
            printed = plain(capsys.readouterr().out)
            for line in text.splitlines():
                assert plain(line).strip() in printed, f"{page.name}: '{line}' is not printed"
        else:
            assert kind == "toml", f"{page.name}: a block of '{kind}'"


def test_the_readme_s_first_scene_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = blocks(ROOT / "README.md")
    (scene,) = (text for kind, text in found if kind == "toml")
    Path("first.toml").write_text(scene)
    assert rc.Scene.load("first.toml").bodies
    names = {}
    for kind, text in found:
        if kind == "python":
            exec(compile(text, "README.md", "exec"), names)


def test_the_readme_s_figures_are_those_of_the_committed_reports():
    def words(file):
        return plain((ROOT / file).read_text(encoding="utf-8"))

    readme = words("README.md")
    total, agree, differ, rest = re.search(
        r"(\d+) figures: (\d+) agree, (\d+) differ, (\d+) cannot be tested", words("validation/report.md")
    ).groups()
    assert f"of {total} printed figures {agree} agree, {differ} differ" in readme
    assert f"and {rest} cannot be tested" in readme
    with (ROOT / "validation" / "stability.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    passed = sum(row["passed"] == "pass" for row in rows)
    assert f"tries {len({row['regime'] for row in rows})} regimes" in readme
    assert f"{passed} of {len(rows)} checks pass" in readme
    with (ROOT / "validation" / "tradeoff.csv").open(encoding="utf-8") as file:
        (default,) = (r for r in csv.DictReader(file) if r["case"] == "all" and r["default"] == "True")
    assert f"the default is {float(default['error_db']):.1f} dB off on the worst" in readme
