"""What all tests share: which of them need compiled code."""

import os

# As `raychan.blas` does for users; here parts of raychan are called that do not ask for it. Read as numpy is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Skip, with the compiler off, what is marked as needing it."""
    if os.environ.get("NUMBA_DISABLE_JIT", "0") in ("", "0"):
        return
    for item in items:
        mark = item.get_closest_marker("compiled")
        if mark is not None:
            item.add_marker(pytest.mark.skip(reason=mark.kwargs["reason"]))
