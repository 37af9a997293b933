"""Threads: whole frames on two against one, what of a frame is done outside every loop that threads share, for what the
second thread waits, and how fast two frames at once are that share nothing but the interpreter, or, as processes, but
the machine: no division of one frame among threads is faster."""

from __future__ import annotations

import multiprocessing
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import raychan as rc
from bench.measure import Row, barred, paired, seconds
from raychan import parallel

_BAR, _SERIAL = 1.0 / 1.85, 0.1
_PATIENCE = 1800.0  # s: a process that failed puts nothing


def threads(scenes: Path, repeats: int, quick: bool) -> Iterator[Row]:
    """Run the urban street and the living street at 0.5 dB on one thread and on two, in turn."""
    for name in ("urban", "living_street"):
        scene, tolerance = rc.Scene.load(scenes / f"{name}.toml"), 3.0 if quick else 0.5
        rc.simulate(scene, tolerance_db=tolerance)

        def run(count: int, scene: rc.Scene = scene, tolerance: float = tolerance) -> float:
            parallel.set_threads(count)
            try:
                return seconds(lambda: rc.simulate(scene, tolerance_db=tolerance))
            finally:
                parallel.set_threads(None)

        row = paired(
            "threads", f"{name}, {tolerance:g} dB, two threads", [(run(2), run(1)) for _ in range(repeats)], "one"
        )
        yield barred(row, f"<= {_BAR:.2f}", row.ratio <= _BAR)
        yield _at_once(scene, name, tolerance, repeats)
        yield _processes(scene, name, tolerance, repeats)
        with _shared() as spent:
            whole = run(1)
        share = 1.0 - spent[0] / whole
        row = Row("threads", f"{name}: outside shared loops", whole - spent[0], "whole frame", whole, share)
        yield barred(row, f"<= {_SERIAL:g}", share <= _SERIAL)
        yield from _waits(name, lambda run=run: run(2))  # type: ignore[misc]


def _waits(name: str, run: Callable[[], float]) -> Iterator[Row]:
    """Give rows of a frame on two threads: what both wait for, of twice its time."""
    with _waited() as waited:
        start = process_time()
        took = 2.0 * run()
        idle = took - (process_time() - start)
    rest = idle - sum(waited.values())
    for what, spent in (
        ("no loop to help with", waited["_serve"]),
        ("the others at the end of a loop", waited["finish"]),
        ("the interpreter and the rest", rest),
    ):
        yield Row("threads", f"{name}: waits for {what}", spent, "both threads", took, spent / took)


@contextmanager
def _waited() -> Iterator[dict[str, float]]:
    """Give the seconds that threads wait, by the function of the crew that does."""
    changed, spent = parallel._crew._changed, {"_serve": 0.0, "finish": 0.0}
    real = changed.wait

    def timed(*args: Any) -> bool:
        name, start = sys._getframe(1).f_code.co_name, perf_counter()
        try:
            return real(*args)
        finally:
            spent[name] += perf_counter() - start

    changed.wait = timed  # type: ignore[method-assign]
    try:
        yield spent
    finally:
        changed.wait = real  # type: ignore[method-assign]


def _at_once(scene: rc.Scene, name: str, tolerance: float, repeats: int) -> Row:
    """Return the row of two frames at once, each on a thread of its own, against the same one after the other."""
    scenes = [rc.Scene.load(str(scene.path)) for _ in range(2)]

    def frame(one: rc.Scene) -> None:
        rc.simulate(one, tolerance_db=tolerance)

    def both() -> None:
        workers = [threading.Thread(target=frame, args=(one,)) for one in scenes]
        for worker in workers:
            worker.start()
        for worker in workers:
            worker.join()

    parallel.set_threads(1)
    try:
        for one in scenes:
            frame(one)
        pairs = [(seconds(both), sum(seconds(lambda one=one: frame(one)) for one in scenes)) for _ in range(repeats)]  # type: ignore[misc]
    finally:
        parallel.set_threads(None)
    return paired("threads", f"{name}: two frames at once, a thread each", pairs, "one after the other")


def _processes(scene: rc.Scene, name: str, tolerance: float, repeats: int) -> Row:
    """Return the row of two frames at once, each in a process of its own, against the same one after the other."""
    many, pairs = multiprocessing.get_context("spawn"), []
    for count in (1, 2):
        start, times = many.Barrier(count), many.Queue()
        given = str(scene.path), tolerance, repeats, start, times
        workers = [many.Process(target=_frames, args=given) for _ in range(count)]
        for worker in workers:
            worker.start()
        pairs.append([times.get(timeout=_PATIENCE) for _ in workers])
        for worker in workers:
            worker.join()
    (one,), both = pairs
    took = [(max(a, b), 2.0 * alone) for a, b, alone in zip(*both, one, strict=True)]
    return paired("threads", f"{name}: two frames at once, a process each", took, "one after the other")


def _frames(file: str, tolerance: float, repeats: int, start: Any, times: Any) -> None:
    """Put the seconds of frames on one thread, once as many processes as shall run at once are ready."""
    parallel.set_threads(1)
    scene = rc.Scene.load(file)
    rc.simulate(scene, tolerance_db=tolerance)
    start.wait()
    times.put([seconds(lambda: rc.simulate(scene, tolerance_db=tolerance)) for _ in range(repeats)])


@contextmanager
def _shared() -> Iterator[list[float]]:
    """Give the seconds that the calling thread spends in loops that threads share, calls within calls counted once."""
    caller, spent, inside = threading.get_ident(), [0.0], [False]

    def timed(real: Callable[..., None], shared: bool, *args: Any) -> None:
        if not shared or inside[0] or threading.get_ident() != caller:
            return real(*args)
        inside[0], start = True, perf_counter()
        try:
            return real(*args)
        finally:
            inside[0] = False
            spent[0] += perf_counter() - start

    # Loops too short for a second thread are not shared.
    rows, tasks = parallel.parallel_for, parallel.parallel_tasks
    with (
        _replaced(rows, lambda n, work, least=2000: timed(rows, n >= least, n, work, least)),
        _replaced(tasks, lambda n, task: timed(tasks, n > 1, n, task)),
    ):
        yield spent


@contextmanager
def _replaced(real: Callable[..., None], other: Callable[..., None]) -> Iterator[None]:
    """Put another function in place of one of `raychan.parallel`, in all modules."""
    name = real.__name__
    modules = [m for m in list(sys.modules.values()) if getattr(m, name, None) is real]
    for module in modules:
        setattr(module, name, other)
    try:
        yield
    finally:
        for module in modules:
            setattr(module, name, real)
