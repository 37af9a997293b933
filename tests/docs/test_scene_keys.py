"""Every key of the radar's tables stands in docs/scene_files.md."""

from pathlib import Path

import pytest

from raychan.world.schema import RadarTable, WaveformTable

TEXT = (Path(__file__).parents[2] / "docs" / "scene_files.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("key", [*RadarTable.model_fields, *WaveformTable.model_fields])
def test_every_key_of_the_radar_is_told(key):
    assert f"`{key}`" in TEXT
