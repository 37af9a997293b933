"""While raychan computes, BLAS works on one thread; before and afterwards on as many as it had."""

import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="BLAS has one thread on one core")

START = """
import sys, threading
import numpy
from threadpoolctl import threadpool_info
import raychan as rc
from raychan.blas import on_one_blas_thread
def most():
    return max(x["num_threads"] for x in threadpool_info() if x["user_api"] == "blas")
seen = on_one_blas_thread(most)
"""
THREADS = """
first, second = threading.Event(), threading.Event()
@on_one_blas_thread
def waits():
    first.set()
    assert second.wait(10.0)
thread = threading.Thread(target=waits)
thread.start()
assert first.wait(10.0)
print(seen())
second.set()
thread.join()
print(most())
"""
OVERLAP = """
first, second, third = threading.Event(), threading.Event(), threading.Event()
@on_one_blas_thread
def begins():
    first.set()
    assert second.wait(10.0)
@on_one_blas_thread
def ends():
    second.set()
    assert third.wait(10.0)
    print(most())
one, other = threading.Thread(target=begins), threading.Thread(target=ends)
one.start()
assert first.wait(10.0)
other.start()
one.join()
third.set()
other.join()
print(most(), seen(), most())
"""
FAILS = """
try:
    on_one_blas_thread(lambda: 1 / 0)()
except ZeroDivisionError:
    print(most())
"""
RUN = """
found = set()
rc.simulate(rc.Scene.load(sys.argv[1]), progress=lambda stage, share: found.add(most()))
print(found, most())
"""
SCENE = """
[radar]
position = [0, 0, 1]
waveform = { carrier_ghz = 77.0, bandwidth_mhz = 300.0, chirp_us = 20.0, chirps = 16, samples = 64 }
[[bodies]]
name = "point"
shape = "sphere"
params = { radius = 0.1 }
position = [20, 0, 1]
"""


def said(code, *args):
    """Return what a new process prints that begins with two threads of BLAS."""
    env = os.environ | {"OPENBLAS_NUM_THREADS": "2"}
    call = [sys.executable, "-c", START + code, *args]
    run = subprocess.run(call, capture_output=True, text=True, env=env)
    assert run.returncode == 0, run.stderr
    return run.stdout.split()


def test_blas_has_one_thread_within_and_those_it_had_afterwards():
    nested = "print(most(), seen(), most(), *on_one_blas_thread(lambda: (seen(), most()))(), most())"
    assert said(nested) == ["2", "1", "2", "1", "1", "2"]


def test_an_error_gives_blas_its_threads_back():
    assert said(FAILS) == ["2"]


def test_several_threads_at_once_leave_blas_the_threads_it_had():
    assert said(THREADS) == ["1", "2"]


def test_threads_whose_calls_overlap_leave_blas_the_threads_it_had():
    assert said(OVERLAP) == ["1", "2", "1", "2"]


def test_a_simulation_computes_on_one_thread_of_blas_and_leaves_the_users_alone(tmp_path):
    (tmp_path / "point.toml").write_text(SCENE)
    assert said(RUN, str(tmp_path / "point.toml")) == ["{1}", "2"]
