"""Every key of a ship's scene stands in docs/scene_files.md."""

import re
from pathlib import Path

import pytest

from raychan.run.ship import schema as ship_schema
from raychan.world.scene_files.base import Table

TEXT = (Path(__file__).parents[2] / "docs" / "scene_files.md").read_text(encoding="utf-8")
SECTION = TEXT[TEXT.index("## A ship's scene") :]
TABLES = [t for t in vars(ship_schema).values() if isinstance(t, type) and issubclass(t, Table) and t is not Table]
POSE = {"position", "yaw_deg", "pitch_deg", "roll_deg"}
"""Of a body: said as its pose."""


@pytest.mark.parametrize("table", TABLES, ids=lambda t: t.__name__)
def test_every_key_of_a_ships_scene_is_told(table):
    told = set(re.findall(r"`\[*([a-z_0-9.]+)\]*`", SECTION))
    within = {"noise": "steering.noise", "spot": "scanner.spot", "waves": "sea.waves"}
    keys = {within.get(k, k) for k in table.model_fields}
    assert not keys - told - (POSE if "mesh" in keys else set())
