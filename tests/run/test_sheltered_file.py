"""HDF5 on a full disk: no crash, one sentence, nothing left."""

import errno
import io
import subprocess
import sys

import h5py
import numpy as np
import pytest

from raychan.run.files.sheltered_file import ShelteredFile


class Small(io.BytesIO):
    """A disk with room for some bytes; it writes as much of a block as fits."""

    room = 3000

    def write(self, data):
        left = self.room - self.tell()
        if left <= 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        return super().write(bytes(data)[:left])

    def truncate(self, size=None):
        if size > self.room:
            raise OSError(errno.ENOSPC, "No space left on device")
        return super().truncate(size)


def on_a_small_disk(tmp_path):
    made = ShelteredFile(tmp_path / "file")
    made._file.close()
    made._file = Small()
    return made


def test_what_a_full_disk_refuses_is_read_back_and_told(tmp_path):
    made, wanted, rng = on_a_small_disk(tmp_path), io.BytesIO(), np.random.default_rng(4)
    for _ in range(300):
        at, data = int(rng.integers(0, 5000)), rng.bytes(int(rng.integers(1, 400)))
        for file in (made, wanted):
            file.seek(at)
            assert file.write(data) == len(data)
        at, size = int(rng.integers(0, 4000)), int(rng.integers(1, 900))
        for file in (made, wanted):
            file.seek(at)
        assert made.read(size).rstrip(b"\0") == wanted.read(size).rstrip(b"\0")
        assert made.seek(0, io.SEEK_END) == wanted.seek(0, io.SEEK_END)
    with pytest.raises(OSError, match="No space left"):
        made.check()
    with pytest.raises(OSError, match="No space left"):
        made.close()


def test_hdf5_closes_on_a_full_disk_and_a_file_with_room_is_whole(tmp_path):
    values = np.random.default_rng(1).normal(size=(200, 50))
    made = on_a_small_disk(tmp_path)
    with h5py.File(made, "w") as file:
        file.create_dataset("x", data=values, chunks=(20, 50), compression="gzip")
    with pytest.raises(OSError, match="No space left"):
        made.close()
    made = ShelteredFile(tmp_path / "whole.nc")
    with h5py.File(made, "w") as file:
        file.create_dataset("x", data=values, chunks=(20, 50), compression="gzip")
    made.close()
    with h5py.File(tmp_path / "whole.nc") as file:
        assert (file["x"][:] == values).all()


_FULL = """
import resource
from raychan.cli import invoke
from raychan.run.ship import files as ship_files
ship_files._BLOCK = 20
_, most = resource.getrlimit(resource.RLIMIT_FSIZE)
for kib in (2, 4, 8, 12, 14, 16, 18):
    resource.setrlimit(resource.RLIMIT_FSIZE, (1024 * kib, most))
    print(invoke({argv!r}))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="needs resource limits")
def test_a_ship_on_a_full_disk_ends_with_2_and_one_sentence_and_nothing_left(tmp_path):
    scene, out = tmp_path / "ship.toml", tmp_path / "out"
    scene.write_text("[run]\nduration_s = 3\n[sea]\nreflectivity = 0.4\n")
    code = _FULL.format(argv=["ship", str(scene), "--out", str(out), "--no-pictures"])
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["2"] * 7, (done.stdout, done.stderr)
    assert done.stderr.splitlines() == [f"raychan: {out}: cannot write: File too large"] * 7
    assert [p.name for p in tmp_path.iterdir()] == ["ship.toml"]
