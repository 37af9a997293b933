"""What commands import: nothing that takes long before it is needed."""

from __future__ import annotations

import subprocess
import sys

import pytest

RUN = "raychan.run.simulate, raychan.run.storage, raychan.cli.run"


def test_next_to_nothing_is_imported_before_ctrl_c_is_heeded():
    code = "import __future__, os, sys; had = {*sys.modules, 'raychan'}; import raychan; print({*sys.modules} - had)"
    done = subprocess.run([sys.executable, "-S", "-c", code], capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, done.stdout) == (0, "set()\n"), done.stdout + done.stderr


@pytest.mark.parametrize(
    ("modules", "late"),
    [
        (RUN, ["scipy.stats", "scipy.signal", "xarray", "matplotlib", "pyvista"]),
        ("raychan.view.render", ["scipy", "numba", "xarray", "pyvista"]),
    ],
)
def test_what_takes_long_to_import_is_imported_where_it_is_needed(modules, late):
    code = f"import sys, {modules}; print(sorted(set({late}) & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, done.stdout) == (0, "[]\n"), done.stdout + done.stderr
