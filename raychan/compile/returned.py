"""Arrays that compiled code returns become Python's without a call of a Python function.

Numba asks Python for the class of each array that it returns, by a function that a Ctrl-C may interrupt; a tuple then
holds nothing where the array should be, and the process ends by a segmentation fault. Here the class is a constant of
the code, as the type of the elements is. This rests on how numba's `box_array` is built; with a version of numba that
it was not tested with, numba's own stays in place.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

import llvmlite.ir as llvm_ir
from numba import types
from numba.core import boxing, cgutils
from numba.core.pythonapi import _boxers
from numba.np import numpy_support

from raychan.compile.linked import FITS


def _box_array(kind: Any, value: Any, box: Any) -> Any:
    """Return code that makes an array of Python's of one of numba's, and gives away its reference."""
    if not box.context.enable_nrt:
        return boxing.box_array(kind, value, box)
    api = box.pyapi
    element, owner = (
        box.env_manager.read_const(box.env_manager.add_const(known))
        for known in (numpy_support.as_dtype(kind.dtype), kind.box_type)
    )
    number = llvm_ir.IntType(32)
    adapt = api._get_function(
        llvm_ir.FunctionType(api.pyobj, [api.voidptr, api.pyobj, number, number, api.pyobj]),
        name="NRT_adapt_ndarray_to_python_acqref",
    )
    adapt.args[0].add_attribute("captures(none)")
    place = box.builder.bitcast(cgutils.alloca_once_value(box.builder, value), api.voidptr)
    made = box.builder.call(adapt, [place, owner, number(kind.ndim), number(int(kind.mutable)), element])
    box.context.nrt.decref(box.builder, kind, value)
    return made


@contextlib.contextmanager
def arrays_at_once() -> Iterator[None]:
    """Let this stand in for numba's within the block."""
    theirs = _boxers.functions[types.Array]
    if FITS:
        _boxers.functions[types.Array] = _box_array
    try:
        yield
    finally:
        _boxers.functions[types.Array] = theirs
