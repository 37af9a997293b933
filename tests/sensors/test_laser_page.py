"""The block of docs/laser.md runs and meets what it says."""

import re

from support.places import ROOT

from raychan.sensors.laser import SEA


def test_the_block_of_the_page_runs():
    text = (ROOT / "docs" / "laser.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```python\n(.*?)```", text, re.S)
    names = {}
    exec(compile(block, "docs/laser.md", "exec"), names)
    assert {0, SEA} <= set(names["found"].body.tolist())
