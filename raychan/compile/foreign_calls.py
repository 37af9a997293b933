"""Calls of C functions from compiled code, by their address.

The address travels as a number, an argument like any other: it is not part of the compiled code, which so stays valid
on disk while the library lies elsewhere in each process.
"""

from __future__ import annotations

import ctypes
import hashlib
from pathlib import Path
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, overload

_POINTERS = 4


def call(function: Any, first: Any, second: Any, third: Any, fourth: Any) -> None:
    """Call the C function at an address with four pointers; what it returns is lost.

    This is what runs with the compiler off; compiled code makes the call itself, without the interpreter. Neither
    checks anything: a wrong address ends the process.
    """
    kind = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * _POINTERS)
    kind(int(function))(int(first), int(second), int(third), int(fourth))


# Kernels that make calls are compiled again when this file changes.
call.stamp = hashlib.sha256(Path(__file__).read_bytes()).digest()  # type: ignore[attr-defined]


@intrinsic
def _emitted(typing: Any, function: Any, first: Any, second: Any, third: Any, fourth: Any) -> Any:
    """Emit the call itself."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        pointer = ir.IntType(8).as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [pointer] * _POINTERS)
        where = builder.inttoptr(args[0], kind.as_pointer())
        builder.call(where, [builder.inttoptr(a, pointer) for a in args[1:]])
        return context.get_dummy_value()

    return types.void(*[types.uintp] * (_POINTERS + 1)), generate


@overload(call)
def _compiled_call(function, first, second, third, fourth):  # type: ignore[no-untyped-def]
    def made(function, first, second, third, fourth):  # type: ignore[no-untyped-def]
        _emitted(function, first, second, third, fourth)  # type: ignore[call-arg]

    return made
