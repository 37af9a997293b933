"""Two works at once: both are done, on threads of their own, and none goes on when the other has failed."""

import threading
import time

import pytest

from raychan.parallel import Stopped, parallel_for, run_pair


def threads_of(n: int) -> set[int]:
    """Return the threads on which rows are worked on."""
    seen: set[int] = set()
    parallel_for(n, lambda rows: seen.add(threading.get_ident()) if len(range(n)[rows]) else None, 2)
    return seen


def test_each_row_is_worked_on_once():
    for n in (0, 1, 2, 7, 5000):
        count = [0] * n

        def some(rows: slice, count: list[int] = count) -> None:
            for i in range(rows.start, rows.stop):
                count[i] += 1

        parallel_for(n, some, 2)
        assert count == [1] * n


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
