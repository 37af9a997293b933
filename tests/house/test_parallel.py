"""Rows on many threads, and two works at once: all is done, once, and none goes on when another has failed."""

import os
import subprocess
import sys
import threading
import time
from functools import partial

import pytest

from raychan import parallel
from raychan.parallel import Stopped, parallel_for, parallel_tasks, run_pair, set_threads


@pytest.fixture(autouse=True)
def two():
    """Let two threads work in each test, whatever the machine has."""
    set_threads(2)
    yield
    set_threads(None)


def threads_of(n: int, wanted: int = 2, patience: float = 0.2) -> set[int]:
    """Return the threads on which rows are worked on: each waits until as many as are wanted have come, or for a
    while."""
    seen: set[int] = set()
    came = threading.Condition()

    def some(rows: slice) -> None:
        with came:
            if len(range(n)[rows]):
                seen.add(threading.get_ident())
                came.notify_all()
            came.wait_for(lambda: len(seen) >= wanted, patience)

    parallel_for(n, some, 2)
    return seen


def test_each_row_is_worked_on_once():
    for n in (0, 1, 2, 7, 5000):
        count = [0] * n

        def some(rows: slice, count: list[int] = count) -> None:
            for i in range(rows.start, rows.stop):
                count[i] += 1

        parallel_for(n, some, 2)
        assert count == [1] * n


@pytest.mark.parametrize("threads", [1, 2, 3, 8])
def test_as_many_threads_work_as_were_asked_for(threads):
    set_threads(threads)
    assert parallel.threads() == threads
    assert len(threads_of(100, threads, 10.0)) == threads
    assert len(threads_of(3, min(threads, 3), 10.0)) == min(threads, 3)


def test_rows_that_take_long_do_not_keep_others_waiting():
    # The first of the rows waits for all others: one who shares rows evenly beforehand waits for ever.
    done, rest = [], threading.Event()

    def some(rows: slice) -> None:
        if rows.start == 0:
            assert rest.wait(30.0)
        done.append(rows)
        if sum(r.stop - r.start for r in done) + 13 >= 100 and rows.start:
            rest.set()

    parallel_for(100, some, 2)
    assert sorted((r.start, r.stop) for r in done)[0][0] == 0
    assert sum(r.stop - r.start for r in done) == 100


def test_rows_within_rows_are_worked_on_too():
    total = []
    set_threads(3)
    parallel_for(12, lambda rows: parallel_for(50, lambda inner: total.append(inner.stop - inner.start), 2), 2)
    assert sum(total) % 50 == 0
    assert sum(total) >= 50


@pytest.mark.parametrize("caller_is_quick", [True, False])
def test_a_thread_that_has_no_task_left_helps_with_rows_within_the_task_of_another(caller_is_quick):
    caller, both, quick_ended, late = threading.get_ident(), threading.Barrier(2), threading.Event(), set()

    def task(i: int) -> None:
        both.wait(30.0)
        if (threading.get_ident() == caller) == caller_is_quick:
            quick_ended.set()
            return
        assert quick_ended.wait(30.0)
        deadline = time.monotonic() + 30.0
        while len(late) < 2 and time.monotonic() < deadline:
            late.update(threads_of(100))

    parallel_tasks(2, task)
    assert len(late) == 2


@pytest.mark.parametrize("threads", [1, 2, 3, 8])
def test_each_task_is_done_once(threads):
    set_threads(threads)
    done: list[tuple[int, int]] = []

    def note(i: int, j: int) -> None:
        done.append((i, j))

    for n in (0, 1, 2, 50):
        done.clear()
        parallel_tasks(n, lambda i: parallel_tasks(3, partial(note, i)))
        assert sorted(done) == [(i, j) for i in range(n) for j in range(3)]


def test_what_any_task_raises_is_raised_through_all_loops():
    def inner(i: int, j: int) -> None:
        if (i, j) == (3, 2):
            raise ValueError("3, 2")

    for _ in range(20):
        with pytest.raises(ValueError, match="3, 2"):
            parallel_tasks(8, lambda i: parallel_tasks(4, lambda j: inner(i, j)))
    assert len(threads_of(100, 2, 10.0)) == 2


def test_what_the_rows_of_any_thread_raise_is_raised_and_no_thread_is_lost():
    def some(rows: slice) -> None:
        if rows.stop == 100:
            raise ValueError("last rows")
        time.sleep(0.01)

    for _ in range(3):
        with pytest.raises(ValueError, match="last rows"):
            parallel_for(100, some, 2)
    assert len(threads_of(100, 2, 10.0)) == 2


def test_one_thread_does_one_work_after_the_other():
    set_threads(1)
    order = []
    assert run_pair(lambda: order.append("here") or 1, lambda: order.append("there") or 2) == (1, 2)
    assert order == ["here", "there"]


@pytest.mark.parametrize("wrong", [0, -1, 1001])
def test_a_number_of_threads_that_cannot_be_is_refused(wrong):
    with pytest.raises(ValueError, match=f"threads is {wrong}; it must be between 1 and 1000"):
        set_threads(wrong)
    assert parallel.threads() == 2


@pytest.mark.parametrize(("text", "said"), [("3", "3"), ("", ""), ("two", "'two'"), ("0", "'0'"), ("9999", "'9999'")])
def test_the_environment_says_how_many(text, said, monkeypatch):
    monkeypatch.setenv(parallel.VARIABLE, text)
    set_threads(None)
    if said.startswith("'"):
        with pytest.raises(ValueError, match=f"RAYCHAN_THREADS is {said}; it must be a whole number between 1 and"):
            parallel.threads()
        return
    assert parallel.threads() == (int(said) if said else len(os.sched_getaffinity(0)))


def test_the_command_line_says_how_many():
    code = "import raychan.cli as c, raychan.parallel as p; r = c.invoke({}); print(r, p.threads())"
    env = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    for given, said in ((["run", "--threads", "5"], "0 5"), (["run", "--threads", "0"], "2 ")):
        ran = subprocess.run([sys.executable, "-c", code.format(given)], env=env, capture_output=True, text=True)
        assert ran.stdout.splitlines()[-1].startswith(said), ran.stderr
        assert ("threads is 0" in ran.stderr) == ("0" in given)
    wrong = env | {parallel.VARIABLE: "many"}
    ran = subprocess.run([sys.executable, "-m", "raychan", "run"], env=wrong, capture_output=True, text=True)
    assert ran.returncode == 2
    assert "RAYCHAN_THREADS is 'many'" in ran.stderr


def test_alone_rows_are_shared_by_two_threads_and_beside_another_work_they_are_not():
    assert len(threads_of(100)) == 2
    begun = threading.Event()
    go_on = threading.Event()

    def here() -> set[int]:
        begun.wait(30.0)
        return threads_of(100)

    def there() -> set[int]:
        begun.set()
        found = threads_of(100)
        go_on.wait(0.2)
        return found

    one, other = run_pair(here, there)
    assert one == {threading.get_ident()}
    assert len(other) == 1 and other != one


def test_when_one_work_has_ended_the_other_has_both_threads():
    ended = threading.Event()
    _, late = run_pair(ended.set, lambda: (ended.wait(30.0), time.sleep(0.05), threads_of(100))[-1])
    assert len(late) == 2


@pytest.mark.parametrize("failure", [ValueError, KeyboardInterrupt])
def test_a_work_stops_at_its_next_rows_when_the_first_fails(failure: type[BaseException]):
    begun, stopped = threading.Event(), threading.Event()

    def here() -> None:
        begun.wait(30.0)
        raise failure

    def there() -> None:
        begun.set()
        try:
            while True:
                threads_of(100)
        except Stopped:
            stopped.set()
            raise

    with pytest.raises(failure):
        run_pair(here, there)
    assert stopped.is_set()
    assert len(threads_of(100)) == 2


def test_what_the_second_raises_is_raised():
    def there() -> None:
        raise ValueError("there")

    with pytest.raises(ValueError, match="there"):
        run_pair(lambda: 1, there)


def test_a_ctrl_c_that_compiled_code_handed_on_as_a_fault_is_one():
    def here() -> None:
        inner = SystemError("returned a result with an exception set")
        inner.__cause__ = KeyboardInterrupt()
        raise SystemError("returned a result with an exception set") from inner

    with pytest.raises(KeyboardInterrupt):
        run_pair(here, lambda: None)
