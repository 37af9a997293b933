"""Cases: a folder of input and the commands to run on it, made from a seed and a number alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from fuzz import edits, meshes, scenes

KINDS = ("toml", "mesh", "scene")
_FLAGS = [
    ["--tolerance", "inf"], ["--tolerance", "nan"], ["--tolerance", "-1"], ["--tolerance", "1e-9"], ["--seed", "-1"],
    ["--seed", "99999999999999999999"], ["--max-bounces", "99"], ["--max-bounces", "0"], ["--max-bounces", "1.5"],
    ["--frames", "0"], ["--frames", "2"], ["--frames", "2", "--frame-interval", "1e300"], ["--frame-interval", "1"],
    ["--frames", "2", "--frame-interval", "0.1"], ["--set", "x"], ["--set", "=3"], ["--set", "radar.power_dbm=4000"],
    ["--set", "bodies.b0.position.x=1e30"], ["--set", "processing.pad=[4,0]"], ["--set", "a.b.c.d=1"],
    ["--set", "radar.waveform.samples=1e30"], ["--set", "radar.waveform.chirps=100000"], ["--set", "bodies=[]"],
]  # fmt: skip
_RCS_FLAGS = [
    ["--unit", "parsec"], ["--up", "w"], ["--up", "y"], ["--unit", "mm"], ["--scale", "0"], ["--scale", "nan"],
    ["--distance", "1e400"], ["--distance", "-1"], ["--distance", "0.5"], ["--azimuth", "1e30"], ["--material", "x"],
    ["--material", "glass"], ["--frequency-ghz", "77e9"], ["--max-bounces", "99"], ["--elevation", "90"],
]  # fmt: skip


def make(folder: Path, seed: int, number: int, kind: str = "") -> list[list[str]]:
    """Write a case's files into a folder; return its commands."""
    rng = np.random.default_rng([seed, number])
    kind = kind or KINDS[number % len(KINDS)]
    file, out = folder / "scene.toml", str(folder / "out")
    run = ["run", str(file), "--out", out, "--no-pictures"]
    if kind == "mesh":
        mesh = meshes.written(folder, "mesh", rng)
        tables = _plain(mesh.name)
        file.write_text(edits.dumped(tables), encoding="utf-8")
        angle = str(round(float(rng.uniform(-180.0, 180.0)), int(rng.integers(0, 4))))
        rcs = ["rcs", str(mesh), f"--azimuth={angle}", "--tolerance", "6", "--max-bounces", "2"]
        rcs += _some(_RCS_FLAGS, rng, 0.4)
        return [["info", str(mesh)], rcs, ["info", str(file)], run]
    tables = scenes.scene(rng, folder if rng.random() < 0.5 else None)
    if kind == "toml":
        text = edits.edited(tables, rng)
        file.write_bytes(text.encode("utf-8", "replace"))
        run += _some(_FLAGS, rng, 0.3)
    else:
        file.write_text(edits.dumped(tables), encoding="utf-8")
    wanted = ["--range", str(round(float(rng.uniform(-1.0, 12.0)), 2))]
    if rng.random() < 0.5:
        wanted += ["--speed", str(round(float(rng.uniform(-30.0, 30.0)), 2))]
    return [["info", str(file)], run, ["explain", out, *wanted]]


def _some(flags: list[list[str]], rng: Any, share: float) -> list[str]:
    return flags[int(rng.integers(len(flags)))] if rng.random() < share else []


def _plain(mesh: str) -> dict[str, Any]:
    waveform = {"bandwidth_mhz": 1000.0, "chirp_us": 20.0, "chirps": 8, "samples": 64}
    return {
        "radar": {"position": [0.0, 0.0, 0.5], "waveform": waveform},
        "model": {"tolerance_db": 6.0, "max_bounces": 2},
        "bodies": [{"name": "it", "mesh": mesh, "position": [3.0, 0.0, 0.5]}],
    }
