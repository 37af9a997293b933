"""Parts that stand in for numba's while kernels are compiled: the same code comes out, and numba has its own again."""

import re

import numba
import numpy as np
import pytest

from raychan.compile import quick_numba as module
from raychan.compile.quick_numba import quick_numba

pytestmark = pytest.mark.skipif(not module.FITS, reason="another version of numba keeps all its parts")


def body(x, table, label):
    """Have loops, branches, tuples, arrays, a text, a complex number and an error in it."""
    total, best = 0j, (0, -1.0)
    for i in range(len(x)):
        a, b = table[i % 2]
        if x[i] > a:
            total += np.exp(1j * x[i]) * b
        elif label == "skip":
            continue
        best = (i, x[i]) if x[i] > best[1] else best
    if best[0] < 0:
        raise ValueError("none")
    return total, best, np.sort(x)[::-1].copy()


def text_of(kernel):
    """Return the lines of a function's machine code, without the numbers in which no two compilations are alike."""
    (signature,) = kernel.inspect_asm()
    lines = re.sub(r"v\d+|\b0x[0-9a-f]+|\d{6,}|B\d+", "", kernel.inspect_asm()[signature]).splitlines()
    return [line for line in lines if "missing Environment" not in line]  # its size is that of a name with numbers


def compiled():
    kernel = numba.njit(body)
    kernel.compile(
        (numba.float64[::1], numba.types.UniTuple(numba.types.UniTuple(numba.float64, 2), 2), numba.types.unicode_type)
    )
    return kernel


def test_the_same_code_comes_out():
    with quick_numba():
        quick = compiled()
    usual, x = compiled(), np.random.default_rng(1).normal(size=50)
    given = x, ((0.1, 2.0), (0.2, 3.0)), "skip"
    for one, other in zip(quick(*given), usual(*given), strict=True):
        np.testing.assert_array_equal(one, other)
    assert text_of(quick) == text_of(usual)


def test_numba_has_its_parts_again_after_an_error_too():
    before = {name: getattr(owner, name) for name, (owner, _) in module._OURS.items()}
    with pytest.raises(numba.core.errors.TypingError), quick_numba():
        numba.njit(lambda x: x.nothing_of_this_name).compile((numba.float64,))
    assert {name: getattr(owner, name) for name, (owner, _) in module._OURS.items()} == before
