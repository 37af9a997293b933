"""The map of CONTRIBUTING, and every file that the documentation names, are there."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]
ROW = re.compile(r"^\| (.+\?) \| `([\w/]+\.py)` \| `(\w+)` \|$", re.M)
QUESTIONS = ROW.findall((ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"))


def test_there_are_twenty_questions_of_their_own():
    assert len({question for question, _, _ in QUESTIONS}) == 20


@pytest.mark.parametrize("question, file, name", QUESTIONS)
def test_the_answer_to_a_question_is_there(question, file, name):
    tree = ast.parse((ROOT / "raychan" / file).read_text(encoding="utf-8"))
    assert name in {node.name for node in tree.body if isinstance(node, ast.FunctionDef | ast.ClassDef)}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_files_and_links_of_a_page_are_there(page):
    text = page.read_text(encoding="utf-8")
    for link in re.findall(r"\]\((?!https?:)([^)#]+)", text):
        assert (page.parent / link).exists(), f"{page.name}: link to {link}"
    if page.name == "CHANGELOG.md":
        return  # tells of what was
    for file in re.findall(r"`((?:[\w-]+/)+[\w-]+\.py)`", text):
        assert any((base / file).exists() for base in (ROOT, ROOT / "raychan")), f"{page.name}: {file}"


def test_each_package_has_its_floor():
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    floors = text[text.index("## Floors") : text.index("## Map")]
    packages = [file.parent.name for file in (ROOT / "raychan").glob("*/__init__.py")]
    assert not [name for name in packages if f"`{name}`" not in floors]
