"""Scene files as editors and systems hand them over."""

import os

import pytest

import raychan as rc

TEXT = "[radar]\n[radar.waveform]\nbandwidth_mhz = 500\nchirp_us = 40\nchirps = 2\nsamples = 16\n"


def test_a_byte_order_mark_is_no_part_of_a_scene(tmp_path):
    file = tmp_path / "marked.toml"
    file.write_bytes(b"\xef\xbb\xbf" + TEXT.encode())
    assert rc.Scene.load(file).radar.waveform.bandwidth == 500e6


def test_what_is_no_file_is_refused_at_once(tmp_path):
    pipe = tmp_path / "pipe.toml"
    os.mkfifo(pipe)
    for place, what in ((pipe, "not a file"), ("/dev/zero", "not a file"), (tmp_path, "a folder")):
        with pytest.raises(rc.SceneError, match=f"is {what}"):
            rc.Scene.load(place)


def test_a_file_too_large_for_a_scene_is_refused(tmp_path):
    file = tmp_path / "large.toml"
    with file.open("wb") as out:
        out.truncate(20 << 20)
    with pytest.raises(rc.SceneError, match="too large for a scene file"):
        rc.Scene.load(file)
