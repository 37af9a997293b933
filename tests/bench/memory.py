"""Peak memory of a process that does one thing, as the operating system counts it."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from bench.measure import Row, barred

_MANY = 10_000_000
_MOST = 6 << 30  # bytes of address space that a process may take: a machine shared with others is not brought down
_PEAK = """
import json, resource, sys, time
resource.setrlimit(resource.RLIMIT_AS, ({most}, {most}))
{job}
took = time.perf_counter() - start
try:
    # On Linux ru_maxrss counts the process that started this one too.
    peak = int(open("/proc/self/status").read().split("VmHWM:")[1].split()[0]) * 1.024e-3
except OSError:
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1e6 if sys.platform == "darwin" else 1e3)
print(json.dumps([peak, tubes, took]))
"""
_NOTHING = """
import raychan as rc, raychan.run.simulate, finufft, scipy.fft
start, tubes = time.perf_counter(), 0
"""
_FRAME = """
import raychan as rc
scene = rc.Scene.load({scene!r})
start = time.perf_counter()
tubes = rc.simulate(scene, tolerance_db={tolerance!r}).stats["tubes"]
"""
_TUBES = """
import dataclasses
import raychan as rc
from raychan.run.solver import solve_into
from raychan.tracing.settings import refinement
from raychan.run.path_stream import PathStream
from raychan.run.solver import PruneRule
from raychan.radar.beam_table import beam_of
from raychan.world.geometry import Geometry
import raychan.tracing.solver as solver
solver._TUBES = 10 * {tubes}  # a launch of a scene cuts fewer and says so
scene = rc.Scene(
    bodies=[rc.Body("wall", shape="plate", params=dict(width=10.0, height=10.0), position=(8, 0, 0), yaw_deg=180.0)],
    radar=dict(position=[0.0, 0.0, 0.0], waveform=dict(bandwidth_mhz=500.0, chirp_us=30.0, chirps=64, samples=128)),
)
start = time.perf_counter()
rule = refinement(77e9, 0.5)
rule = dataclasses.replace(rule, max_edge=10.0 * ({tubes} / 2.0) ** -0.5, max_tubes=10 * {tubes})
gather, radar = PathStream(scene.radar, "hann"), scene.radar
rule = PruneRule(radar.position, beam_of(radar), rule, 1)
tubes = solve_into(gather.add, Geometry(scene.facets()), scene.points(), radar, 77e9, rule).tubes
gather.done().quiet
"""


def memory(scenes: Path, repeats: int, quick: bool) -> Iterator[Row]:
    """Measure a bare start with all libraries, two frames and many tubes, each once: memory scatters less than time."""
    _, idle, _, row = _row("start, all imported", _NOTHING)
    yield row
    for name, tolerance in (("urban", None), ("living_street", 0.5)):
        tolerance = 3.0 if quick else tolerance
        job = _FRAME.format(scene=str(scenes / f"{name}.toml"), tolerance=tolerance)
        yield _row(f"frame of {name}", job)[3]
    for count in (10_000, 100_000) if quick else (100_000, 1_000_000, _MANY):
        done, peak, tubes, row = _row(f"about {count:,} tubes", _TUBES.format(tubes=count))
        if not done:
            yield barred(row, "<= 1200 MB", False) if count == _MANY else row
            continue
        row.name = f"{tubes:,} tubes"
        row.more["bytes_per_tube"] = round((peak - idle) * 1e6 / max(tubes, 1))
        yield barred(row, "<= 1200 MB", peak <= 1200.0) if count == _MANY else row


def _row(name: str, job: str) -> tuple[bool, float, int, Row]:
    code = _PEAK.format(job=job.strip(), most=_MOST)
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    if ran.returncode:
        last = (ran.stderr.strip().splitlines() or [f"ended with {ran.returncode}"])[-1]
        return False, 0.0, 0, Row("memory", name, float("nan"), met=False, more={"failed": last})
    peak, tubes, took = json.loads(ran.stdout)
    return True, peak, tubes, Row("memory", name, took, more={"peak_mb": round(peak), "tubes": tubes})
