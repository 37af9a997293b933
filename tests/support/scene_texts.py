"""Scene texts that several tests build upon."""

from __future__ import annotations

PLATE = """
[scene]
title = "A plate ahead"
[radar]
position = [0.0, 0.0, 1.0]
velocity_mps = [5.0, 0.0, 0.0]
[radar.waveform]
bandwidth_mhz = 500.0
chirp_us = 30.0
chirps = 32
samples = 64
[model]
max_bounces = 1
tolerance_db = 3.0
[[bodies]]
name = "sign"
shape = "plate"
position = [9.0, 0.0, 1.0]
yaw_deg = 180.0
"""

ISOTROPIC = """
[radar]
position = [0.0, 0.0, 1.0]
power_dbm = 30.0
antenna = { kind = "isotropic" }
[radar.waveform]
bandwidth_mhz = 1000.0
chirp_us = 30.0
chirps = 32
samples = 256
[model]
max_bounces = 3
tolerance_db = 3.0
"""

BARE_RADAR = """
[radar]
[radar.waveform]
bandwidth_mhz = 570.0
chirp_us = 60.5
"""

BALL = '[[bodies]]\nname = "ball"\nshape = "sphere"\nposition = [10.0, 0.0, 0.5]\n'


def but_compiling(said: str) -> str:
    """Return what a command printed, without the line that it compiles: only the first of all tests does."""
    return "".join(line for line in said.splitlines(True) if not line.startswith("compiling, once"))


def upright(name: str, x: float, y: float) -> str:
    """Return a plate of 3 m by 3 m that faces the radar."""
    size = "params = { width = 3.0, height = 3.0 }"
    return f'[[bodies]]\nname = "{name}"\nshape = "plate"\n{size}\nposition = [{x}, {y}, 1.0]\nyaw_deg = 180.0\n'


def walker(x: float, y: float) -> str:
    """Return a box of a person's size that returns as a point of 0 dBsm; more of its keys may follow."""
    size = "params = { length = 0.2, width = 0.5, height = 1.8 }"
    return f'[[bodies]]\nname = "walker"\nshape = "box"\n{size}\nposition = [{x}, {y}, 0.1]\nrcs_dbsm = 0.0\n'
