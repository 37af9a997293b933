"""Compiled functions that count no references to arrays do no harm: they neither make arrays nor return them."""

import sys

import numpy as np
import pytest
from numba.core.errors import NumbaError

from raychan.compile.jit import njit
from raychan.compile.linked import FITS

pytestmark = [
    pytest.mark.compiled(reason="it is about compiled code"),
    pytest.mark.skipif(not FITS, reason="this version of numba counts all references"),
]


@njit(cache=True, uncounted=True)
def sums(parts, out):
    for i in range(len(out)):
        row, other = parts[0][i], parts[1][i]
        for j in range(len(row)):
            out[i] += row[j] * other[j]


@njit(cache=True, uncounted=True)
def making(x):
    y = np.empty(3)
    y[0] = x
    return y[0]


@njit(cache=True, uncounted=True)
def returning(x):
    return x, x[1:]


@njit(cache=True)
def counted(x):
    y = x + 1.0
    return first(y), y


@njit(cache=True, uncounted=True)
def first(y):
    return y[0]


def test_references_are_as_many_after_a_call_as_before():
    a, b, out = np.arange(6.0).reshape(2, 3), np.ones((2, 3)), np.zeros(2)
    before = [sys.getrefcount(x) for x in (a, b, out)]
    for _ in range(100):
        sums((a, b), out)
    assert [sys.getrefcount(x) for x in (a, b, out)] == before
    assert out.tolist() == [300.0, 1200.0]


@pytest.mark.parametrize(("kernel", "value"), [(making, 1.0), (returning, np.ones(3))])
def test_one_that_makes_or_returns_arrays_does_not_compile(kernel, value):
    with pytest.raises((NumbaError, TypeError)):
        kernel(value)


def test_a_counted_function_keeps_what_it_lends_to_an_uncounted_one():
    for _ in range(100):
        value, made = counted(np.zeros(1000))
        assert value == 1.0
        assert made.tolist() == [1.0] * 1000
