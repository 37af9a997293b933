"""Texts of scene files that name files are refused by their keys where they can name none."""

import pytest

from raychan.run.ship.scene import read_ship_scene
from raychan.world.errors import SceneError
from raychan.world.scene import Scene

RADAR = "[radar]\n{}\n[radar.waveform]\nbandwidth_mhz = 300\nchirp_us = 12\n"
OTHER = '[[interferers]]\nname = "b"\nposition = [1, 1, 1]\nwaveform = {{ bandwidth_mhz = 300, chirp_us = 12 }}\n'
KEYS = [
    *((Scene.load, f"radar.{key}", RADAR.format(f"{key} = {{}}")) for key in ("antenna", "tx_antenna", "rx_antenna")),
    (Scene.load, "radar.antenna.file", RADAR.format("antenna.kind = 'measured'\nantenna.file = {}")),
    (Scene.load, "interferers.b.antenna", RADAR.format("") + OTHER + "antenna = {}\n"),
    (Scene.load, "bodies.b.mesh", "[[bodies]]\nname = 'b'\nmesh = {}\n"),
    (read_ship_scene, "bodies.b.mesh", "[[bodies]]\nname = 'b'\nmesh = {}\n"),
    (read_ship_scene, "replay.file", "[replay]\nfile = {}\n"),
]


@pytest.mark.parametrize(("load", "key", "text"), KEYS)
@pytest.mark.parametrize(
    ("name", "allowed"), [(r"a\u0000b", "a name without a zero byte"), ("", "the name of a file")], ids=["zero", "none"]
)
def test_a_text_that_can_name_no_file_is_refused_by_its_key(load, key, text, name, allowed, tmp_path):
    file = tmp_path / "scene.toml"
    file.write_text(text.format(f'"{name}"'))
    with pytest.raises(SceneError) as caught:
        load(file)
    assert (caught.value.key, caught.value.file) == (key, file)
    assert f"is not possible; allowed: {allowed}" in str(caught.value)
