"""Every key of the radar's tables and of those around it stands in docs/scene_files.md."""

import re
from pathlib import Path

import pytest

from raychan.world.scene_files.impairments import AtmosphereTable, ImpairmentsTable
from raychan.world.scene_files.materials import DiffuseTable
from raychan.world.scene_files.schema import InterfererTable, Model, RadarTable, WaveformTable

TEXT = (Path(__file__).parents[2] / "docs" / "scene_files.md").read_text(encoding="utf-8")


TABLES = (RadarTable, WaveformTable, ImpairmentsTable, AtmosphereTable, InterfererTable, DiffuseTable)


@pytest.mark.parametrize("key", sorted({key for table in TABLES for key in table.model_fields}))
def test_every_key_of_the_radar_and_its_surroundings_is_told(key):
    assert f"`{key}`" in TEXT or f"`{key} =" in TEXT


def test_the_row_of_the_model_names_all_its_keys_and_no_other():
    row = next(line for line in TEXT.splitlines() if line.startswith("| `[model]` |"))
    assert sorted(re.findall(r"`(\w+)`", row)) == sorted(Model.model_fields)
