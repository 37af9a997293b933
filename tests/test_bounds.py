"""No kernel reads or writes beyond its arrays: with NUMBA_BOUNDSCHECK=1, as in `make test` and `make test-bounds`."""

import os
from pathlib import Path

import numpy as np
import pytest
from helpers import facets, ground

from raychan.cli import invoke
from raychan.kernels.facets import ends

SCENES = sorted((Path(__file__).parents[1] / "scenes").glob("*.toml"))
checked = pytest.mark.skipif(not os.environ.get("NUMBA_BOUNDSCHECK"), reason="wants NUMBA_BOUNDSCHECK=1")


@checked
def test_a_read_beyond_an_array_is_caught():
    with pytest.raises(IndexError):
        ends(facets([ground()]).vertices, np.array([99]))


@checked
@pytest.mark.parametrize("scene", SCENES, ids=lambda p: p.stem)
def test_a_scene_runs_within_its_arrays(scene: Path, tmp_path: Path, capfd):
    code = invoke(["run", str(scene), "--tolerance", "3", "--no-pictures", "--out", str(tmp_path / "out")])
    assert code == 0, capfd.readouterr().err
